"""Single-layer against multi-layer perceptron on the arm of NICU (Mahboob 2015, 4.4.3, 4.4.4; figures 4.9-4.12).

The document's findings: the single-layer perceptron comes down to 6 cm at once (by its 20th test, 4,000 lines) and
stays there; the multi-layer one goes on until about its 300th test (60,000 lines) and ends lower; and it makes more
movements in a line.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.experiments.families import Family, learn_family, open_for, visited
from toddle.reach.config import ReachConfig

LINES_A_TEST = 200  # of the document


METHOD = "goal-and-motor-babbling"


@dataclass(frozen=True)
class Parameters:
    """Of the experiment.

    Attributes:
        robot: the arm.
        hidden: of the multi-layer perceptron.
        learning_rate, perturbation: of both.
        network: plain, as the document's, or refined.
        movements: that each run learns from.
        per_cycle: movements between two tests.
        seeds: runs of each kind.
    """

    robot: str = "nicu"
    hidden: tuple[int, ...] = (10,)
    learning_rate: float = 0.717
    perturbation: float = 0.233
    network: Literal["plain", "refined"] = "plain"
    movements: int = 300_000
    per_cycle: int = 600
    seeds: int = 5


FULL = Parameters()
QUICK = replace(FULL, movements=150_000, seeds=2)


@dataclass(frozen=True)
class Printed:
    """What the document says."""

    slp: float = 60.0  # [mm], section 4.4.3
    mlp: float = 24.745  # [mm], best cycle, figure 4.8
    slp_lines: float = 4_000.0  # until it settles, section 4.4.4
    mlp_lines: float = 60_000.0
    mlp_movements_a_line: float = 3.3  # 200,000 iterations (section 4.5) in 60,000 lines


def run(task: Task) -> Outcome:
    """Both families, where and when they settle, and the pictures of figures 4.9 to 4.12."""
    parameters = FULL if task.full else QUICK
    parameters, document = replace(parameters, seeds=task.seeds or parameters.seeds), Printed()
    config = ReachConfig(
        method=METHOD, hidden=parameters.hidden, learning_rate=parameters.learning_rate,
        perturbation=parameters.perturbation,
        samples=parameters.movements, per_cycle=parameters.per_cycle, seed=task.seed, network=parameters.network,
    )  # fmt: skip
    mlp = learn_family(open_for(parameters.robot, config), parameters.seeds, task.part(0.0, 0.6))
    slp = learn_family(open_for(parameters.robot, replace(config, hidden=())), parameters.seeds, task.part(0.6, 1.0))
    draw(slp, mlp, task.folder)
    slp_mm, mlp_mm = slp.settled()[0], mlp.settled()[0]
    slp_lines, mlp_lines = (float(family.lines.mean(axis=0)[family.settles_at()]) for family in (slp, mlp))
    slp_length, mlp_length = (float(f.samples[-1] / f.lines[:, -1].mean()) for f in (slp, mlp))
    rows = (
        Row("SLP: fixed test set, where it settles", slp_mm, document.slp, "mm"),
        Row("MLP: fixed test set, where it settles", mlp_mm, None, "mm"),
        Row("MLP: fixed test set, best cycle", mlp.best_cycle()[0], document.mlp, "mm"),
        Row("SLP: lines until it settles", slp_lines, document.slp_lines),
        Row("MLP: lines until it settles", mlp_lines, document.mlp_lines),
        Row("SLP: movements until it settles", float(slp.samples[slp.settles_at()])),
        Row("MLP: movements until it settles", float(mlp.samples[mlp.settles_at()])),
        Row("SLP: movements a line", slp_length),
        Row("MLP: movements a line", mlp_length, document.mlp_movements_a_line),
        Row("SLP: workspace visited", float(slp.coverage[:, -1].mean()), None, "%"),
        Row("MLP: workspace visited", float(mlp.coverage[:, -1].mean()), None, "%"),
    )
    claims = {
        "the MLP ends lower": mlp_mm < slp_mm,
        "the SLP settles in fewer lines": slp_lines < mlp_lines,
        "the MLP makes more movements a line": mlp_length > slp_length,
    }
    verdict = "; ".join(f"{claim}: {'yes' if held else 'no'}" for claim, held in claims.items())
    figures = {"slp": slp.course(), "mlp": mlp.course(), "claims": claims}
    return Outcome(rows, verdict, all(claims.values()), parameters, figures)


def draw(slp: Family, mlp: Family, folder: Path) -> None:
    """Figures 4.9 (SLP over tests), 4.10 (area explored by it), 4.11 (both over lines) and 4.12 (over movements)."""
    from toddle.outside import document_pictures, pictures

    tests = slp.lines[0] / LINES_A_TEST
    document_pictures.courses(
        folder / "figure-4-9.png",
        {"fixed test set": (tests, slp.fixed[0]), "seen test set": (tests, slp.seen[0])},
        {},
        x_label="tests, one for each 200 lines", y_label="mean error [mm]", title="figure 4.9: single-layer perceptron",
    )  # fmt: skip
    explored = visited(slp, slp.best)
    pictures.explored_space(folder / "figure-4-10.png", explored, np.zeros(3), title="figure 4.10: explored by the SLP")
    for name, label, over in (
        ("4-11", "tests, one for each 200 lines", lambda family: family.lines.mean(axis=0) / LINES_A_TEST),
        ("4-12", "movements", lambda family: family.samples),
    ):
        document_pictures.courses(
            folder / f"figure-{name}.png",
            {"MLP": (over(mlp), mlp.fixed.mean(axis=0)), "SLP": (over(slp), slp.fixed.mean(axis=0))},
            {},
            x_label=label, y_label="mean error, fixed test set [mm]", title=f"figure {name.replace('-', '.')}",
        )  # fmt: skip


EXPERIMENT = Experiment("mahboob-slp-mlp", "Mahboob 2015, figures 4.9-4.12", run)
