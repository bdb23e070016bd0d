"""Goal babbling with direction sampling on planar arms of 5, 20 and 50 joints (Rolf 2013; Rolf, Steil, Gienger 2011).

A local linear map learns from goals along lines in random directions, with perturbations that change slowly. Mahboob
2015 (4.1) reports of Rolf's experiment that "the approach works well enough for 5 DOF as well as 50 DOF" and converges
after "almost 1.000.000 examples"; the arms are one metre long. The papers' figures are curves: no number is printed
that could stand beside ours, so ours stand beside what we ask of them.

The learning rate is 0.2 (Rolf: 0.1), and the arm goes home at eight line ends in ten (Rolf: one), and quickly: with his
values more runs settle with a region where two ways of reaching are mixed. Ours were chosen on other seeds.
Joint ranges, home and test goals are ours too: a base that turns by 2.5 rad to each side, all others by 90 degrees; a
home that is bent, lest it lie at the edge of what can be reached; goals 0.3 to 0.95 m away, up to 2 rad to each side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.experiments.families import Family, learn_family, visited
from toddle.reach.config import ReachConfig
from toddle.reach.evaluate.targets import fixed_targets
from toddle.reach.explore.direction import direction_sampling
from toddle.reach.session import Session, open_session
from toddle.robots.chain import Chain
from toddle.robots.planar import planar


@dataclass(frozen=True)
class Parameters:
    """Of the experiment.

    Attributes:
        joints: of the arms.
        method, learner: names of `toddle.reach.methods`.
        learning_rate: of the local linear map.
        step: distance of one goal from the next [m].
        sigma: size of the perturbation [rad].
        p_home: probability that the arm moves home at a line's end.
        home_step: the most that a joint turns in one movement on the way home [rad].
        base_limit: the first joint turns by plus or minus this [rad].
        bend: sum of the joint angles at home [rad]; the base turns until the tip is straight ahead.
        nearest, farthest: distance of test goals from the base [m].
        widest: their angle from straight ahead, at most [rad].
        goals: how many there are.
        movements: that each run learns from.
        per_cycle: movements between two tests.
        seeds: runs of each arm.
        asked_mm: for each arm, error of the median run over the last fifth of the tests, up to which it counts [mm].
        bootstraps_by: movements after which no test of the median run may exceed the next number.
        stays_below_mm: for each arm; it says whether the arm bootstraps [mm].
    """

    joints: tuple[int, ...] = (5, 20, 50)
    method: str = "goal-babbling"
    learner: str = "local-linear"
    learning_rate: float = 0.2
    step: float = 0.02
    sigma: float = 0.05
    p_home: float = 0.8
    home_step: float = 0.2
    base_limit: float = 2.5
    bend: float = 0.9 * math.pi
    nearest: float = 0.3
    farthest: float = 0.95
    widest: float = 2.0
    goals: int = 110
    movements: int = 400_000
    per_cycle: int = 4_000
    seeds: int = 5
    asked_mm: tuple[float, ...] = (15.0, 25.0, 50.0)
    bootstraps_by: int = 200_000
    stays_below_mm: tuple[float, ...] = (math.inf, math.inf, 50.0)


FULL = Parameters()
QUICK = replace(
    FULL, joints=(5, 20), movements=60_000, per_cycle=2_000, seeds=2, asked_mm=(75.0, 150.0), bootstraps_by=60_000
)
DOCUMENT_CONVERGES = 1e6  # movements, Mahboob 2015, section 4.1


def arm(joints: int, parameters: Parameters) -> Chain:
    """A planar arm with a wide base and a bent home."""
    bent = np.full(joints, parameters.bend / joints)
    links = np.cumsum(bent)
    bent[0] -= math.atan2(np.sin(links).sum(), np.cos(links).sum())
    whole = planar(joints)
    limit = parameters.base_limit
    return replace(
        whole,
        home=jnp.asarray(bent, jnp.float32),
        lower=whole.lower.at[0].set(-limit),
        upper=whole.upper.at[0].set(limit),
    )


def goals_on_a_ring(parameters: Parameters, seed: int) -> Float[np.ndarray, "goals 2"]:
    """Goals spread over a part of a ring [m]."""
    drawn = np.random.default_rng(seed)
    distance = np.sqrt(drawn.uniform(parameters.nearest**2, parameters.farthest**2, 20_000))
    angle = drawn.uniform(-parameters.widest, parameters.widest, 20_000)
    ring = np.stack([distance * np.cos(angle), distance * np.sin(angle)], axis=1)
    return fixed_targets(ring, parameters.goals)[0]


def opened(joints: int, parameters: Parameters, seed: int) -> Session:
    """A session on the arm, with the ring's goals as its fixed test set."""
    config = ReachConfig(
        method=parameters.method, learner=parameters.learner, learning_rate=parameters.learning_rate,
        samples=parameters.movements, per_cycle=parameters.per_cycle, seed=seed,
    )  # fmt: skip
    session = open_session(arm(joints, parameters), config)
    explorer = direction_sampling(
        session.setting.box, step=parameters.step, sigma=parameters.sigma, p_home=parameters.p_home,
        home_step=parameters.home_step,
    )  # fmt: skip
    setting = replace(session.setting, explorer=explorer)
    return replace(session, setting=setting, targets=goals_on_a_ring(parameters, seed))


def run(task: Task) -> Outcome:
    """Each arm's runs; error and discovered workspace over movements."""
    parameters = FULL if task.full else QUICK
    parameters = replace(parameters, seeds=task.seeds or parameters.seeds)
    families: dict[int, Family] = {}
    for k, joints in enumerate(parameters.joints):
        if not task.stopped():
            part = task.part(k / len(parameters.joints), (k + 1) / len(parameters.joints))
            families[joints] = learn_family(opened(joints, parameters, task.seed), parameters.seeds, part)
    draw(families, task.folder)
    rows = [row for joints, family in families.items() for row in rows_of(joints, family, parameters)]
    found = {
        joints: (
            float(np.median(last_fifth(families[joints]))),
            np.median(worst_after(families[joints], parameters.bootstraps_by)) < below,
            asked,
        )
        for joints, asked, below in zip(parameters.joints, parameters.asked_mm, parameters.stays_below_mm, strict=False)
        if joints in families
    }
    holds = len(found) == len(parameters.joints) and all(mm <= asked and stays for mm, stays, asked in found.values())
    verdict = "; ".join(f"{joints} joints {mm:.1f} mm ({asked:g} asked)" for joints, (mm, _, asked) in found.items())
    figures = {
        f"{joints} joints": {"last_fifth_mm_of_each_run": last_fifth(family).round(2).tolist(), **family.course()}
        for joints, family in families.items()
    }
    return Outcome(tuple(rows), f"median runs, over the last fifth of the tests: {verdict}", holds, parameters, figures)


def last_fifth(family: Family) -> Float[np.ndarray, " seeds"]:
    """Each run's mean error over the last fifth of the tests [mm]."""
    return family.fixed[:, -max(1, len(family.samples) // 5) :].mean(axis=1)


def worst_after(family: Family, movements: int) -> Float[np.ndarray, " seeds"]:
    """Each run's largest error at any test after so many movements [mm]; 0: there was none."""
    return family.fixed[:, family.samples > movements].max(axis=1, initial=0.0)


def rows_of(joints: int, family: Family, parameters: Parameters) -> list[Row]:
    """What one arm comes to."""
    runs, settles = last_fifth(family), float(family.samples[family.settles_at()])
    worst = float(np.median(worst_after(family, parameters.bootstraps_by)))
    return [
        Row(f"{joints} joints: fixed test set, last fifth, median run", float(np.median(runs)), None, "mm"),
        Row(f"{joints} joints: the best run", float(runs.min()), None, "mm"),
        Row(f"{joints} joints: the worst run", float(runs.max()), None, "mm"),
        Row(f"{joints} joints: worst test after {parameters.bootstraps_by:,} movements, median run", worst, None, "mm"),
        Row(f"{joints} joints: seen test set, last fifth", family.settled()[1], None, "mm"),
        Row(f"{joints} joints: workspace visited", float(family.coverage[:, -1].mean()), None, "%"),
        Row(f"{joints} joints: movements until the error settles", settles, DOCUMENT_CONVERGES),
    ]


def draw(families: dict[int, Family], folder: Path) -> None:
    """Error over movements of all arms, and the space that each explored."""
    from toddle.outside import document_pictures

    document_pictures.courses(
        folder / "error.png",
        {f"{joints} joints": (family.samples, np.median(family.fixed, axis=0)) for joints, family in families.items()},
        {},
        x_label="movements", y_label="mean error, fixed test set [mm]", title="planar arms, median run",
    )  # fmt: skip
    explored = {
        f"{joints} joints: {family.coverage[0, -1]:.0f} % visited": visited(family, family.best)
        for joints, family in families.items()
    }
    document_pictures.discovery(folder / "explored.png", explored, title="explored space (4,096 positions shown)")


EXPERIMENT = Experiment("rolf-direction-sampling", "Rolf 2013, planar arms of 5, 20 and 50 joints", run)
