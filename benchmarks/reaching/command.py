"""The whole of ``toddle reach ROBOT --noise 1mm``, as a user calls it: accuracy, time, and the very first call.

    python -m benchmarks.reaching.command [--seeds 2] [--out results]

Every robot is given by its name or the path of its file and nothing else; the first call finds an empty cache.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from toddle.outside.files import write_json
from toddle.outside.versions import versions

NAMES = ("nicu", "suralp", "icub_arm", "scara", "planar3", "planar:7")
FILES = (
    "panda_description/urdf/panda.urdf", "ur_description/urdf/ur5_robot.urdf", "xarm_description/urdf/xarm7.urdf",
    "kinova_description/robots/kinova.urdf", "so_arm_description/urdf/so101.urdf", "z1_description/urdf/z1.urdf",
    "tiago_description/robots/tiago.urdf", "talos_data/robots/talos_full_v2.urdf",
    "baxter_description/urdf/baxter.urdf", "pr2_description/urdf/pr2.urdf",
)  # fmt: skip
KEPT = ("movements", "open_loop_error_mean_mm", "open_loop_error_p99_mm", "open_loop_error_max_mm", "success_percent",
        "expected_error_90_covers_percent", "fit_seconds", "total_seconds", "query_us_single", "query_us_batch4096",
        "orientation_error_p99_mrad")  # fmt: skip


def robot_files() -> list[Path]:
    """The URDF files of the package example-robot-data."""
    files = importlib.metadata.files("example-robot-data") or []
    return [Path(str(file.locate())) for wanted in FILES for file in files if str(file).endswith(wanted)]


def call(robot: str, seed: int, extra: list[str], environment: dict[str, str]) -> dict[str, object]:
    """One call of the command; what it printed, and the wall and CPU time of the process."""
    with tempfile.TemporaryDirectory() as folder:
        toddle = str(Path(sys.executable).with_name("toddle"))
        words = [toddle, "reach", robot, "--seed", str(seed), "--json", "--out", f"{folder}/run"]
        before, started = os.times(), time.perf_counter()
        done = subprocess.run([*words, *extra], capture_output=True, text=True, timeout=300, env=environment)
        after = os.times()
    wall = time.perf_counter() - started
    cpu = (after.children_user - before.children_user) + (after.children_system - before.children_system)
    if done.returncode:
        return {"failed": done.stderr.strip().splitlines()[-1:]}
    figures = json.loads(done.stdout)
    return {**{name: figures[name] for name in KEPT if name in figures}, "wall_seconds": wall, "cpu_seconds": cpu}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[1] / "results" / "reaching_command.json")
    asked = parser.parse_args()
    robots = [*NAMES, *map(str, robot_files())]
    with tempfile.TemporaryDirectory() as cache:
        environment = {**os.environ, "XDG_CACHE_HOME": cache}
        environment.pop("NUMBA_CACHE_DIR", None)
        first = call(robots[len(NAMES)], 0, ["--noise", "1mm"], environment)
        print("first", first, flush=True)
        runs: dict[str, dict[str, object]] = {}
        for label, extra in (
            ("position", ["--noise", "1mm"]),
            ("pose", ["--noise", "1mm", "5mrad", "--samples", "200"]),
        ):
            for robot in robots:
                if label == "pose" and robot.startswith("planar"):
                    continue
                name = f"{label} {Path(robot).stem if '/' in robot else robot}"
                found = [call(robot, seed, extra, environment) for seed in range(asked.seeds)]
                runs[name] = {"runs": found}
                print(
                    name, [round(float(str(one.get("open_loop_error_p99_mm", np.nan))), 3) for one in found], flush=True
                )
    write_json(
        asked.out,
        {
            "benchmark": "the whole command",
            "command": f"python -m benchmarks.reaching.command --seeds {asked.seeds}",
            "versions": versions(),
            "machine": "two cores, shared",
            "first_call_with_an_empty_cache": first,
            "robots": runs,
        },
    )


if __name__ == "__main__":
    main()
