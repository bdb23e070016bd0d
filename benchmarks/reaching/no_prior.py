"""Bodies learned with nothing assumed: open loop and after looks, on unseen reachable targets.

    python -m benchmarks.reaching.no_prior [--body panda] [--kind network] [--noise 0] [--seed 0] [--out FILE]

One cell of the table a call (a body, a kind of model, a noise, a seed); with --out it joins the others in the file.
Times are CPU seconds of the process on one thread (set OMP_NUM_THREADS=1), so that other work on the machine does not
count. Errors are true ones, in millimetres. The movements' noise is on each axis; the looks are without noise, and then
again with 2 mm on each axis.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.reaching.screw_bodies import made
from toddle.outside.versions import versions
from toddle.reach.model.kernel import fit_kernel
from toddle.reach.model.network import fit_network
from toddle.reach.observe import observer
from toddle.reach.solve.gauss_newton import solve_model
from toddle.reach.solve.looking import correct
from toddle.robots.catalogue import load
from toddle.robots.linkage import poses
from toddle.signals import Experience

TARGETS, LOOKS, LOOK_NOISE = 1000, 6, 2e-3
MOVEMENTS = {"bha": 2_000}  # of others 20,000
Tip = Callable[[np.ndarray], np.ndarray]


def body(name: str) -> tuple[Tip, np.ndarray, np.ndarray]:
    """Where the tip is, and the limits."""
    if name == "bha":
        soft = load(name)
        return observer(soft), np.asarray(soft.lower, float), np.asarray(soft.upper, float)
    arm = made(name)
    return lambda q: poses(arm.linkage, q)[:, :3, 3], arm.lower, arm.upper


def cell(name: str, kind: str, movements: int, noise: float, seed: int) -> dict[str, object]:
    """Learn a body and reach."""
    tip, lower, upper = body(name)
    rng = np.random.default_rng([seed, 1])
    q = rng.uniform(lower, upper, (movements, len(lower)))
    seen = Experience(q, tip(q) + noise * rng.normal(size=(movements, 3)))
    start = time.process_time()
    if kind == "network":
        # the machine is shared: the steps are the default's, and no clock stops them
        fit = fit_network(seen, lower, upper, seed=seed, seconds=600.0)
    else:
        fit = fit_kernel(seen, lower, upper, seed=seed)
    fitted = time.process_time() - start
    unseen = rng.uniform(lower, upper, (TARGETS, len(lower)))
    targets = tip(unseen)
    start = time.process_time()
    answers = solve_model(fit.model, targets, lower, upper, memory=(seen.q, seen.x))
    solved = time.process_time() - start
    found: dict[str, object] = {
        "body": name, "kind": kind, "movements": movements, "noise_mm": 1000 * noise, "seed": seed,
        "fit_cpu_seconds": round(fitted, 1), "solve_cpu_ms_per_target": round(1000 * solved / TARGETS, 2),
        "model_error_mm": _summary(fit.model.forward(unseen) - targets), "sensor_mm": round(1000 * fit.sensor, 3),
    }  # fmt: skip
    for sensor in (0.0, LOOK_NOISE):

        def observe(q: np.ndarray, sensor: float = sensor) -> np.ndarray:
            return tip(q) + sensor * rng.normal(size=(len(q), 3))

        course = correct(fit.model, None, observe, targets, answers.q, LOOKS, sensor=sensor, lower=lower, upper=upper)
        misses = np.stack([tip(q) for q in course.q]) - targets
        found[f"after_looks_with_{1000 * sensor:.0f}mm_noise"] = [_summary(miss) for miss in misses]
        inside = np.linalg.norm(misses, axis=2) <= course.expected_90
        found[f"inside_expected_90_with_{1000 * sensor:.0f}mm_noise"] = [round(float(i.mean()), 3) for i in inside]
    return found


def _summary(miss: np.ndarray) -> dict[str, float]:
    far = 1000 * np.linalg.norm(miss, axis=1)
    return {
        "mean": round(float(far.mean()), 4),
        "p99": round(float(np.percentile(far, 99)), 4),
        "max": round(float(far.max()), 4),
        "percent_under_1mm": round(100 * float((far < 1).mean()), 2),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--body", default="panda")
    parser.add_argument("--kind", choices=("network", "kernel"), default="network")
    parser.add_argument("--noise", type=float, default=0.0, help="of the movements on each axis [m]")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=None)
    args = parser.parse_args()
    found = cell(args.body, args.kind, MOVEMENTS.get(args.body, 20_000), args.noise, args.seed)
    print(json.dumps(found, indent=2))
    if args.out is not None:
        _join(args.out, found)


def _join(path: Path, found: dict[str, object]) -> None:
    """Put a cell among the others, in place of an older one."""
    cells = json.loads(path.read_text())["cells"] if path.exists() else []
    key = ("body", "kind", "noise_mm", "seed")
    cells = [each for each in cells if any(each[part] != found[part] for part in key)] + [found]
    whole = {
        "benchmark": "reaching_no_prior",
        "what": f"nothing assumed of the body; {TARGETS} unseen reachable targets, errors in mm after 0, 1, ... looks",
        "command": "python -m benchmarks.reaching.no_prior --body BODY --kind KIND --noise METRES --seed SEED",
        "versions": versions(),
        "cells": sorted(cells, key=lambda each: tuple(each[part] for part in key)),
    }
    path.write_text(json.dumps(whole, indent=2) + "\n")


if __name__ == "__main__":
    main()
