"""The native solver, a query at a time and in batches: success, microseconds, and how right its verdicts are.

    python -m benchmarks.reaching.query                      # every arm; about two minutes of processor time
    python -m benchmarks.reaching.query --arms panda --out runs/query.json

Three kinds of targets, full pose and position alone, limits kept, one core, warm: *reachable* ones (the pose of 4,096
random postures, for each seed); *anywhere* (positions uniform in a box 1.3 times the workspace's, any rotation); *at
the border* (reachable poses shifted by up to 10 cm). For the last two the truth is the best of 150 Newton descents to
the least-squares minimum from other random postures, and the distance to the target is compared as well. Batches are
timed in processor time, the best of three; single queries by the clock, the call from Python included, with other work
on the machine. Compiling is timed in a process of its own with an empty cache. From the root of the repository.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from toddle.outside.compile_cache import use_compile_cache

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
use_compile_cache()  # before Numba is imported

import numpy as np  # noqa: E402
from scipy.spatial.transform import Rotation  # noqa: E402

from benchmarks.reaching.screw_bodies import made  # noqa: E402
from toddle.outside.files import write_json  # noqa: E402
from toddle.outside.machine import machine_in_words  # noqa: E402
from toddle.outside.versions import versions  # noqa: E402
from toddle.reach.solve.damped import RADIAN, DampedSolver, damped_solver  # noqa: E402
from toddle.reach.solve.reachable import settled  # noqa: E402
from toddle.robots.dh import Row, from_table  # noqa: E402
from toddle.robots.linkage import Linkage, linkage_of, poses  # noqa: E402

ROOT = Path(__file__).parents[2]
ARMS = ("panda", "xarm7", "talos7", "icub_arm", "gen3", "baxter", "ur5", "kinova", "tiago", "planar:20")
SEEDS, BATCH, SINGLE, JUDGED, STARTS = (0, 1, 2), 4096, 2000, 500, 150
_COLD = """
import time, resource, numpy as np
from benchmarks.reaching.query import arm
solver, linkage = arm("panda")
used = lambda: sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
start = used()
solver.solve_one(np.array([0.4, 0.1, 0.5]), np.eye(3))
first = used()
solver.solve_one(np.array([9.0, 0.1, 0.5]), np.eye(3))
print(first - start, used() - first)
"""


def gen3() -> tuple[Linkage, np.ndarray, np.ndarray, tuple[int, ...]]:
    """Kinova's Gen3, seven joints, by its user guide's Denavit-Hartenberg table."""
    turn, half = np.pi, np.pi / 2
    shifts = (-0.2848, -0.0118, -0.4208, -0.0128, -0.3143, 0.0, -0.1674)
    limits = (turn, 2.41, turn, 2.66, turn, 2.23, turn)
    rows = [
        Row(
            f"joint{i + 1}",
            theta=turn if i else 0.0,
            d=shifts[i],
            alpha=half if i < 6 else turn,
            limits=(-limits[i], limits[i]),
        )
        for i in range(7)
    ]
    chain = from_table("gen3", rows)
    return linkage_of(chain), np.asarray(chain.lower, float), np.asarray(chain.upper, float), chain.coordinates


def arm(name: str) -> tuple[DampedSolver, Linkage]:
    """An arm's solver and its constants."""
    if name == "gen3":
        linkage, lower, upper, coordinates = gen3()
    else:
        body = made(name)
        linkage, lower, upper, coordinates = body.linkage, body.lower, body.upper, body.coordinates
    return damped_solver(linkage, lower, upper, coordinates=coordinates), linkage


def reachable(solver: DampedSolver, linkage: Linkage, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Where and how random postures put the tip."""
    span = solver.upper - solver.lower
    q = solver.lower + span * np.random.default_rng(1000 + seed).random((count, len(span)))
    pose = poses(linkage, q)
    return np.ascontiguousarray(pose[:, list(solver.coordinates), 3]), np.ascontiguousarray(pose[:, :3, :3])


def queried(solver: DampedSolver, linkage: Linkage, posed: bool) -> dict[str, Any]:
    """Success and time over reachable targets."""
    solved, strict, batch, single = [], [], [], []
    for seed in SEEDS:
        x, turns = reachable(solver, linkage, BATCH, seed)
        asked = turns if posed else None
        answers = solver.solve(x, asked)
        for _ in range(3):
            start = time.process_time()
            solver.solve(x, asked)
            batch.append((time.process_time() - start) / BATCH)
        pose = poses(linkage, answers.q)
        distance = np.linalg.norm(pose[:, list(solver.coordinates), 3] - x, axis=1)
        angle = Rotation.from_matrix(pose[:, :3, :3].transpose(0, 2, 1) @ turns).magnitude() if posed else 0 * distance
        inside = ((solver.lower <= answers.q) & (answers.q <= solver.upper)).all(axis=1)
        solved.append(np.mean(inside & (distance < 1e-3) & (angle < 0.01)))
        strict.append(np.mean(inside & (distance < 1.01e-5) & (angle < 1.01e-4)))
        for row in range(SINGLE // len(SEEDS)):
            start = time.perf_counter()
            solver.solve_one(x[row], turns[row] if posed else None)
            single.append(time.perf_counter() - start)
    return {
        "success_percent_1mm_10mrad": [round(100 * float(share), 3) for share in solved],
        "success_percent_0.01mm_0.1mrad": [round(100 * float(share), 3) for share in strict],
        "batch_us_per_target": round(1e6 * min(batch), 2),
        "single_us_median": round(1e6 * float(np.median(single)), 1),
        "single_us_p99": round(1e6 * float(np.percentile(single, 99)), 1),
    }


def judged(solver: DampedSolver, linkage: Linkage, posed: bool, where: str) -> dict[str, Any]:
    """Verdicts and nearest poses beside those of many descents."""
    x, turns = reachable(solver, linkage, JUDGED, 7)
    rng = np.random.default_rng(8)
    if where == "anywhere":
        middle, half = (x.max(0) + x.min(0)) / 2, (x.max(0) - x.min(0)) / 2
        x = middle + 1.3 * half * rng.uniform(-1, 1, x.shape)
        turns = Rotation.random(JUDGED, rng=np.random.default_rng(9)).as_matrix()
    else:
        x = x + rng.uniform(-0.1, 0.1, x.shape) / np.sqrt(x.shape[1])
    asked = turns if posed else None
    answers = solver.solve(x, asked)
    seconds = []
    for row in np.nonzero(~answers.solved)[0][:200]:
        start = time.perf_counter()
        solver.solve_one(x[row], turns[row] if posed else None)
        seconds.append(time.perf_counter() - start)
    distance, angle, reached = truth(solver, x, asked)
    missed = np.sqrt(answers.distance**2 + (RADIAN * answers.angle) ** 2)
    best = np.sqrt(distance**2 + (RADIAN * angle) ** 2)
    away = ~reached & ~answers.solved
    return {
        "targets": JUDGED,
        "reachable": int((reached | answers.solved).sum()),
        "verdicts_wrong": int((reached & ~answers.solved).sum()),
        "truth_found_fewer": int((~reached & answers.solved).sum()),
        "nearest_within_0.1mm_of_best_percent": share((missed < best + 1e-4)[away]),
        "nearest_within_5mm_of_best_percent": share((missed < best + 5e-3)[away]),
        "out_of_reach_single_us_median": round(1e6 * float(np.median(seconds)), 1) if seconds else None,
    }


def share(right: np.ndarray) -> float | None:
    """In percent; None of none."""
    return round(100 * float(np.mean(right)), 2) if len(right) else None


def truth(solver: DampedSolver, x: np.ndarray, turns: np.ndarray | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distance [m], angle [rad] and whether it is reached, of the best of many descents from random postures."""
    aims = np.zeros((len(x), 12))
    aims[:, list(solver.coordinates)] = x
    if turns is not None:
        aims[:, 3:] = turns.reshape(-1, 9)
    span, rows = solver.upper - solver.lower, 3 if turns is None else 6
    starts = solver.lower + span * np.random.default_rng(99).random((STARTS, len(span)))
    found = []
    for aim in aims:
        ends = np.zeros((1, STARTS, len(span) + 3))
        ends[0, :, : len(span)] = starts
        found.append(settled(solver.arm, aim[None], rows, ends)[0, -3:])
    columns = np.array(found)
    return columns[:, 0], columns[:, 1], columns[:, 2] > 0


def cold() -> dict[str, float]:
    """Processor seconds of compiling everything, in a process of its own: the search, and what out of reach needs."""
    with tempfile.TemporaryDirectory() as folder:
        settings = {**os.environ, "NUMBA_CACHE_DIR": folder}
        runs = [
            subprocess.run(
                [sys.executable, "-c", _COLD], env=settings, cwd=ROOT, capture_output=True, text=True, check=True
            )
            for _ in range(2)
        ]
    empty, kept = ([round(float(part), 2) for part in run.stdout.split()] for run in runs)
    return {
        "cold_search_cpu_s": empty[0],
        "cold_out_of_reach_cpu_s": empty[1],
        "from_disk_search_cpu_s": kept[0],
        "from_disk_out_of_reach_cpu_s": kept[1],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arms", nargs="+", default=ARMS)
    parser.add_argument("--out", type=Path, default=ROOT / "benchmarks/results/reaching_query.json")
    asked = parser.parse_args()
    compiled = cold()
    print(compiled, flush=True)
    arms: dict[str, Any] = {}
    for name in asked.arms:
        solver, linkage = arm(name)
        arms[name] = {"joints": len(solver.lower)}
        for kind, posed in (("pose", True), ("position", False)):
            if posed and len(solver.coordinates) == 2:
                continue
            solver.solve(*reachable(solver, linkage, 2, 0))
            arms[name][kind] = {
                "reachable": queried(solver, linkage, posed),
                "anywhere": judged(solver, linkage, posed, "anywhere"),
                "border": judged(solver, linkage, posed, "border"),
            }
            print(name, kind, arms[name][kind], flush=True)
    result = {
        "benchmark": "reaching_query",
        "what": "damped least squares on a known chain, one core; targets, truth and timing as the benchmark says",
        "compile": compiled,
        "arms": arms,
        "seeds": SEEDS,
        "machine": machine_in_words(),
        "versions": versions(),
        "command": "python -m benchmarks.reaching.query",
    }
    write_json(asked.out, result)


if __name__ == "__main__":
    main()
