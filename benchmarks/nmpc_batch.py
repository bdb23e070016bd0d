"""Many walkers at once: plans per second and footsteps against the single path, for 1 to 4096 walkers.

    PYTHONPATH=tests python benchmarks/nmpc_batch.py [--out benchmarks/results/nmpc_batch.json]

Whole iterations, assembly and solver. The named peer in the same run is the single path itself, DAQP in a loop over the
walkers. Moments of a walk at random, half of them pushed, all between up to three circles; a last plan is at hand.
"""

# pyright: reportMissingImports=false
# the tests are on the path, see above
from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from walk.nmpc_cases import ICUB, random_circles, random_command, random_state

from toddle.outside.batch_solver import cores
from toddle.outside.machine import machine_in_words
from toddle.outside.versions import versions
from toddle.walk.pattern.batch import plan_batch, start_batch, step_batch
from toddle.walk.pattern.batch_daqp import plan_each
from toddle.walk.pattern.batch_state import BatchPlan, BatchState, padded, stacked
from toddle.walk.pattern.nmpc import nmpc

SIZES = (1, 64, 1024, 4096)
SECONDS = 2.0  # of repeating each measurement, at least once and at most 200 times
CIRCLES = 3


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=None)
    arguments = parser.parse_args()
    problem, cases = nmpc(ICUB), Cases(SIZES[-1])
    alone = plan_each(problem, *cases.take(SIZES[-1]))
    rates: dict[str, dict[int, dict]] = {"daqp, one after the other": {}, "daqp, processes": {}, "jax, float32": {}}
    with cores(problem) as pool:
        for size in SIZES:
            given = cases.take(size)
            rates["daqp, one after the other"][size] = rate(lambda g=given: plan_each(problem, *g), size)
            rates["daqp, processes"][size] = rate(lambda g=given: pool.plan(*g), size, wall_only=True)
            rates["jax, float32"][size] = rate(as_one_call(problem, given), size)
    result = {
        "benchmark": "nmpc_batch",
        "what": f"plans per second, {CIRCLES} circles; medians; cpu: of all cores together",
        "plans_per_second": rates,
        "closed_loop_steps_per_second": {"jax, float32, 1024 walkers": closed_loop(problem, 1024)},
        "footsteps_against_the_single_path_mm": {
            "float32": distances(problem, cases.take(1024), alone, np.float32),
            "float64": distances(problem, cases.take(1024), alone, np.float64),
        },
        "accelerators": "not measured",
        "load_average": round(os.getloadavg()[0], 1),
        "machine": machine_in_words(),
        "versions": versions(),
        "command": "PYTHONPATH=tests python benchmarks/nmpc_batch.py",
    }
    print(json.dumps(result, indent=2))
    if arguments.out is not None:
        arguments.out.write_text(json.dumps(result, indent=2) + "\n")


class Cases:
    """Random moments, commands, circles and last plans: a pool of 1024, repeated for more walkers."""

    def __init__(self, most: int) -> None:
        rng, problem, count = np.random.default_rng(5), nmpc(ICUB), 1024
        states = [random_state(ICUB, rng, float(kick)) for kick in rng.choice([0.0, 0.3], count)]
        circles = padded([random_circles(state, rng, CIRCLES) for state in states], np.float64)
        before, now = (np.array([random_command(rng, 0.7) for _ in states]) for _ in range(2))
        stack = stacked(states, np.float64)
        self.parts = (stack, now, circles, plan_each(problem, stack, before, circles))

    def take(self, size: int) -> tuple[BatchState, np.ndarray, np.ndarray, BatchPlan]:
        """So many of them."""
        return jax.tree.map(lambda part: np.resize(part, (size, *part.shape[1:])), self.parts)


def rate(call: Callable[[], Any], size: int, wall_only: bool = False) -> dict[str, float]:
    """Plans per second of wall clock and of processor time; the first call is not counted."""
    call()
    wall, cpu, end = [], [], time.perf_counter() + SECONDS
    while not wall or (time.perf_counter() < end and len(wall) < 200):
        began, used = time.perf_counter(), time.process_time()
        call()
        wall.append(time.perf_counter() - began)
        cpu.append(time.process_time() - used)
    found = {"wall": round(size / float(np.median(wall)), 1)}
    return found if wall_only else found | {"cpu": round(size / float(np.median(cpu)), 1)}


def as_one_call(problem, given: tuple) -> Callable[[], Any]:
    ready = on_device(given, np.float32)
    return lambda: jax.block_until_ready(plan_batch(problem, *ready))


def on_device(given: tuple, dtype: type) -> tuple:
    return jax.tree.map(lambda part: jnp.asarray(part, dtype if part.dtype.kind == "f" else None), given)


def closed_loop(problem, walkers: int) -> dict[str, float]:
    """Point walkers under constant commands, ten iterations in one scan."""
    rng = np.random.default_rng(6)
    velocities = jnp.asarray(np.array([random_command(rng, 0.7) for _ in range(walkers)]), jnp.float32)

    @jax.jit
    def run(walk):
        return jax.lax.scan(lambda at, _: (step_batch(problem, at, velocities), None), walk, length=10)[0]

    start = start_batch(problem, walkers)
    return rate(lambda: jax.block_until_ready(run(start)), 10 * walkers)


def distances(problem, given: tuple, alone: BatchPlan, dtype: type) -> dict[str, Any]:
    """The greatest difference of a footstep of each walker, of all and where balance and clearance hold."""
    with jax.enable_x64(dtype == np.float64):
        found = plan_batch(problem, *on_device(given, dtype))
        feet, status = np.asarray(found.feet, float), np.asarray(found.status)
    wanted = jax.tree.map(lambda part: part[: len(feet)], alone)
    away = 1e3 * np.abs(feet - wanted.feet)[..., :2].max(axis=(1, 2))
    kept = (wanted.violation < 1e-3) & (wanted.overlap < 1e-3)
    return {
        "all": spread(away),
        "balance and clearance kept to 1 mm": spread(away[kept]),
        "another status": int((status != wanted.status).sum()),
    }


def spread(away: np.ndarray) -> dict[str, float]:
    median, p99, most = (float(f"{x:.2g}") for x in (*np.percentile(away, [50, 99]), away.max()))
    return {"walkers": len(away), "median": median, "p99": p99, "most": most, "over_1_mm": int((away > 1).sum())}


if __name__ == "__main__":
    main()
