"""Goal babbling with direction sampling on planar arms of 5, 20 and 50 joints (Rolf 2013; Rolf, Steil, Gienger 2011).

A local linear map learns from goals along lines in random directions, with rate 0.1 and perturbations that change
slowly. Mahboob 2015 (4.1) reports of Rolf's experiment that "the approach works well enough for 5 DOF as well as 50
DOF" and converges after "almost 1.000.000 examples"; the arms are one metre long. The papers' figures are curves: no
number is printed that could stand beside ours, so ours stand beside what we ask of them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.experiments.families import Family, learn_family, open_for, visited
from toddle.reach.config import ReachConfig


@dataclass(frozen=True)
class Parameters:
    """Of the experiment.

    Attributes:
        joints: of the arms.
        method, learner: names of `toddle.reach.methods`.
        movements: that each run learns from.
        per_cycle: movements between two tests.
        seeds: runs of each arm.
        asked_mm: mean error on the fixed test set, over the last half, up to which an arm has learned to reach [mm].
    """

    joints: tuple[int, ...] = (5, 20, 50)
    method: str = "goal-babbling"
    learner: str = "local-linear"
    movements: int = 400_000
    per_cycle: int = 4_000
    seeds: int = 3
    asked_mm: tuple[float, ...] = (15.0, 25.0, 50.0)


FULL = Parameters()
QUICK = replace(FULL, joints=(5, 20), movements=60_000, per_cycle=2_000, seeds=1)
DOCUMENT_CONVERGES = 1e6  # movements, Mahboob 2015, section 4.1


def run(task: Task) -> Outcome:
    """Each arm's runs; error and discovered workspace over movements."""
    parameters = FULL if task.full else QUICK
    parameters = replace(parameters, seeds=task.seeds or parameters.seeds)
    config = ReachConfig(
        method=parameters.method, learner=parameters.learner, samples=parameters.movements,
        per_cycle=parameters.per_cycle, seed=task.seed,
    )  # fmt: skip
    families: dict[int, Family] = {}
    rows: list[Row] = []
    for k, joints in enumerate(parameters.joints):
        if task.stopped():
            break
        share = 1 / len(parameters.joints)
        session = open_for(f"planar:{joints}", config)
        families[joints] = family = learn_family(session, parameters.seeds, task.part(k * share, (k + 1) * share))
        rows += rows_of(joints, family)
    draw(families, task.folder)
    half = {joints: family.settled(0.5)[0] for joints, family in families.items()}
    asked = dict(zip(parameters.joints, parameters.asked_mm, strict=False))
    holds = len(half) == len(parameters.joints) and all(half[joints] <= asked[joints] for joints in half)
    verdict = "; ".join(f"{joints} joints {half[joints]:.1f} mm (asked: {asked[joints]:g})" for joints in half)
    figures = {f"planar:{joints}": family.course() for joints, family in families.items()}
    return Outcome(tuple(rows), f"over the last half {verdict}", holds, parameters, figures)


def rows_of(joints: int, family: Family) -> list[Row]:
    """What one arm comes to."""
    half = family.fixed[:, len(family.samples) // 2 :]
    return [
        Row(f"{joints} joints: fixed test set, mean over the last half", float(half.mean()), None, "mm"),
        Row(f"{joints} joints: fixed test set, worst test of the last half", float(half.max()), None, "mm"),
        Row(f"{joints} joints: fixed test set, last fifth", family.settled()[0], None, "mm"),
        Row(f"{joints} joints: workspace visited", float(family.coverage[:, -1].mean()), None, "%"),
        Row(
            f"{joints} joints: movements until the error settles",
            float(family.samples[family.settles_at()]),
            DOCUMENT_CONVERGES,
        ),
    ]


def draw(families: dict[int, Family], folder: Path) -> None:
    """Error over movements of all arms, and the space that each explored."""
    from toddle.outside import document_pictures

    document_pictures.courses(
        folder / "error.png",
        {f"{joints} joints": (family.samples, family.fixed.mean(axis=0)) for joints, family in families.items()},
        {},
        x_label="movements", y_label="mean error, fixed test set [mm]", title="direction sampling on planar arms",
    )  # fmt: skip
    explored = {
        f"{joints} joints: {family.coverage[0, -1]:.0f} % visited": visited(family, family.best)
        for joints, family in families.items()
    }
    document_pictures.discovery(folder / "explored.png", explored, title="explored space (4,096 positions shown)")


EXPERIMENT = Experiment("rolf-direction-sampling", "Rolf 2013, planar arms of 5, 20 and 50 joints", run)
