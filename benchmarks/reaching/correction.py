"""Correction: a description whose zeros are off by up to 5 degrees and whose links by up to 5 mm, from few movements.

    python -m benchmarks.reaching.correction [--seeds 10] [--out benchmarks/results/reaching_correction.json]

The true arm has every joint's zero off by up to 5 degrees and every axis and the tip off by up to 5 mm on each of their
three coordinates, all uniform. Its tip is seen with 1 mm of noise on each axis (in some rows with 5 mrad of
orientation). Movements are drawn at random within the limits, or proposed; a seed has the same true arm and noise
either way. Errors are those of 4,096 unseen random postures.

Zeros: the reported ones beside those that 250 movements without noise report of the same arm, for a link that is off
across by 5 mm and two zeros that are off can't be told apart by anybody, and where links are right, beside the true
ones. Joints whose zero doesn't show at all (the tip lies on the axis) are left out; they are counted.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.reaching.screw_bodies import Arm, made
from toddle.outside.versions import versions
from toddle.reach.explore.informative import propose
from toddle.reach.model.corrected import Corrected, assumed, correct
from toddle.reach.model.rigid import changed
from toddle.robots.linkage import Linkage, poses
from toddle.signals import Experience

ARMS = ("nicu", "so101", "ur5", "kinova", "z1", "panda", "xarm7", "icub_arm")
ZERO, SHIFT, NOISE, TURN_NOISE = np.radians(5), 0.005, 1e-3, 5e-3
WAYS = (
    ("30 random", 30, False, False),
    ("30 proposed", 30, True, False),
    ("60 random", 60, False, False),
    ("60 proposed", 60, True, False),
    ("30 random, with orientation", 30, False, True),
    ("30 proposed, with orientation", 30, True, True),
)
STRAIGHT = (("30 proposed, links right, beside the true zeros", 30, True, False),)


def wrong(arm: Arm, rng: np.random.Generator, shift: float) -> tuple[Linkage, np.ndarray]:
    """The true arm of a description, and how far its zeros are off."""
    steps = np.zeros((len(arm.linkage.slides), 7))
    steps[:, :3] = rng.uniform(-shift, shift, (len(steps), 3))
    steps[:, 5] = rng.uniform(-ZERO, ZERO, len(steps))
    tip = [*rng.uniform(-shift, shift, 3), 0, 0, 0]
    return changed(arm.linkage, np.concatenate([steps.ravel(), tip])), steps[:, 5]


def seen(arm: Arm, truth: Linkage, q: np.ndarray, rng: np.random.Generator, turns: bool, noise: float) -> Experience:
    """What is seen of the movements."""
    pose = poses(truth, q)
    x = pose[:, list(arm.coordinates), 3]
    x = x + noise * rng.normal(size=x.shape)
    wobble = Rotation.from_rotvec(TURN_NOISE * rng.normal(size=(len(q), 3))).as_matrix()
    return Experience(q, x, wobble @ pose[:, :3, :3] if turns else None)


def zeros(corrected: Corrected) -> np.ndarray:
    """Reported zeros [deg], NaN where they don't show."""
    return np.degrees([change.zero if change.seen > 0.5 else np.nan for change in corrected.changes[:-1]])


def case(arm: Arm, seed: int, shift: float, ways: tuple[tuple[str, int, bool, bool], ...]) -> dict[str, dict]:
    """One arm corrected in several ways: errors [mm], zeros [deg]."""
    rng = np.random.default_rng(seed)
    truth, true_zeros = wrong(arm, rng, shift)
    random, unseen = (rng.uniform(arm.lower, arm.upper, (n, len(arm.lower))) for n in (250, 4096))
    names, found, best = {"joints": arm.joints, "coordinates": arm.coordinates}, {}, {}
    for turns in {way[3] for way in ways}:
        perfect = Experience(random, seen(arm, truth, random, rng, False, 0.0).x)
        if turns:
            perfect = Experience(random, perfect.x, poses(truth, random)[:, :3, :3])
        best[turns] = zeros(correct(arm.linkage, perfect, **names)) if shift else np.degrees(true_zeros)
    for way, count, chosen, turns in ways:
        start = time.process_time()
        look = TURN_NOISE if turns else None
        q = (
            propose(assumed(arm.linkage), arm.lower, arm.upper, count, turn_sensor=look, seed=seed)
            if chosen
            else random
        )
        proposing, start = time.process_time() - start, time.process_time()
        noise = np.random.default_rng([seed, 1])
        corrected = correct(arm.linkage, seen(arm, truth, q[:count], noise, turns, NOISE), **names)
        fitting = time.process_time() - start
        off = corrected.fit.model.forward(unseen) - poses(truth, unseen)[:, list(arm.coordinates), 3]
        error = 1e3 * np.linalg.norm(off, axis=1)
        found[way] = {
            "p99_mm": float(np.percentile(error, 99)),
            "mean_mm": float(error.mean()),
            "zero_errors_deg": np.abs(zeros(corrected) - best[turns]).tolist(),
            "fit_cpu_s": fitting,
            "propose_cpu_s": proposing if chosen else 0.0,
        }
    return found


def row(cases: list[dict]) -> dict[str, object]:
    """The cases of one arm and way, put together."""
    p99 = np.array([case["p99_mm"] for case in cases])
    off = np.array([case["zero_errors_deg"] for case in cases])
    shown = off[np.isfinite(off)]
    return {
        "p99_mm": {"median": _short(np.median(p99)), "p90": _short(np.percentile(p99, 90)), "max": _short(p99.max())},
        "p99_below_1.5_mm": f"{int((p99 < 1.5).sum())} of {len(p99)}",
        "p99_mm_each": [_short(value) for value in p99],
        "mean_mm": _short(np.mean([case["mean_mm"] for case in cases])),
        "zeros_within_0.2_deg": f"{int((shown < 0.2).sum())} of {len(shown)}, {off.size - len(shown)} don't show",
        "zero_error_deg": {"median": _short(np.median(shown)), "max": _short(shown.max())},
        "fit_cpu_s": _short(np.median([case["fit_cpu_s"] for case in cases])),
        "propose_cpu_s": _short(np.median([case["propose_cpu_s"] for case in cases])),
    }


def _short(value: float | np.floating) -> float:
    return round(float(value), 3)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--out", type=Path, default=None)
    asked = parser.parse_args()
    rows: dict[str, dict[str, dict]] = {}
    for name in ARMS:
        arm, rows[name] = made(name), {}
        for shift, ways in ((SHIFT, WAYS), (0.0, STRAIGHT)):
            cases = [case(arm, seed, shift, ways) for seed in range(asked.seeds)]
            rows[name] |= {way[0]: row([found[way[0]] for found in cases]) for way in ways}
        for way, figures in rows[name].items():
            zero = figures["zeros_within_0.2_deg"]
            print(f"{name}, {way}: p99 {figures['p99_mm']} {figures['p99_below_1.5_mm']}, zeros {zero}", flush=True)
    result = {
        "benchmark": "reaching_correction",
        "what": "zeros off by up to 5 degrees, axes and tip by up to 5 mm on each coordinate; 1 mm of noise",
        "arms": rows,
        "seeds": list(range(asked.seeds)),
        "versions": versions(),
        "command": f"python -m benchmarks.reaching.correction --seeds {asked.seeds}",
    }
    if asked.out is not None:
        asked.out.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
