"""This project's PPO beside Stable-Baselines3's: one run, one core, the document's point, the same numbers.

    python -m benchmarks.navigation.peers               # about five minutes, and some for installing PyTorch

Three ways: ours with the task in JAX, ours by way of Gymnasium, and Stable-Baselines3 (installed into an environment
of its own in the cache) on the same numpy environment. Each learns until the deterministic test, held every 20,480
steps on goals nobody learned from, is solved: 311 wins in 10,000 steps on average of ten runs, and no loss. Times are
CPU seconds of the process; tests don't count, and what JAX compiles counts apart.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

from toddle.navigate.ppo.presets import preset
from toddle.outside.compile_cache import cache_home
from toddle.outside.files import write_json
from toddle.outside.machine import machine_in_words
from toddle.outside.versions import versions

ROOT = Path(__file__).parents[2]
RESULT = ROOT / "benchmarks" / "results" / "navigation_peers.json"
PACKAGES = ("torch==2.13.0", "stable-baselines3==2.9.2", "gymnasium==1.4.0", "jax==0.10.2", "jaxtyping==0.3.11")
WAYS = {
    "toddle": ("benchmarks.navigation.with_toddle", "jax"),
    "toddle_gymnasium": ("benchmarks.navigation.with_toddle", "gymnasium"),
    "stable_baselines3": ("benchmarks.navigation.with_sb3", ""),
}
"""Module and how, by name."""
CHECK_STEPS, SECONDS, INSTALL_SECONDS = 20_480, 900, 900


def main() -> None:
    parser = argparse.ArgumentParser(
        "python -m benchmarks.navigation.peers",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--ways", nargs="+", choices=tuple(WAYS), default=tuple(WAYS))
    parser.add_argument("--sb3", type=Path, default=None, help="interpreter that has Stable-Baselines3")
    parser.add_argument("--out", type=Path, default=RESULT)
    asked = parser.parse_args()
    pythons = dict.fromkeys(asked.ways, Path(sys.executable))
    if "stable_baselines3" in pythons:
        pythons["stable_baselines3"] = asked.sb3 or made()
    runs: dict[str, list[dict[str, Any]]] = {name: [] for name in asked.ways}
    for seed in range(asked.seeds):  # in turn, so that a busy machine is busy for all
        for name in asked.ways:
            runs[name].append(one(name, pythons[name], seed))
            print(name, seed, {key: runs[name][-1][key] for key in FIGURES}, flush=True)
    write_json(asked.out, content(runs, asked.seeds))


FIGURES = ("steps_per_second", "solved_at_steps", "solved_after_seconds", "compile_seconds")


def one(name: str, python: Path, seed: int) -> dict[str, Any]:
    """One way, one seed, in a process of its own."""
    module, through = WAYS[name]
    config = dataclasses.asdict(preset("point"))
    asked = {
        "through": through, "config": config, "seed": seed, "check_steps": CHECK_STEPS, "wins": 311.0,
        "test_seed": 1_000_000 + 1000 * seed, "test_runs": 10, "test_steps": 10_000,
    }  # fmt: skip
    threads = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}
    command = [str(python), "-W", "ignore", "-m", module, json.dumps(asked)]
    environment = {**os.environ, **threads, "PYTHONPATH": str(ROOT / "src"), "JAX_PLATFORMS": "cpu"}
    done = subprocess.run(
        [*_on_one_core(), *command], cwd=ROOT, env=environment, capture_output=True, text=True, timeout=SECONDS
    )
    if done.returncode:
        raise SystemExit(f"{name}: {done.stderr.strip().splitlines()[-1]}")
    found = json.loads(done.stdout.splitlines()[-1])
    last = found["checks"][-1]
    solved = last["wins"] >= asked["wins"] and last["losses"] == 0
    return {
        "env": "toddle/Point-v0",
        "seed": seed,
        "version": found["version"],
        "steps": last["steps"],
        "train_seconds": round(last["cpu_seconds"], 3),
        "steps_per_second": round(last["steps"] / last["cpu_seconds"]),
        "compile_seconds": round(found["compile_seconds"], 2),
        "solved_at_steps": last["steps"] if solved else None,
        "solved_after_seconds": round(last["cpu_seconds"], 3) if solved else None,
        "wins": last["wins"],
        "losses": last["losses"],
        "wins_at_checks": [check["wins"] for check in found["checks"]],
    }


def _on_one_core() -> Sequence[str]:
    if shutil.which("taskset") is None:
        return ()
    return ("taskset", "-c", str(max(os.sched_getaffinity(0))))


def content(runs: dict[str, list[dict[str, Any]]], seeds: int) -> dict[str, Any]:
    """What is written: all runs, their medians, and ours over theirs."""
    medians = {
        name: {
            "steps_per_second": median(row["steps_per_second"] for row in rows),
            "compile_seconds": median(row["compile_seconds"] for row in rows),
            "solved": sum(row["solved_at_steps"] is not None for row in rows),
            **{key: _median([row[key] for row in rows]) for key in ("solved_at_steps", "solved_after_seconds")},
        }
        for name, rows in runs.items()
    }
    theirs = medians.get("stable_baselines3")
    return {
        "benchmark": "navigation_peers",
        "what": "PPO on the document's point: CPU seconds and steps until the deterministic test is solved",
        "remark": "by way of Gymnasium actions are clipped to their bounds, which the other two let their noise cross",
        "command": "python -m benchmarks.navigation.peers",
        "seeds": seeds,
        "machine": f"{machine_in_words()}, one core used",
        "versions": versions(),
        "packages": list(PACKAGES),
        "config": dataclasses.asdict(preset("point")),
        "medians": medians,
        "steps_per_second_over_stable_baselines3": {
            name: round(row["steps_per_second"] / theirs["steps_per_second"], 1) for name, row in medians.items()
        }
        if theirs
        else {},
        "runs": runs,
    }


def _median(values: list[Any]) -> float | None:
    """Of all runs, None where half of them or more never got there."""
    known = sorted(value for value in values if value is not None)
    return median([*known, *[float("inf")] * (len(values) - len(known))]) if 2 * len(known) > len(values) else None


def made() -> Path:
    """The interpreter of an environment with Stable-Baselines3, in the cache; by pip, which knows PyTorch's wheels."""
    folder = cache_home(os.environ) / "peers" / "stable_baselines3"
    python, stamp = folder / "bin" / "python", folder / "installed.json"
    if stamp.exists() and json.loads(stamp.read_text()) == list(PACKAGES):
        return python
    for command in (
        [sys.executable, "-m", "venv", "--clear", str(folder)],
        [str(python), "-m", "pip", "install", "--quiet", *PACKAGES],
    ):
        subprocess.run(command, check=True, timeout=INSTALL_SECONDS)
    stamp.write_text(json.dumps(list(PACKAGES)))
    return python


if __name__ == "__main__":
    main()
