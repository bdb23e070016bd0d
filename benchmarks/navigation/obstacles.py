"""Policies around obstacles, on the walking pattern and in physics, beside the drivers that plan or are blind.

    python -m benchmarks.navigation.obstacles runs/obstacles runs/obstacles-2 --physics 200 --beside 50

The policies were left by ``toddle navigate ppo obstacles --seed N``; their own figures say how they were trained. Each
is judged on 200 layouts that it never saw, and that an independent planner finds a way through.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from toddle.navigate.scenarios.planner import solvable_layouts
from toddle.outside.files import write_json
from toddle.outside.machine import machine_in_words
from toddle.outside.navigation.course import Rules, courses_of, summary
from toddle.outside.navigation.guided import Guided
from toddle.outside.navigation.judging import walked
from toddle.outside.navigation.named_tasks import TASKS, source_from, walker_task
from toddle.outside.navigation.physics_batch import Recipe, baseline, run_courses, same
from toddle.outside.navigation.policy_files import load_policy
from toddle.outside.navigation.statistics import wilson
from toddle.outside.navigation.steered import learned
from toddle.outside.versions import versions

RESULTS = Path(__file__).parents[1] / "results" / "navigation_obstacles.json"
SEED, LAYOUTS = 5_000_000, 200


def on_the_pattern(folder: Path, *, told: bool) -> dict[str, Any]:
    policy = load_policy(folder)
    task = walker_task(replace(source_from(policy.source), told=told))
    return {"driver": name_of(folder), "where": "pattern", "told": told} | walked(task, policy, SEED, LAYOUTS)


def in_physics(name: str, recipe: Recipe, count: int) -> dict[str, Any]:
    layouts, _, _ = solvable_layouts(SEED, count, circles=TASKS["obstacles"].circles)
    began, done = time.perf_counter(), [0]

    def tell(_: int, __: Any) -> None:
        done[0] += 1
        if done[0] % 20 == 0:
            print(f"{name} in physics: {done[0]} of {count}", file=sys.stderr, flush=True)

    finishes = [one for one in run_courses(recipe, courses_of(layouts), Rules(), progress=tell) if one is not None]
    found = summary(finishes)
    low, high = wilson(found["won"], len(finishes))
    row = {"driver": name, "where": "physics", "told": True, "wilson_low": low, "wilson_high": high}
    return row | found | {"wall_seconds": time.perf_counter() - began}


def name_of(folder: Path) -> str:
    return f"policy, seed {load_policy(folder).figures['seed']}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--physics", type=int, default=200, help="courses of each policy")
    parser.add_argument("--beside", type=int, default=50, help="courses of the drivers beside them")
    asked = parser.parse_args()
    rows = [on_the_pattern(folder, told=told) for folder in asked.folders for told in (True, False)]
    rows += [in_physics(name_of(folder), Recipe(learned, (folder,)), asked.physics) for folder in asked.folders]
    rows.append(in_physics("guide, plans", Recipe(same, (Guided(),)), asked.beside))
    rows.append(in_physics("baseline, blind", Recipe(baseline), asked.beside))
    trained = [dict(load_policy(folder).figures) for folder in asked.folders]
    command = f"python -m benchmarks.navigation.obstacles ... --physics {asked.physics} --beside {asked.beside}"
    record = {
        "benchmark": "navigation_obstacles", "seed": SEED, "command": command, "machine": machine_in_words(),
        "versions": versions(), "trained": trained, "rows": rows,
    }  # fmt: skip
    write_json(RESULTS, record)
    print(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
