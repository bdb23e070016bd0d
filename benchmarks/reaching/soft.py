"""Soft arms: how far from unseen targets an arm learned as segments of constant curvature stays, looked at and not.

    python -m benchmarks.reaching.soft [--seeds 5] [--out benchmarks/results/reaching_soft.json]

Reaching: the bionic handling assistant, learned from movements seen with noise on each axis (17 mm: uniform within
+-17 mm, as in Thuruthel et al. 2016; "walk": continuous motor babbling, steps shorter than 0.5 in units of the ranges),
then 256 targets, the tips of random postures; true distances after 0 to 6 looks, looks without noise and with 2 mm
(Gaussian, each axis). Other bodies: random soft arms of 2 to 4 segments of 2 to 4 actuators, all of their layout
unknown; and arms whose curvature isn't constant (taper 0.3, nonlinear 0.15, sag 0.3 rad/m, see `soft_variants`).
Circle: the paper's, radius 0.2 m, 0.7 m above the base, twice 100 points, from home; one movement for each point, and a
look with 2 mm noise after it, from which the arm goes on learning. At a random time of the next round the last three
actuators lock where they stand, and nobody tells; when a look is a surprise, each actuator is probed once, and the
circle goes on, twice more. Points that the true arm as it is now can't reach to 0.5 mm are counted and left out.
Damage: random sets of actuators lock, weaken or slip at random postures; looks with 2 mm noise.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from toddle.outside.compile_cache import use_compile_cache

use_compile_cache()

import jax  # noqa: E402
import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402

import toddle  # noqa: E402
from toddle.outside.versions import versions  # noqa: E402
from toddle.reach.model.crippled import Crippled  # noqa: E402
from toddle.reach.model.curvature import Curvature, fit_curvature  # noqa: E402
from toddle.reach.model.curvature_update import updated  # noqa: E402
from toddle.reach.model.damage_watch import JUMP, surprises  # noqa: E402
from toddle.reach.model.misfit import fits  # noqa: E402
from toddle.reach.model.model import Fit  # noqa: E402
from toddle.reach.model.soft_damage import Diagnosis, diagnose, probe_movements  # noqa: E402
from toddle.reach.solve.gauss_newton import solve_model  # noqa: E402
from toddle.reach.solve.looking import aimed, begun, correct  # noqa: E402
from toddle.reach.solve.solver import ModelSolver  # noqa: E402
from toddle.robots.body import Body  # noqa: E402
from toddle.robots.soft_variants import bha_variant, random_soft_arm  # noqa: E402
from toddle.signals import Experience  # noqa: E402

TARGETS, LOOKS, LOOK_NOISE, REACHABLE = 256, 6, 2e-3, 5e-4
STUCK = 1e-4  # [m] farther from a point than that, the arm looks for another posture
Row = dict[str, Any]


class Arm:
    """A body in NumPy."""

    def __init__(self, body: Body) -> None:
        self._forward = jax.jit(jax.vmap(body.forward))
        self.name, self.joints = body.name, body.joints
        self.lower, self.upper = np.asarray(body.lower, float), np.asarray(body.upper, float)
        self.home = np.asarray(body.home, float)

    def forward(self, q: np.ndarray) -> np.ndarray:
        """True tips [m]."""
        return np.asarray(self._forward(jnp.asarray(q, jnp.float32)), float)

    def postures(self, count: int, rng: np.random.Generator, walk: bool = False) -> np.ndarray:
        """Random postures, or those of a random walk [m]."""
        span = self.upper - self.lower
        if not walk:
            return rng.uniform(self.lower, self.upper, (count, len(span)))
        steps = rng.normal(size=(count, len(span)))
        steps *= 0.5 * rng.random((count, 1)) ** (1 / len(span)) / np.linalg.norm(steps, axis=1, keepdims=True)
        unit, rows = rng.random(len(span)), []
        for step in steps:
            unit = np.abs(unit + step)
            unit = np.where(unit > 1, 2 - unit, unit)
            rows.append(unit)
        return self.lower + span * np.array(rows)

    def learned(self, q: np.ndarray, x: np.ndarray, seed: int, **how: Any) -> Fit:
        """What is learned from movements."""
        return fit_curvature(Experience(q, x), self.lower, self.upper, joints=self.joints, seed=seed, **how)


def noisy(x: np.ndarray, size: float, uniform: bool, rng: np.random.Generator) -> np.ndarray:
    return x + (rng.uniform(-size, size, x.shape) if uniform else size * rng.normal(size=x.shape))


def summary(values: list[float]) -> dict[str, float]:
    return {"mean": round(float(np.mean(values)), 4), "worst": round(float(np.max(values)), 4)}


def reached(arm: Arm, fit: Fit, known: Experience, sensor: float, rng: np.random.Generator) -> np.ndarray:
    """True distances from unseen targets after 0 to 6 looks [mm]."""
    targets = arm.forward(arm.postures(TARGETS, rng))
    solver = ModelSolver(fit.model, arm.lower, arm.upper, known)
    course = correct(
        fit.model,
        solver,
        lambda q: noisy(arm.forward(q), sensor, False, rng),
        targets,
        solver.solve(targets).q,
        LOOKS,
        sensor=sensor,
        lower=arm.lower,
        upper=arm.upper,
    )
    return 1e3 * np.stack([np.linalg.norm(arm.forward(q) - targets, axis=1) for q in course.q])


def reaching(make: Callable[[int], Body], count: int, noise: float, uniform: bool, seeds: int, **how: Any) -> Row:
    """Fits of some bodies or seeds, and what their answers are worth."""
    walk, values = how.pop("walk", False), {}

    def note(name: str, value: float) -> None:
        values.setdefault(name, []).append(value)

    for seed in range(seeds):
        rng, arm = np.random.default_rng([seed, count]), Arm(make(seed))
        q = arm.postures(count, rng, walk)
        x = noisy(arm.forward(q), noise, uniform, rng)
        began = time.process_time()
        fit = arm.learned(q, x, seed, **how)
        note("fit_cpu_seconds", time.process_time() - began)
        fresh = arm.postures(2000, rng)
        error = 1e3 * np.linalg.norm(fit.model.forward(fresh) - arm.forward(fresh), axis=1)
        note("forward_error_mean_mm", float(error.mean()))
        clean, looked = (reached(arm, fit, Experience(q, x), sensor, rng) for sensor in (0.0, LOOK_NOISE))
        note("open_loop_error_mean_mm", float(clean[0].mean()))
        note("open_loop_error_p99_mm", float(np.percentile(clean[0], 99)))
        for looks in (1, 2, 3, 6):
            note(f"missed_percent_1mm_after_{looks}_looks", 100 * float((clean[looks] >= 1).mean()))
            note(f"error_mean_mm_after_{looks}_looks_with_2mm", float(looked[looks].mean()))
        note("says_it_is_not_arcs_percent", 100.0 * any("isn't constant" in each for each in fit.notes))
        note("test_of_structure_passed_percent", 100.0 * fits(Experience(q, x), fit))
    return {"movements": count, "noise_mm": 1e3 * noise, "uniform": uniform, "walk": walk} | {
        name: summary(each) for name, each in values.items()
    }


def circle() -> np.ndarray:
    angle = 2 * np.pi * np.arange(200) / 100
    return np.stack([0.2 * np.cos(angle), 0.2 * np.sin(angle), np.full(200, 0.7)], axis=1)


class Follower:
    """Goes from point to point, looks after each movement, and learns from it what its model is."""

    def __init__(self, arm: Arm, body: Curvature | Crippled, known: Experience, q: np.ndarray) -> None:
        self._arm, self._begun, self.model, self._known, self.q = arm, body, body, known, q
        self._since: list[tuple[np.ndarray, np.ndarray]] = []

    def aim(self, target: np.ndarray) -> np.ndarray:
        """Where to go for a target, from here."""
        lower, upper = self._arm.lower, self._arm.upper
        nothing = begun(self.model, self.q[None], LOOK_NOISE, lower, upper)
        from_here = aimed(nothing, self.model, target[None], self.q[None], lower, upper)
        if np.linalg.norm(self.model.forward(from_here)[0] - target) > STUCK:  # another posture
            memory = (self._known.q, self.model.forward(self._known.q))
            found = solve_model(self.model, target[None], lower, upper, memory=memory, near=self.q, starts=24)
            from_here = found.q
        return from_here[0]

    def saw(self, q: np.ndarray, x: np.ndarray) -> None:
        """Learn from a look."""
        self.q = q
        self._since.append((q, x))
        every, tips = (np.stack(each) for each in zip(*self._since, strict=True))
        self.model = updated(self._begun, Experience(every, tips), LOOK_NOISE)


def followed(arm: Arm, fit: Fit, known: Experience, seed: int) -> Row:
    """The circle with the whole arm; the locks, noticed or not; the circle with what is left [mm]."""
    rng, points = np.random.default_rng([seed, 7]), circle()
    assert isinstance(fit.model, Curvature)
    follower = Follower(arm, fit.model, known, arm.home)
    free, told = [], known.q[0] * np.nan

    def go(q: np.ndarray) -> np.ndarray:
        return arm.forward(np.where(np.isnan(told), q, told)[None])[0]

    def look(x: np.ndarray) -> np.ndarray:
        return noisy(x, LOOK_NOISE, False, rng)

    for target in points:
        q = follower.aim(target)
        x = go(q)
        free.append(1e3 * np.linalg.norm(x - target))
        follower.saw(q, look(x))
    for target in points[: rng.integers(1, 100)]:
        q = follower.aim(target)
        follower.saw(q, look(go(q)))
    told[-3:] = follower.q[-3:]  # they lock
    noticed, unaware, alarm = 0, [], False
    for moved, target in enumerate(points):
        q = follower.aim(target)
        x = go(q)
        unaware.append(1e3 * np.linalg.norm(x - target))
        watched = look(x)
        alarm = bool(surprises(follower.model, q[None], watched[None], LOOK_NOISE)[0] > JUMP)
        if alarm:
            noticed, follower.q = moved + 1, q
            break
        follower.saw(q, watched)
    probes = np.concatenate([follower.q[None], probe_movements(follower.q, arm.lower, arm.upper)])
    tips = np.stack([look(go(q)) for q in probes])
    found = diagnose(follower.model, Experience(probes, tips), arm.lower, arm.upper, LOOK_NOISE)
    follower = Follower(arm, found.model, known, probes[-1])
    locked = [_distance(follower, go, look, target) for target in points]
    can = _reachable(arm, told, points, known)
    errors = np.array(locked)[can]
    return {
        "circle_error_mean_mm": float(np.mean(free[1:])),
        "circle_error_max_mm": float(np.max(free[1:])),
        "noticed_after_movements": noticed,
        "causes_right_percent": 100.0 * ([c[:2] for c in found.causes] == [(j, "locked") for j in (6, 7, 8)]),
        "unaware_error_mean_mm": float(np.mean(unaware)),
        "locked_reachable_percent": 100 * float(can.mean()),
        "locked_error_mean_mm": float(errors.mean()) if len(errors) else float("nan"),
        "locked_error_max_mm": float(errors.max()) if len(errors) else float("nan"),
        "locked_error_mean_mm_second_round": float(np.array(locked)[100:][can[100:]].mean())
        if can.any()
        else float("nan"),
    }


def _distance(follower: Follower, go: Callable, look: Callable, target: np.ndarray) -> float:
    q = follower.aim(target)
    x = go(q)
    follower.saw(q, look(x))
    return 1e3 * float(np.linalg.norm(x - target))


def _reachable(arm: Arm, told: np.ndarray, points: np.ndarray, known: Experience) -> np.ndarray:
    """Which points the true arm can reach with its stuck actuators; its constants learned without noise."""
    exact = arm.learned(known.q[:400], arm.forward(known.q[:400]), 0).model
    stuck = ~np.isnan(told)
    body = Crippled(exact, 0 * arm.home, np.where(stuck, told, 0.0), (~stuck).astype(float), np.zeros((18, 18)))
    memory = (known.q, body.forward(known.q))
    return solve_model(body, points, arm.lower, arm.upper, memory=memory, starts=40).distance < REACHABLE


def broken(arm: Arm, fit: Fit, cases: int, seed: int) -> Row:
    """Random damage: noticed at the first movement, causes right, error of the model afterwards."""
    rng, rows = np.random.default_rng([seed, 9]), []
    for case in range(cases):
        place, share, truth = np.zeros(9), np.ones(9), []
        kind = ("locked", "weak", "slip")[case % 3]
        for joint in sorted(rng.permutation(9)[: int(rng.integers(1, 4)) if kind == "locked" else 1].tolist()):
            stood = rng.uniform(arm.lower[joint], arm.upper[joint])
            share[joint] = {"locked": 0.0, "weak": rng.uniform(0.3, 0.7), "slip": 1.0}[kind]
            place[joint] = {"locked": stood, "weak": (1 - share[joint]) * stood, "slip": 0.02}[kind]
            truth.append((joint, kind))
        first = arm.postures(1, rng)
        x = noisy(arm.forward(place + share * first), LOOK_NOISE, False, rng)
        noticed = bool(surprises(fit.model, first, x, LOOK_NOISE)[0] > JUMP)
        q = np.concatenate([first, probe_movements(first[0], arm.lower, arm.upper)])
        tips = noisy(arm.forward(place + share * q), LOOK_NOISE, False, rng)
        found: Diagnosis = diagnose(fit.model, Experience(q, tips), arm.lower, arm.upper, LOOK_NOISE)
        fresh = arm.postures(200, rng)
        error = np.linalg.norm(found.model.forward(fresh) - arm.forward(place + share * fresh), axis=1)
        rows.append((noticed, [c[:2] for c in found.causes] == truth, 1e3 * float(error.mean())))
    whole = arm.postures(10_000, rng)
    calm = surprises(fit.model, whole, noisy(arm.forward(whole), LOOK_NOISE, False, rng), LOOK_NOISE) > JUMP
    noticed, right, errors = zip(*rows, strict=True)
    return {
        "noticed_at_first_movement_percent": 100 * float(np.mean(noticed)),
        "causes_right_percent": 100 * float(np.mean(right)),
        "error_mean_mm_median_of_cases": float(np.median(errors)),
        "false_alarms_in_10000": int(calm.sum()),
    }


def circles(seeds: int, cases: int) -> tuple[Row, Row]:
    """Circle and damage, over seeds."""
    following, breaking = [], []
    for seed in range(seeds):
        rng, arm = np.random.default_rng([seed, 2000]), Arm(_bha(seed))
        q = arm.postures(2000, rng)
        x = noisy(arm.forward(q), 0.017, True, rng)
        fit = arm.learned(q, x, seed)
        following.append(followed(arm, fit, Experience(q, x), seed))
        breaking.append(broken(arm, fit, cases, seed))
    return _together(following), _together(breaking)


def _together(rows: list[Row]) -> Row:
    return {name: [round(float(row[name]), 4) for row in rows] for name in rows[0]}


def _bha(_: int) -> Body:
    body = toddle.load("bha")
    assert isinstance(body, Body)
    return body


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/reaching_soft.json"))
    asked = parser.parse_args()
    n = asked.seeds
    uneven = {"taper": 0.3, "nonlinear": 0.15, "sag": 0.3}
    rows = {
        "bha, 2000 at 17 mm": lambda: reaching(_bha, 2000, 0.017, True, n),
        "bha, 2000 at 17 mm, walk": lambda: reaching(_bha, 2000, 0.017, True, n, walk=True),
        "bha, 300 at 17 mm": lambda: reaching(_bha, 300, 0.017, True, n),
        "bha, 300 at 2 mm uniform": lambda: reaching(_bha, 300, 0.002, True, n),
        "bha, 300 at 2 mm Gaussian": lambda: reaching(_bha, 300, 0.002, False, n),
        "other layouts, 300 at 2 mm Gaussian": lambda: reaching(random_soft_arm, 300, 0.002, False, 2 * n),
        "uneven bha, 2000 at 2 mm, arcs only": lambda: reaching(
            lambda seed: bha_variant(**uneven, seed=seed), 2000, 0.002, False, n, arcs_only=True
        ),
        "uneven bha, 2000 at 2 mm": lambda: reaching(
            lambda seed: bha_variant(**uneven, seed=seed), 2000, 0.002, False, n
        ),
        "uneven other layouts, 2000 at 2 mm": lambda: reaching(
            lambda seed: random_soft_arm(seed, size=3, **uneven), 2000, 0.002, False, n
        ),
    }
    found: Row = {}
    for name, row in rows.items():
        found[name] = row()
        print(name, json.dumps(found[name]), flush=True)
    found["circle"], found["damage"] = circles(n, 40)
    print(json.dumps({name: found[name] for name in ("circle", "damage")}), flush=True)
    command = f"python -m benchmarks.reaching.soft --seeds {n}"
    result = {"benchmark": "soft arms", "command": command, "versions": versions(), "rows": found}
    asked.out.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
