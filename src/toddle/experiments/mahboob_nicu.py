"""The arm of NICU learns to reach (Mahboob 2015, section 4.4.2; figures 4.6, 4.7, 4.8, C.1 and C.2).

Goal and motor babbling, 10 hidden units, learning rate 0.717, perturbation 0.233; 100,000 lines, about 300,000
movements, tested 500 times. The document prints the errors of its best testing cycle and leaves open how joint values
are scaled, so two perceptrons learn: a plain one, and toddle's refined one (`toddle.reach.learn.perceptron`).

Beside them stands what 10 hidden units can do at all when they are trained through the true kinematics, for both
readings of the document's "allowed rotations": as total spans (the catalogue's nicu) and as plus or minus (nicu-wide).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from toddle.experiments.capacity import capacity
from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.experiments.families import Family, errors_point_by_point, learn_family, open_for, visited
from toddle.reach.config import ReachConfig

METHOD = "goal-and-motor-babbling"


@dataclass(frozen=True)
class Parameters:
    """Of the experiment.

    Attributes:
        robot, wide: the arm, and its other reading.
        hidden, learning_rate, perturbation: the document's best.
        movements: that each run learns from.
        per_cycle: movements between two tests.
        seeds: runs.
        starts, steps: of the training through the kinematics.
        fixed_mm, seen_mm: errors in the best cycle up to which the document counts as reproduced [mm].
    """

    robot: str = "nicu"
    wide: str = "nicu-wide"
    hidden: tuple[int, ...] = (10,)
    learning_rate: float = 0.717
    perturbation: float = 0.233
    movements: int = 300_000
    per_cycle: int = 600
    seeds: int = 5
    starts: int = 8
    steps: int = 6_000
    fixed_mm: float = 30.0
    seen_mm: float = 20.0


FULL = Parameters()
QUICK = replace(FULL, seeds=2, starts=4)


@dataclass(frozen=True)
class Printed:
    """What the document prints."""

    fixed: float = 24.745  # [mm], figure 4.8
    seen: float = 17.962  # [mm], figure 4.8
    fixed_below_40: float = 18.8  # [mm], mean of the green points of figure C.1
    seen_below_30: float = 17.3  # [mm], mean of the green points of figure C.2
    movements_a_line: float = 3.3  # 200,000 iterations (section 4.5) in 60,000 lines (section 4.4.4)


def run(task: Task) -> Outcome:
    """The runs, their best cycles, and what the network can do at all."""
    parameters = FULL if task.full else QUICK
    parameters, document = replace(parameters, seeds=task.seeds or parameters.seeds), Printed()
    ours = ReachConfig(
        method=METHOD, hidden=parameters.hidden, learning_rate=parameters.learning_rate,
        perturbation=parameters.perturbation,
        samples=parameters.movements, per_cycle=parameters.per_cycle, seed=task.seed,
    )  # fmt: skip
    plain = replace(ours, network="plain")
    families = {
        name: learn_family(open_for(parameters.robot, config), parameters.seeds, task.part(*share))
        for name, config, share in (("refined", ours, (0.0, 0.35)), ("plain", plain, (0.35, 0.7)))
    }
    family = families["refined"]
    fixed, seen_points, seen = errors_point_by_point(family, family.best)
    rows = [row for name, learned in families.items() for row in rows_of(name, learned, document)]
    rows += [
        Row("fixed points below 40 mm, their mean", _below(fixed, 40.0), document.fixed_below_40, "mm"),
        Row("seen points below 30 mm, their mean", _below(seen, 30.0), document.seen_below_30, "mm"),
        Row("workspace visited", float(family.coverage[:, -1].mean()), None, "%"),
        Row("movements a line", float(family.samples[-1] / family.lines[:, -1].mean()), document.movements_a_line),
    ]
    for robot, share in ((parameters.robot, 0.7), (parameters.wide, 0.85)):
        if not task.stopped():
            task.tell(share, f"{robot} is trained through its kinematics")
            least = capacity(open_for(robot, ours), starts=parameters.starts, steps=parameters.steps, seed=task.seed)
            rows.append(Row(f"{robot}: least error that this network can have", least, None, "mm"))
    draw(family, fixed, seen_points, seen, document, task.folder)
    fixed_best, seen_best = family.best_cycle()
    verdict = (
        f"in the best testing cycle {fixed_best:.1f} mm on the fixed and {seen_best:.1f} mm on the seen test set, mean "
        f"of {parameters.seeds} runs (asked: {parameters.fixed_mm:g} and {parameters.seen_mm:g})"
    )
    holds = fixed_best <= parameters.fixed_mm and seen_best <= parameters.seen_mm
    figures = {name: learned.course() for name, learned in families.items()}
    return Outcome(tuple(rows), verdict, holds, parameters, figures)


def rows_of(name: str, family: Family, document: Printed) -> list[Row]:
    """Errors on both test sets, in the best cycle and where they settle."""
    (fixed_best, seen_best), (fixed, seen) = family.best_cycle(), family.settled()
    return [
        Row(f"{name} perceptron, fixed test set, best cycle", fixed_best, document.fixed, "mm"),
        Row(f"{name} perceptron, seen test set, that cycle", seen_best, document.seen, "mm"),
        Row(f"{name} perceptron, fixed test set, last fifth", fixed, None, "mm"),
        Row(f"{name} perceptron, seen test set, last fifth", seen, None, "mm"),
    ]


def draw(
    family: Family, fixed: np.ndarray, seen_points: np.ndarray, seen: np.ndarray, document: Printed, folder: Path
) -> None:
    """Figures 4.6, 4.7, 4.8 with C.1, and C.2."""
    from toddle.outside import document_pictures, pictures

    cycles = np.arange(1, len(family.samples) + 1)
    document_pictures.courses(
        folder / "figure-4-6.png",
        {"fixed test set": (cycles, family.fixed[0]), "seen test set": (cycles, family.seen[0])},
        {"document's best cycle, fixed": document.fixed, "document's best cycle, seen": document.seen},
        x_label="testing cycle", y_label="mean error [mm]", title="figure 4.6: error over testing cycles, one run",
    )  # fmt: skip
    explored = visited(family, family.best)
    pictures.explored_space(folder / "figure-4-7.png", explored, np.zeros(3), title="figure 4.7: area explored")
    pictures.targets_by_error(
        folder / "figure-4-8-fixed.png", family.session.targets, fixed / 1000, title="figures 4.8, C.1: fixed test set"
    )
    pictures.targets_by_error(
        folder / "figure-4-8-seen.png", seen_points, seen / 1000, title="figures 4.8, C.2: seen test set"
    )


def _below(errors: np.ndarray, limit: float) -> float:
    return float(errors[errors < limit].mean()) if np.any(errors < limit) else float("nan")


EXPERIMENT = Experiment("mahboob-nicu", "Mahboob 2015, figures 4.6, 4.7, 4.8, C.1, C.2", run)
