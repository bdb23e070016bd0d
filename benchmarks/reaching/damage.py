"""Damage: is it noticed, is its cause named, and after how many movements is the arm accurate again?

    python -m benchmarks.reaching.damage [--arms 8] [--probes 0] [--out benchmarks/results/reaching_damage.json]

A case: a random arm of 4 to 10 joints (every fifth with a sliding joint) is learned from 300 movements with 1 mm noise
on each axis, answers three targets, and breaks at the fourth, in a joint that moves its tip by at least 5 cm a radian.
Each arm breaks five times in each way, whole again in between.
It goes on to targets that it can still reach, as well as it knows itself, and looks at its tip (1 mm noise) after each.
Judged are the true distances from 25 fresh reachable targets after each movement, and, after a break, the first
movement after which the mean (and the median) of them is below 2 mm. With probes, the first movements after the alarm
are chosen to tell the causes apart, instead of going to targets. False alarms are counted on unbroken arms.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

from toddle.outside.compile_cache import use_compile_cache

use_compile_cache()  # before Numba is imported

from toddle.outside.versions import versions  # noqa: E402
from toddle.reach.model.damage_repair import repair, telling_movement  # noqa: E402
from toddle.reach.model.damage_watch import Level, Watch, look  # noqa: E402
from toddle.reach.model.model import Fit  # noqa: E402
from toddle.reach.model.rigid import Rigid  # noqa: E402
from toddle.reach.model.screws import fit_screws  # noqa: E402
from toddle.reach.solve.damped import damped_solver  # noqa: E402
from toddle.robots.chain import Chain  # noqa: E402
from toddle.robots.damage import Damage  # noqa: E402
from toddle.robots.damaged import DamagedPlant  # noqa: E402
from toddle.robots.linkage import linkage_of, poses  # noqa: E402
from toddle.signals import Experience  # noqa: E402

NOISE, MOVEMENTS, FRESH, BREAK, BREAKS = 1e-3, 300, 25, 4, 5
AMOUNTS = {"lock": 0.0, "slip": 0.2, "bend": 0.05, "weaken": 0.5, "replace": 0.08}
LAST = {"lock": 5, "slip": 5, "bend": 10, "weaken": 5, "replace": 6}


def random_arm(joints: int, rng: np.random.Generator, *, sliding: bool) -> Chain:
    """Axes about parallel or at right angles to their predecessors, links of 5 to 40 cm, ranges of 3 to 5 rad."""
    before = np.tile(np.eye(4), (joints, 1, 1))
    for transform in before:
        twist = rng.choice([-0.5, 0.0, 0.5]) * np.pi + 0.05 * rng.normal()
        transform[:3, :3] = Rotation.from_euler("zx", [rng.uniform(-3, 3), twist]).as_matrix()
        way = rng.normal(size=3)
        transform[:3, 3] = rng.uniform(0.05, 0.4) * way / np.linalg.norm(way)
    tip, way = np.eye(4), rng.normal(size=3)
    tip[:3, 3] = 0.15 * way / np.linalg.norm(way)
    slides = np.zeros(joints)
    slides[rng.integers(joints)] = float(sliding)
    lower = np.where(slides > 0, 0.0, -rng.uniform(1.5, 2.6, joints))
    upper = np.where(slides > 0, 0.3, rng.uniform(1.5, 2.6, joints))

    def f32(values: np.ndarray) -> jax.Array:
        return jnp.asarray(values, jnp.float32)

    return Chain(
        name=f"random {joints}",
        joints=tuple(f"joint_{k + 1}" for k in range(joints)),
        lower=f32(lower),
        upper=f32(upper),
        home=f32((lower + upper) / 2),
        before=f32(before),
        slides=f32(slides),
        gain=f32(np.eye(joints)),
        offset=f32(np.zeros(joints)),
        tip=f32(tip),
    )


class Arm:
    """A random arm and what was learned of it."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.body = random_arm(4 + seed % 7, self.rng, sliding=seed % 5 == 4)
        self.lower, self.upper = np.asarray(self.body.lower, float), np.asarray(self.body.upper, float)
        self.fit = self._learned()

    def _learned(self) -> Fit:
        q = self.some(MOVEMENTS)
        x = poses(linkage_of(self.body), q)[:, :3, 3]
        experience = Experience(q, x + NOISE * self.rng.normal(size=x.shape))
        return fit_screws(experience, joints=self.body.joints)

    def some(self, count: int) -> np.ndarray:
        """Random postures within the limits."""
        return self.rng.uniform(self.lower, self.upper, (count, len(self.lower)))

    @property
    def model(self) -> Rigid:
        """The arm as it was learned."""
        assert isinstance(self.fit.model, Rigid)
        return self.fit.model

    def solve(self, model: Rigid, targets: np.ndarray) -> np.ndarray:
        """Answers on a model, limits kept."""
        return damped_solver(model.linkage, self.lower, self.upper, postures=256, tries=20).solve(targets).q


def tips(plant: DamagedPlant, q: np.ndarray) -> np.ndarray:
    """Where the broken body's tip truly goes [m]."""
    actual, linkage = plant.actual(q)
    assert linkage is not None
    return poses(linkage, actual)[:, :3, 3]


def case(arm: Arm, kind: str, probes: int) -> dict:
    """One arm breaks once."""
    shown = np.linalg.norm(arm.model.slope(arm.some(100))[1], axis=1).mean(0)
    joint = int(arm.rng.choice(np.flatnonzero(shown > 0.05)))
    slides = bool(linkage_of(arm.body).slides[joint])
    amount = 0.05 if kind == "slip" and slides else AMOUNTS[kind]
    damage = Damage(kind, arm.body.joints[joint], amount, BREAK)
    plant = DamagedPlant(arm.body, [damage], noise=NOISE, seed=int(arm.rng.integers(2**31)))
    model, watch, stood = arm.model, Watch.start(float(arm.fit.wild.mean())), plant.home
    noticed, since, repairs = 0, [], ()
    record = {
        "joint": joint,
        "slides": slides,
        "errors": [],
        "medians": [],
        "named": [],
        "cpu_s": [],
        "alarms_before": 0,
    }
    for movement in range(1, BREAK + LAST[kind] + 1):
        if repairs and len(since) <= probes:
            candidates = arm.some(200)
            q = candidates[telling_movement(repairs, candidates, arm.fit.sensor)]
        else:
            q = arm.solve(model, tips(plant, arm.some(1)))[0]
        x = plant.move(q)
        if not noticed:
            watch, alarm = look(watch, q, x, model, arm.fit.sensor)
            if alarm.level is not Level.CALM:
                record["alarms_before"] += movement < BREAK
                noticed = max(0, movement - BREAK + 1)
        if not noticed:
            stood = q
            continue
        since.append((q, x))
        before = time.process_time()
        seen = Experience(*(np.array(column) for column in zip(*since, strict=True)))
        repairs = repair(arm.model, seen, arm.lower, arm.upper, arm.fit.sensor, stood=stood)
        record["cpu_s"].append(time.process_time() - before)
        model = repairs[0].model
        record["named"].append((repairs[0].kind, repairs[0].joint))
        targets = tips(plant, arm.some(FRESH))
        away = np.linalg.norm(tips(plant, arm.solve(model, targets)) - targets, axis=1)
        record["errors"].append(float(away.mean()))
        record["medians"].append(float(np.median(away)))
    return {**record, "noticed": noticed}


def first_below(errors: list[float], bound: float = 2e-3) -> int:
    """The first movement after which an error is below the bound; 99: none is."""
    return next((k for k, error in enumerate(errors, 1) if error < bound), 99)


def summary(kind: str, cases: list[dict]) -> dict:
    joints = [case["joint"] for case in cases]
    judged = 8 if kind in ("bend", "replace") else 4
    judged = min(judged, LAST[kind])
    named = [case["named"][min(judged, len(case["named"])) - 1] if case["named"] else ("", -1) for case in cases]
    needed = {key: [first_below(case[key]) for case in cases] for key in ("errors", "medians")}
    course = [[case["errors"][k] for case in cases if len(case["errors"]) > k] for k in range(LAST[kind])]
    return {
        "cases": len(cases),
        "noticed_at_first_movement_percent": 100 * float(np.mean([case["noticed"] == 1 for case in cases])),
        "noticed_at_movement": {str(k): v for k, v in sorted(Counter(case["noticed"] for case in cases).items())},
        "movements_to_mean_below_2mm": quantiles(needed["errors"]),
        "movements_to_median_below_2mm": quantiles(needed["medians"]),
        f"kind_named_after_{judged}_percent": 100 * float(np.mean([name[0] == kind for name in named])),
        f"kind_and_joint_named_after_{judged}_percent": 100
        * float(np.mean([name == (kind, joint) for name, joint in zip(named, joints, strict=True)])),
        "median_of_mean_errors_mm_by_movement": [round(1e3 * float(np.median(row)), 2) for row in course if row],
        "repair_cpu_s": quantiles([second for case in cases for second in case["cpu_s"]]),
        "named_otherwise": {f"{name[0]}": count for name, count in Counter(n for n in named if n[0] != kind).items()},
    }


def quantiles(values: list) -> dict:
    return {
        "median": round(float(np.median(values)), 3),
        "p90": round(float(np.quantile(values, 0.9)), 3),
        "max": round(float(np.max(values)), 3),
    }


def false_alarms(arms: int, movements: int) -> dict:
    """Movements of unbroken arms at which anything but calm was said."""
    suspected = confirmed = 0
    for seed in range(arms):
        arm = Arm(50_000 + seed)
        q = arm.some(movements)
        x = poses(linkage_of(arm.body), q)[:, :3, 3]
        x = x + NOISE * arm.rng.normal(size=x.shape)
        watch = Watch.start(float(arm.fit.wild.mean()))
        for row, tip in zip(q, x, strict=True):
            watch, alarm = look(watch, row, tip, arm.model, arm.fit.sensor)
            suspected += alarm.level is Level.SUSPECTED
            if alarm.level is Level.CONFIRMED:
                confirmed, watch = confirmed + 1, Watch.start(float(arm.fit.wild.mean()))
    total = arms * movements
    return {
        "movements": total,
        "suspected": suspected,
        "confirmed": confirmed,
        "per_10000": round(1e4 * (suspected + confirmed) / total, 3),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arms", type=int, default=8)
    parser.add_argument("--probes", type=int, default=0)
    parser.add_argument("--kinds", nargs="+", choices=tuple(AMOUNTS), default=list(AMOUNTS))
    parser.add_argument("--first", type=int, default=0, help="seed of the first arm")
    parser.add_argument("--alarms", type=int, default=7, help="unbroken arms of 3000 movements")
    parser.add_argument("--out", type=Path, default=None)
    options = parser.parse_args()
    cases: dict[str, list[dict]] = {kind: [] for kind in options.kinds}
    for seed in range(options.first, options.first + options.arms):
        arm = Arm(seed)
        for kind in options.kinds:
            cases[kind] += [case(arm, kind, options.probes) for _ in range(BREAKS)]
    result = {
        "benchmark": "reaching_damage",
        "what": f"arms of 4 to 10 joints learned from {MOVEMENTS} movements at {1e3 * NOISE:g} mm break once",
        "probes": options.probes,
        **{kind: summary(kind, list_) for kind, list_ in cases.items()},
        "false_alarms": false_alarms(options.alarms, 3000),
        "seeds": [options.first, options.first + options.arms - 1],
        "versions": versions(),
        "command": "python -m benchmarks.reaching.damage "
        f"--arms {options.arms} --probes {options.probes} --kinds {' '.join(cases)}",
    }
    text = json.dumps(result, indent=2)
    print(text)
    if options.out is not None:
        options.out.write_text(text + "\n")


if __name__ == "__main__":
    main()
