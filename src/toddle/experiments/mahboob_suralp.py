"""The arm of SURALP learns to reach (Mahboob 2015, chapter 5; figures 5.4-5.8).

Goal and motor babbling, two hidden layers of 40 units, learning rate 0.7, perturbation 0.233; the document comes to 28
mm on the fixed test set (60 points) after 2,839 tests and about a million movements, and to 19 mm on the seen one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.experiments.families import Family, learn_family, open_for, visited
from toddle.reach.config import ReachConfig

METHOD = "goal-and-motor-babbling"


@dataclass(frozen=True)
class Parameters:
    """Of the experiment.

    Attributes:
        robot: the arm.
        hidden, learning_rate, perturbation: the document's best.
        movements: that each run learns from.
        per_cycle: movements between two tests.
        seeds: runs.
        fixed_mm: error in the best cycle up to which the document counts as reproduced [mm].
    """

    robot: str = "suralp"
    hidden: tuple[int, ...] = (40, 40)
    learning_rate: float = 0.7
    perturbation: float = 0.233
    movements: int = 1_000_000
    per_cycle: int = 2_000
    seeds: int = 3
    fixed_mm: float = 28.0


FULL = Parameters()
QUICK = replace(FULL, movements=200_000, seeds=1)


@dataclass(frozen=True)
class Printed:
    """What the document prints [mm], section 5.4."""

    fixed: float = 28.0
    seen: float = 19.0


def run(task: Task) -> Outcome:
    """The runs with both perceptrons, and the pictures of figures 5.4 to 5.8."""
    parameters = FULL if task.full else QUICK
    parameters, document = replace(parameters, seeds=task.seeds or parameters.seeds), Printed()
    refined = ReachConfig(
        method=METHOD, hidden=parameters.hidden, learning_rate=parameters.learning_rate,
        perturbation=parameters.perturbation,
        samples=parameters.movements, per_cycle=parameters.per_cycle, seed=task.seed,
    )  # fmt: skip
    plain = replace(refined, network="plain")
    families = {
        name: learn_family(open_for(parameters.robot, config), parameters.seeds, task.part(*share))
        for name, config, share in (("refined", refined, (0.0, 0.5)), ("plain", plain, (0.5, 1.0)))
    }
    rows: list[Row] = []
    for name, family in families.items():
        (fixed_best, seen_best), (fixed, seen) = family.best_cycle(), family.settled()
        rows += [
            Row(f"{name} perceptron, fixed test set, best cycle", fixed_best, document.fixed, "mm"),
            Row(f"{name} perceptron, seen test set, that cycle", seen_best, document.seen, "mm"),
            Row(f"{name} perceptron, fixed test set, last fifth", fixed, None, "mm"),
            Row(f"{name} perceptron, seen test set, last fifth", seen, None, "mm"),
        ]
    best = families["refined"].best_cycle()[0]
    rows.append(Row("workspace visited", float(families["refined"].coverage[:, -1].mean()), None, "%"))
    draw(families["refined"], document, task.folder)
    verdict = (
        f"in the best testing cycle {best:.1f} mm on the fixed test set, mean of {parameters.seeds} runs "
        f"of {int(families['refined'].samples[-1]):,} movements (asked: {parameters.fixed_mm:g})"
    )
    figures = {name: family.course() for name, family in families.items()}
    return Outcome(tuple(rows), verdict, best <= parameters.fixed_mm, parameters, figures)


def draw(family: Family, document: Printed, folder: Path) -> None:
    """Figures 5.4 to 5.7 (error on both test sets, over tests and movements) and 5.8 (area explored)."""
    from toddle.outside import document_pictures, pictures

    tests = np.arange(1, len(family.samples) + 1)
    for name, label, over in (("5-4-5-6", "testing cycle", tests), ("5-5-5-7", "movements", family.samples)):
        document_pictures.courses(
            folder / f"figure-{name}.png",
            {"fixed test set": (over, family.fixed[0]), "seen test set": (over, family.seen[0])},
            {"document, fixed": document.fixed, "document, seen": document.seen},
            x_label=label, y_label="mean error [mm]",
            title=f"figures {name[:3].replace('-', '.')}, {name[4:].replace('-', '.')}: one run",
        )  # fmt: skip
    explored = visited(family, family.best)
    pictures.explored_space(folder / "figure-5-8.png", explored, np.zeros(3), title="figure 5.8: area explored")


EXPERIMENT = Experiment("mahboob-suralp", "Mahboob 2015, figures 5.4-5.8", run)
