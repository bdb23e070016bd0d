"""Calibration: of answers said to be within e at 90 %, how many are?

    python -m benchmarks.reaching.calibration [--fits 24] [--out benchmarks/results/reaching_calibration.json]

Each arm is fitted to 100 or 300 movements with 1 mm noise on each axis (and in one row 5 mrad of orientation), again
and again; of 500 fresh postures the tip's true distance, and the distance that is seen with noise, are set beside what
`toddle.reach.evaluate.expectation` says. The last rows are of a body that is no rigid chain: joints that turn
unevenly, by up to 6 mrad twice a turn, and an arm that sags by some 2 mm under its own weight. What a solver leaves of
the distance, below 0.01 mm, is left out.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from toddle.outside.compile_cache import use_compile_cache

use_compile_cache()  # before Numba is imported

from benchmarks.reaching.screw_bodies import Arm, made  # noqa: E402
from toddle.outside.versions import versions  # noqa: E402
from toddle.reach.evaluate.expectation import Expectation  # noqa: E402
from toddle.reach.model.model import Fit  # noqa: E402
from toddle.reach.model.rigid import Rigid, changed, number_slopes  # noqa: E402
from toddle.reach.model.screws import fit_screws  # noqa: E402
from toddle.robots.linkage import Linkage, poses  # noqa: E402
from toddle.signals import Experience  # noqa: E402

NOISE, ANGLE_NOISE, TARGETS = 1e-3, 5e-3, 500
ARMS = ("nicu", "scara", "panda", "talos7")
ROWS = (
    ("100", 100, False, False),
    ("300", 300, False, False),
    ("100 with orientation", 100, True, False),
    ("100, not rigid", 100, False, True),
    ("300, not rigid", 300, False, True),
)
_UNEVEN, _SAG = 6e-3, 2e-3


def posed(arm: Arm, q: np.ndarray, rigid: bool) -> np.ndarray:
    """True transforms of the tip [m]."""
    if rigid:
        return poses(arm.linkage, q)
    phase = np.linspace(0, 5, q.shape[1])
    pose = poses(arm.linkage, q + _UNEVEN * np.sin(2 * q + phase))
    reach = np.linalg.norm(pose[:, :2, 3], axis=1)
    pose[:, 2, 3] -= _SAG * reach**2 / np.mean(reach**2)
    return pose


def learned(arm: Arm, count: int, orientation: bool, not_rigid: bool, seed: int, search: bool) -> dict[str, float]:
    """One fit: the shares of fresh postures that are within what is said, and the sizes of it [mm]."""
    rng = np.random.default_rng([seed, count])
    axes = list(arm.coordinates)
    q = rng.uniform(arm.lower, arm.upper, (count, len(arm.lower)))
    pose = posed(arm, q, not not_rigid)
    x = pose[:, axes, 3] + NOISE * rng.normal(size=(count, len(axes)))
    wobble = Rotation.from_rotvec(ANGLE_NOISE * rng.normal(size=(count, 3))).as_matrix()
    experience = Experience(q, x, wobble @ pose[:, :3, :3] if orientation else None)
    fit = fit_screws(experience, joints=arm.joints, seed=seed) if search else from_the_truth(arm, experience)
    expectation = Expectation.of(fit, experience, sensor=NOISE)
    fresh = rng.uniform(arm.lower, arm.upper, (TARGETS, len(arm.lower)))
    tip = posed(arm, fresh, not not_rigid)[:, axes, 3]
    said = fit.model.forward(fresh)
    away = np.linalg.norm(tip - said, axis=1)
    seen = np.linalg.norm(tip + NOISE * rng.normal(size=tip.shape) - said, axis=1)
    mean, most = expectation.at(fresh)
    return {
        "true": float((away < most).mean()),
        "seen": float((seen < expectation.seen_at(fresh)[1]).mean()),
        "said_90_mm": 1e3 * float(most.mean()),
        "true_90_mm": 1e3 * float(np.quantile(away, 0.9)),
        "said_mean_mm": 1e3 * float(mean.mean()),
        "true_mean_mm": 1e3 * float(away.mean()),
    }


def from_the_truth(arm: Arm, experience: Experience) -> Fit:
    """The least-squares fit of axes, links and tip, from the true ones: where the search of `fit_screws` ends, too."""
    linkage, axes = arm.linkage, list(arm.coordinates)
    rows = axes if experience.turn is None else [*axes, 3, 4, 5]
    weight = np.array([1.0 if each < 3 else NOISE / ANGLE_NOISE for each in rows])
    numbers = 7 * len(linkage.slides) + 6
    free = np.array([k for k in range(numbers) if k >= numbers - 6 or k % 7 != 6])  # no gains

    def around(linkage: Linkage) -> tuple[np.ndarray, np.ndarray]:
        pose, slope = number_slopes(linkage, experience.q)
        miss = experience.x - pose[:, axes, 3]
        if experience.turn is not None:
            away = experience.turn @ pose[:, :3, :3].transpose(0, 2, 1)
            miss = np.hstack([miss, Rotation.from_matrix(away).as_rotvec()])
        return (miss * weight).ravel(), (slope[:, rows][:, :, free] * weight[:, None]).reshape(-1, len(free))

    damping = 1e-4
    miss, slope = around(linkage)
    for _ in range(30):
        square = slope.T @ slope
        step = np.zeros(numbers)
        scale = np.diag(square) + 1e-9 * np.diag(square).max()
        step[free] = np.linalg.solve(square + damping * np.diag(scale), slope.T @ miss)
        tried = changed(linkage, step)
        tried_miss, tried_slope = around(tried)
        gain = 1 - (tried_miss @ tried_miss) / (miss @ miss)
        damping *= 0.1 if gain > 0 else 10
        if gain > 0:
            linkage, miss, slope = tried, tried_miss, tried_slope
        if 0 < gain < 1e-5:
            break
    square = slope.T @ slope
    known = np.linalg.eigvalsh(square) > 1e-9 * np.trace(square)
    variance = float(miss @ miss) / (len(miss) - int(known.sum()))
    covariance = np.zeros((numbers, numbers))
    covariance[np.ix_(free, free)] = variance * np.linalg.pinv(square, rcond=1e-9, hermitian=True)
    away = miss.reshape(len(experience.q), -1)[:, : len(axes)]
    model = Rigid(linkage, covariance, tuple(axes))
    return Fit(model, "screws", np.linalg.norm(away, axis=1), variance**0.5, np.zeros(len(away), bool), 0.0)


def row(arm: Arm, label: str, how: tuple[int, bool, bool], fits: int, search: bool) -> dict:
    """Many fits: the share over all of them, and how it varies from one to the next."""
    found = [learned(arm, *how, seed, search) for seed in range(fits)]
    columns = {key: np.array([each[key] for each in found]) for key in found[0]}
    return {
        "arm": arm.name,
        "movements": label,
        **{
            f"{key}_within_percent": {
                "over_all_fits": round(100 * float(columns[key].mean()), 1),
                "deviation_between_fits": round(100 * float(columns[key].std()), 1),
                "least": round(100 * float(columns[key].min()), 1),
            }
            for key in ("true", "seen")
        },
        **{key: round(float(np.median(values)), 3) for key, values in columns.items() if key.endswith("mm")},
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fits", type=int, default=24)
    parser.add_argument("--arms", nargs="+", default=list(ARMS))
    parser.add_argument("--search", action="store_true", help="fit from nothing, as toddle does: the same, but slow")
    parser.add_argument("--out", type=Path, default=None)
    options = parser.parse_args()
    rows = [
        row(made(name), label, (count, turned, bent), options.fits, options.search)
        for name in options.arms
        for label, count, turned, bent in ROWS
    ]
    result = {
        "benchmark": "reaching_calibration",
        "what": f"of {TARGETS} fresh postures a fit, the share within what is said at 90 %",
        "rows": rows,
        "seeds": [0, options.fits - 1],
        "versions": versions(),
        "command": f"python -m benchmarks.reaching.calibration --fits {options.fits} --arms {' '.join(options.arms)}",
    }
    text = json.dumps(result, indent=2)
    print(text)
    if options.out is not None:
        options.out.write_text(text + "\n")


if __name__ == "__main__":
    main()
