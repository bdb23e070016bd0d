"""A planar arm of five joints and one metre, as Rolf's (Mahboob 2015, appendix A; figures A.3-A.8).

Two hidden layers of 100 units. The document's findings: the error settles between 250,000 and 300,000 movements,
"though our final settling error is high" (it prints none); and by 10,000 movements "the major part of the reachable
space" is covered already, where Rolf (2013) needs more. Workspace discovery is shown after 10^3, 10^4, 10^5 and
10^5.7784 movements. The document tells neither joint ranges nor learning rate and perturbation. Its best ones (0.717,
0.233) are taken, and several ranges: with joints to spare, the wider they are, the more postures there are for one
position, and a perceptron that learns from all of them answers with their mean.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.experiments.families import Family, learn_family, visited
from toddle.reach.config import ReachConfig
from toddle.reach.session import open_session
from toddle.robots.planar import planar

METHOD = "goal-and-motor-babbling"


@dataclass(frozen=True)
class Parameters:
    """Of the experiment.

    Attributes:
        limits_deg: joint ranges, plus or minus [deg]; the discovery is shown for the first.
        hidden, learning_rate, perturbation: of the perceptron and the babbling.
        network: plain, as the document's, or refined.
        movements: that each run learns from; the document's 10^5.7784 but for 344.
        per_cycle: movements between two tests.
        seeds: runs.
        discovery: movements after which the discovered workspace is shown.
        major: share of the reachable cells that counts as the major part [%].
    """

    limits_deg: tuple[float, ...] = (90.0, 45.0, 30.0)
    hidden: tuple[int, ...] = (100, 100)
    learning_rate: float = 0.717
    perturbation: float = 0.233
    network: Literal["plain", "refined"] = "plain"
    movements: int = 600_000
    per_cycle: int = 1_000
    seeds: int = 2
    discovery: tuple[int, ...] = (1_000, 10_000, 100_000, 600_000)
    major: float = 50.0


FULL = Parameters()
QUICK = replace(FULL, movements=100_000, seeds=1, limits_deg=(90.0, 45.0), discovery=(1_000, 10_000, 100_000))
SETTLES = (250e3, 300e3)  # movements, section A.1.2
MAJOR_BY = 10_000  # movements, section A.1.3


def run(task: Task) -> Outcome:
    """The runs, how much of space they discover by when, and the pictures of figures A.3 to A.8."""
    parameters = FULL if task.full else QUICK
    parameters = replace(parameters, seeds=task.seeds or parameters.seeds)
    config = ReachConfig(
        method=METHOD, hidden=parameters.hidden, learning_rate=parameters.learning_rate,
        perturbation=parameters.perturbation,
        samples=parameters.movements, per_cycle=parameters.per_cycle, seed=task.seed, network=parameters.network,
    )  # fmt: skip
    families: dict[float, Family] = {}
    for k, limit in enumerate(parameters.limits_deg):
        if not task.stopped():
            session = open_session(planar(5, limit=math.radians(limit)), config)
            part = task.part(k / len(parameters.limits_deg), (k + 1) / len(parameters.limits_deg))
            families[limit] = learn_family(session, parameters.seeds, part, keep=parameters.discovery)
    family = families[parameters.limits_deg[0]]
    covered = {
        int(count): float(family.coverage[:, i].mean())
        for i, count in enumerate(family.samples)
        if count in parameters.discovery
    }
    rows = [Row(f"workspace visited by {count:,} movements", share, None, "%") for count, share in covered.items()]
    for limit, learned in families.items():
        (fixed, seen), settled = learned.settled(), float(learned.samples[learned.settles_at()])
        rows += [
            Row(f"+-{limit:g} deg: fixed test set, last fifth", fixed, None, "mm"),
            Row(f"+-{limit:g} deg: seen test set, last fifth", seen, None, "mm"),
            Row(f"+-{limit:g} deg: movements until the error settles", settled, SETTLES[1]),
        ]
    draw(family, covered, task.folder)
    share = covered.get(MAJOR_BY, 0.0)
    verdict = (
        f"{share:.0f} % of the reachable space is visited by {MAJOR_BY:,} movements "
        f"(the document: the major part; {parameters.major:g} % asked)"
    )
    figures = {f"+-{limit:g} deg": learned.course() for limit, learned in families.items()}
    return Outcome(tuple(rows), verdict, share >= parameters.major, parameters, figures)


def draw(family: Family, covered: dict[int, float], folder: Path) -> None:
    """Figures A.3 and A.4 (error over tests and movements), A.5 to A.8 (workspace discovery)."""
    from toddle.outside import document_pictures

    document_pictures.courses(
        folder / "figure-a-3-a-4.png",
        {"fixed test set": (family.samples, family.fixed[0]), "seen test set": (family.samples, family.seen[0])},
        {},
        x_label="movements (a test each 1,000)", y_label="mean error [mm]", title="figures A.3, A.4: one run",
    )  # fmt: skip
    explored = {
        f"{count:,} movements: {covered[count]:.0f} % visited": visited(family, progress)
        for count, progress in family.kept.items()
    }
    document_pictures.discovery(
        folder / "figure-a-5-a-8.png",
        explored,
        title="figures A.5 to A.8: workspace discovery (4,096 positions shown)",
    )


EXPERIMENT = Experiment("mahboob-planar5", "Mahboob 2015, figures A.3-A.8", run)
