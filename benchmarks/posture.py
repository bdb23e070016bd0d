"""The posture: a tick of whole-body inverse kinematics along a walk, against mink on the same targets in the same run.

    python benchmarks/posture.py [--robot heicub] [--out benchmarks/results/posture.json]

Both make one step a tick from their own last answer, with the same weights: centre of mass, two soles, the turning of
waist and chest, joint limits. mink solves with DAQP. The ankles' limits forbid some of the targets, more of them at
0.25 m/s: there the active set works. How far both stay is told, over the floor and in height. Times are medians over
the ticks of the fastest of the repeats, wall time, everything that a tick calls included (ours: `solve_posture`;
mink's: new targets, `solve_ik`, integration).
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import mink
import numpy as np

from toddle.outside.compile_cache import use_compile_cache

use_compile_cache()  # before Numba is imported

from toddle.outside.versions import versions  # noqa: E402
from toddle.robots.humanoid import Humanoid  # noqa: E402
from toddle.robots.humanoids import load_humanoid  # noqa: E402
from toddle.walk.posture.model import PostureModel, posture_model  # noqa: E402
from toddle.walk.posture.solve import WEIGHTS, PostureTarget, settle, solve_posture  # noqa: E402
from toddle.walk.posture.survey import static_torques, survey  # noqa: E402

SECONDS, TICK, STEP_TIME, REPEATS = 6.0, 0.01, 0.6, 5
SPEEDS = (0.1, 0.25)
Follower = Callable[[PostureTarget], np.ndarray]


def walk(model: PostureModel, home: np.ndarray, speed: float) -> list[PostureTarget]:
    """Steps of 0.6 s, as high as 2 cm, the centre of mass swaying; speed in m/s."""
    stride = speed * STEP_TIME
    start = survey(model, home)
    targets = []
    for t in np.arange(0.0, SECONDS, TICK):
        step, phase = divmod(t / STEP_TIME, 1.0)
        s = 10 * phase**3 - 15 * phase**4 + 6 * phase**5
        swing = int(step) % 2
        soles = start.soles_p.copy()
        soles[1 - swing, 0] += stride * step
        soles[swing, 0] += stride * (step - 1 + 2 * s) if step else stride * s
        soles[swing, 2] += 0.02 * 16 * phase**2 * (1 - phase) ** 2
        ahead = t / STEP_TIME - 0.5 if step else 0.5 * phase
        sway = 0.03 * np.sin(np.pi * phase) * (-1 if swing == 0 else 1)
        com = start.com + np.array([stride * ahead, sway, 0.0])
        targets.append(PostureTarget(com, soles, start.soles_R, start.waist_R, start.chest_R))
    return targets


def ours(model: PostureModel, start: np.ndarray, iterations: int = 1) -> Follower:
    q = start

    def tick(target: PostureTarget) -> np.ndarray:
        nonlocal q
        q = solve_posture(model, q, target, iterations).q
        return q

    return tick


def by_mink(humanoid: Humanoid, start: np.ndarray) -> Follower:
    physics = humanoid.spec.compile()
    configuration = mink.Configuration(physics, start)
    com, limits = mink.ComTask(cost=np.sqrt(WEIGHTS[:3])), [mink.ConfigurationLimit(physics)]
    soles = [mink.FrameTask(f"{side}_sole", "site", *np.sqrt(WEIGHTS[[3, 6]])) for side in ("left", "right")]
    trunk = [mink.FrameTask(name, "site", 0.0, np.sqrt(WEIGHTS[15])) for name in ("waist", "chest")]
    held = [int(physics.joint(n).dofadr[0]) for n, m in zip(humanoid.joints, humanoid.moves, strict=True) if not m]
    fixed = [mink.DofFreezingTask(physics, held)] if held else None

    def pose(rotation: np.ndarray, position: Sequence[float] | np.ndarray) -> mink.SE3:
        return mink.SE3.from_rotation_and_translation(mink.SO3.from_matrix(rotation), np.asarray(position))

    def tick(target: PostureTarget) -> np.ndarray:
        com.set_target(target.com)
        for task, rotation, position in zip(soles, target.sole_rotations, target.soles, strict=True):
            task.set_target(pose(rotation, position))
        for task, rotation in zip(trunk, (target.waist_rotation, target.chest_rotation), strict=True):
            task.set_target(pose(rotation, np.zeros(3)))
        step = mink.solve_ik(
            configuration, [com, *soles, *trunk], TICK, "daqp", damping=1e-6, limits=limits, constraints=fixed
        )
        configuration.integrate_inplace(step, TICK)
        return configuration.q

    return tick


def run(model: PostureModel, follower: Follower, targets: list[PostureTarget]) -> tuple[list[float], np.ndarray]:
    """Milliseconds of each tick; how far a sole, the centre of mass over the floor and its height missed [mm]."""
    times, misses = [], []
    for target in targets:
        before = time.perf_counter()
        q = follower(target)
        times.append(1e3 * (time.perf_counter() - before))
        seen = survey(model, q)
        com = seen.com - target.com
        soles = np.linalg.norm(seen.soles_p - target.soles, axis=1)
        misses.append((1e3 * soles.max(), 1e3 * np.hypot(com[0], com[1]), 1e3 * abs(com[2])))
    return times, np.max(misses, axis=0)


def figures(model: PostureModel, make: Callable[[], Follower], targets: list[PostureTarget]) -> dict[str, float]:
    runs = [run(model, make(), targets) for _ in range(REPEATS)]
    times, (soles, over_floor, height) = min(runs, key=lambda one: float(np.median(one[0])))
    return {
        "ms_median": round(float(np.median(times)), 4),
        "ms_p99": round(float(np.percentile(times, 99)), 4),
        "sole_mm": round(float(soles), 3),
        "com_over_floor_mm": round(float(over_floor), 3),
        "com_height_mm": round(float(height), 3),
    }


def compared(humanoid: Humanoid, model: PostureModel, speed: float) -> dict[str, object]:
    targets = walk(model, humanoid.home, speed)
    start = settle(model, humanoid.home, targets[0]).q
    one = figures(model, lambda: ours(model, start), targets)
    two = figures(model, lambda: ours(model, start, 2), targets)
    peer = figures(model, lambda: by_mink(humanoid, start), targets)
    ratio = round(peer["ms_median"] / one["ms_median"], 1)
    return {"one_step": one, "two_steps": two, "mink": peer, "mink_over_one_step": ratio}


def median_ms(call: Callable[[], object], count: int = 2000) -> float:
    times = []
    for _ in range(count):
        before = time.perf_counter()
        call()
        times.append(1e3 * (time.perf_counter() - before))
    return round(float(np.median(times)), 4)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robot", default="heicub")
    parser.add_argument("--out", type=Path, default=None)
    options = parser.parse_args()
    humanoid = load_humanoid(options.robot)
    model = posture_model(humanoid)
    load, cop, home = np.array([0.5, 0.5]), np.zeros((2, 2)), humanoid.home
    result = {
        "benchmark": "posture",
        "what": f"one tick of a walk of {SECONDS:g} s, a tick each {TICK:g} s; the best of {REPEATS} runs",
        "robot": humanoid.name,
        "joints_moved": int(humanoid.moves.sum()),
        **{f"at_{speed:g}_m_per_s": compared(humanoid, model, speed) for speed in SPEEDS},
        "survey_ms_median": median_ms(lambda: survey(model, home)),
        "static_torques_ms_median": median_ms(lambda: static_torques(model, home, load, cop)),
        "load_average": round(os.getloadavg()[0], 1),
        "machine": f"{os.cpu_count()} cores, {platform.machine()}",
        "versions": versions(),
        "command": f"python benchmarks/posture.py --robot {options.robot}",
    }
    text = json.dumps(result, indent=2)
    print(text)
    if options.out is not None:
        options.out.write_text(text + "\n")


if __name__ == "__main__":
    main()
