"""Seven joints in the plane: errors on unseen targets after 10,000 movements, open loop and after three looks.

    python benchmarks/seven_joints.py [--out benchmarks/results/seven_joints.json]

Every way to explore and learn that toddle has, on the same body, movements and targets (the tip's positions in 1,000
random postures). The best public babbling library was measured at 6.4 mm in open loop on such an arm, at about 13,000
movements a second; it isn't run here.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
from pathlib import Path

import numpy as np

import toddle
from toddle.outside.compile_cache import use_compile_cache
from toddle.outside.versions import versions

SAMPLES, SEEDS = 10_000, (0, 1, 2)
WAYS = (
    ("goal-and-motor-babbling", "recall"),
    ("random-goal-babbling", "recall"),
    ("motor-babbling", "recall"),
    ("goal-babbling", "recall"),
    ("goal-babbling", "local-linear"),
    ("goal-and-motor-babbling", "perceptron"),
    ("motor-babbling", "perceptron"),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=None)
    out = parser.parse_args().out
    use_compile_cache()
    robot = toddle.load("planar:7")
    rows = {}
    for method, learner in WAYS:
        runs = []
        for seed in SEEDS:
            skill = toddle.learn(robot, method=method, learner=learner, samples=SAMPLES, per_cycle=5_000, seed=seed)
            runs.append(toddle.evaluate(skill, robot, seed=1000 + seed))
        rows[f"{method}, {learner}"] = {
            name: [round(run[name], 2) for run in runs]
            for name in ("open_loop_error_mean_mm", "closed_loop_error_mean_mm", "closed_loop_error_p99_mm")
        }
        means = {name: round(float(np.mean(values)), 2) for name, values in rows[f"{method}, {learner}"].items()}
        print(f"{method}, {learner}: {means}", flush=True)
    result = {
        "benchmark": "seven_joints",
        "what": f"planar:7, {SAMPLES} movements, 1,000 unseen targets, one value a seed",
        "ways": rows,
        "seeds": SEEDS,
        "machine": f"{os.cpu_count()} cores, {platform.machine()}",
        "versions": versions(),
        "command": "python benchmarks/seven_joints.py",
    }
    if out is not None:
        out.write_text(json.dumps(result, indent=2) + "\n")


if __name__ == "__main__":
    main()
