"""Learn rigid arms from nothing but movements, every arm at hand, many seeds: how far the learned arms are off.

    python -m benchmarks.reaching.screws                           # all parts, ten seeds
    python -m benchmarks.reaching.screws --parts chosen --arms panda scara --seeds 2 --out runs/screws.json

The error is the distance between the learned and the true tip over 4,096 unseen postures; the seconds are of processor
time, on one core, other work beside it. From the root of the repository.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.reaching.screw_bodies import HARD, NAMED, RANDOM, Arm, made
from benchmarks.walking.campaign import commit, single_threaded
from toddle.outside.files import write_json
from toddle.outside.machine import machine_in_words
from toddle.outside.versions import versions
from toddle.reach.explore.isolating import isolating_movements
from toddle.reach.explore.outward import outward_movements
from toddle.reach.model.rigid import Rigid
from toddle.reach.model.screws import fit_screws
from toddle.robots.linkage import poses
from toddle.signals import Experience

FRESH = 4096
ROOT = Path(__file__).parents[2]
SMALL = ("nicu", "suralp", "scara", "random4", "random4-1P")
SEVEN = ("panda", "xarm7", "icub_arm", "baxter", "talos7", "random7", "random7-2P")


@dataclass(frozen=True)
class Part:
    """One claim: these arms, so many movements, seen like this.

    Attributes:
        about: the claim.
        arms: names.
        movements: how many.
        noise: standard deviation of each coordinate of the tip [m].
        turn_noise: standard deviation of the seen orientation about each axis [rad]; None: it isn't seen.
        wild: share of the movements that are seen wrongly, by up to a metre.
        chosen: whether the movements begin with those of single joints, the others keeping to the joints' ends.
        bound: what p99 should be under [m].
    """

    about: str
    arms: tuple[str, ...]
    movements: int = 300
    noise: float = 1e-3
    turn_noise: float | None = None
    wild: float = 0.0
    chosen: bool = False
    bound: float = 1e-3


PARTS = {
    "chosen": Part("300 chosen movements, nothing known", (*NAMED, *RANDOM), chosen=True),
    "random": Part("300 random movements, nothing known", (*NAMED, *RANDOM)),
    "chosen, four": Part("four joints, 130 chosen movements", SMALL, movements=130, chosen=True),
    "chosen, seven": Part("seven joints, 200 chosen movements", SEVEN, movements=200, chosen=True),
    "random, four": Part("four joints, 130 random movements", SMALL, movements=130),
    "random, seven": Part("seven joints, 200 random movements", SEVEN, movements=200),
    "pose": Part(
        "200 chosen movements, orientation seen", (*SMALL, *SEVEN, "tiago"), 200, turn_noise=5e-3, chosen=True
    ),
    "hard": Part(
        "gains, directions and zeros unknown, 5 % wild, sliding joints and mimic axes",
        HARD,
        wild=0.05,
        chosen=True,
        bound=1.3e-3,
    ),
    "wild": Part("300 random movements, 5 % wild", (*SMALL, *SEVEN), wild=0.05, bound=1.3e-3),
    "exact": Part("300 random movements without noise", NAMED, noise=0.0, bound=1e-9),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", default=list(PARTS), choices=list(PARTS))
    parser.add_argument("--arms", nargs="+", default=None, help="only these of each part's arms")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=ROOT / "benchmarks" / "results" / "reaching_screws.json")
    asked = parser.parse_args()
    options = " ".join(f"'{word}'" if " " in word else word for word in sys.argv[1:])
    content: dict[str, Any] = {
        "benchmark": "reaching: rigid arms learned from nothing",
        "command": f"python -m benchmarks.reaching.screws {options}".strip(),
        "seeds": list(range(asked.seeds)),
        "commit": commit(),
        "date": datetime.now(UTC).date().isoformat(),
        "machine": machine_in_words(),
        "versions": versions(),
        "parts": {},
    }
    single_threaded()
    with ProcessPoolExecutor(asked.workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        for name in asked.parts:
            part = PARTS[name]
            arms = [arm for arm in part.arms if asked.arms is None or arm in asked.arms]
            waiting = {arm: [pool.submit(run_one, part, arm, seed) for seed in range(asked.seeds)] for arm in arms}
            rows = {}
            for arm, futures in waiting.items():
                rows[arm] = together([future.result() for future in futures])
                told = [f"{key} {rows[arm][key]:.3g}" for key in ("p99_mm_median", "p99_mm_worst", "fit_seconds_worst")]
                print(f"{name}: {arm}: {', '.join(told)}", flush=True)
            facts = {"about": part.about, "bound_mm": 1e3 * part.bound}
            content["parts"][name] = facts | summary(rows, part) | {"arms": rows}
            write_json(asked.out, content)


def together(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """One arm, all seeds."""
    lists = {key: [row[key] for row in rows] for key in rows[0]}
    return {
        "p99_mm_median": float(np.median(lists["p99_mm"])),
        "p99_mm_worst": max(lists["p99_mm"]),
        "fit_seconds_median": float(np.median(lists["fit_seconds"])),
        "fit_seconds_worst": max(lists["fit_seconds"]),
        **lists,
    }


def run_one(part: Part, name: str, seed: int) -> dict[str, Any]:
    """One arm, one seed."""
    arm = made(name)
    rng = np.random.default_rng(seed)
    experience, wild = movements(part, arm, rng)
    began = time.process_time()
    fit = fit_screws(experience, joints=arm.joints, seed=seed)
    seconds = time.process_time() - began
    assert isinstance(fit.model, Rigid)
    q = rng.uniform(arm.lower, arm.upper, (FRESH, len(arm.lower)))
    true = poses(arm.linkage, q)
    error = np.linalg.norm(fit.model.forward(q) - true[:, arm.coordinates, 3], axis=1)
    row = {
        "p99_mm": round(1e3 * float(np.percentile(error, 99)), 12),
        "mean_mm": round(1e3 * float(error.mean()), 12),
        "fit_seconds": round(seconds, 3),
        "wild_wrong": int((fit.wild != wild).sum()),
    }
    if part.turn_noise is not None:
        apart = np.linalg.norm(fit.model.pose(q)[:, :3, :3] - true[:, :3, :3], axis=(1, 2))
        row["turn_p99_mrad"] = round(2e3 * float(np.arcsin(np.percentile(apart, 99) / np.sqrt(8))), 6)
    return row


def movements(part: Part, arm: Arm, rng: np.random.Generator) -> tuple[Experience, np.ndarray]:
    """What the arm was seen to do, and which of it is wild."""
    q = rng.uniform(arm.lower, arm.upper, (part.movements, len(arm.lower)))
    if part.chosen:
        q = outward_movements(arm.lower, arm.upper, part.movements, rng)
        first = isolating_movements(arm.lower, arm.upper, arm.home)
        q[: len(first)] = first
    true = poses(arm.linkage, q)
    x = true[:, arm.coordinates, 3] + part.noise * rng.normal(size=(len(q), len(arm.coordinates)))
    wild = rng.random(len(q)) < part.wild
    x[wild] += rng.uniform(-1, 1, (wild.sum(), x.shape[1]))
    turn = None
    if part.turn_noise is not None:
        turn = small_turns(part.turn_noise * rng.normal(size=(len(q), 3))) @ true[:, :3, :3]
    return Experience(q, x, turn), wild


def small_turns(vectors: np.ndarray) -> np.ndarray:
    """Rotations by rotation vectors."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(vectors).as_matrix()


def summary(rows: dict[str, dict[str, Any]], part: Part) -> dict[str, Any]:
    """Over all arms and seeds."""
    errors = np.concatenate([row["p99_mm"] for row in rows.values()]) if rows else np.zeros(0)
    seconds = np.concatenate([row["fit_seconds"] for row in rows.values()]) if rows else np.zeros(0)
    if not len(errors):
        return {}
    return {
        "fits": len(errors),
        "under_bound": int((errors < 1e3 * part.bound).sum()),
        "p99_mm_median": float(np.median(errors)),
        "p99_mm_worst": float(errors.max()),
        "fit_seconds_median": float(np.median(seconds)),
        "fit_seconds_worst": float(seconds.max()),
        "fits_over_2_seconds": int((seconds > 2).sum()),
    }


if __name__ == "__main__":
    main()
