"""The walking pattern by itself (Huber 2019, section 4.1.1: figures 4.1, 4.2 and 4.3, and the time of an iteration).

HRP-2's parameters, the document's own problem. The text prints neither the commands of the four walks nor their
lengths: straight and turned ones are those of the author's files, the diagonal one and the one beside the obstacle are
taken alike. With the folder of the author's trajectories (``--data``) these are set beside ours, which are the exact
optimum of the same problem; the author's are not.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.failures import BadInput
from toddle.robots.catalogue import HUMANOIDS
from toddle.robots.gait import Gait
from toddle.signals import Circle, Velocity
from toddle.walk.pattern.document import Document
from toddle.walk.pattern.plan import Pattern, Status
from toddle.walk.pattern.reduced import Reduced
from toddle.walk.pattern.trajectory import Trajectory, walk_pattern


@dataclass(frozen=True)
class Case:
    """One walk: its panel, the command, the obstacles, iterations."""

    panel: str
    velocity: Velocity
    circles: tuple[Circle, ...] = ()
    iterations: int = 100


@dataclass(frozen=True)
class Parameters:
    """Of the experiment.

    Attributes:
        robot: whose gait.
        runs: of the straight walk, for the time.
        continuous_mm: a sole jumps no farther between two rows than its speed says, to within this [mm].
    """

    robot: str = "hrp2"
    runs: int = 10
    continuous_mm: float = 1.0


FULL = Parameters()
QUICK = replace(FULL, runs=3)
CASES = {
    "straight": Case("4-1-a", Velocity(0.1, 0.0, 0.0)),
    "diagonal": Case("4-1-b", Velocity(0.1, 0.1, 0.0)),
    "turn": Case("4-2-a", Velocity(0.1, 0.0, 0.1)),
    "obstacle": Case("4-2-b", Velocity(0.1, 0.0, 0.0), (Circle(1.6, 1.0, 1.0),), 500),
}


@dataclass(frozen=True)
class Printed:
    """What the document prints: an iteration in C++ and in Python [ms], the obstacle's margin [m]."""

    cpp_ms: float = 1.477
    cpp_std_ms: float = 0.005
    python_ms: float = 8.73
    margin: float = 0.4


def run(task: Task) -> Outcome:
    """The four walks, their pictures, and the time of an iteration."""
    parameters, document = FULL if task.full else QUICK, Printed()
    parameters = replace(parameters, runs=task.seeds or parameters.runs)
    gait = _gait(parameters.robot)
    walks: dict[str, Trajectory] = {}
    for number, (name, case) in enumerate(CASES.items()):
        task.tell(0.2 * number, name)
        command = partial(_constant, case.velocity)
        walks[name] = walk_pattern(Document(gait), gait, command, case.iterations, case.circles)
        draw(name, case, walks[name], gait, task.folder)
    jump = 1000 * max(_jump(walk.feet, gait.command_period) for walk in walks.values())
    timed = {"the document's form": timing(Document(gait), gait, parameters.runs)}
    task.tell(0.9, "the reduced form")
    timed["our reduced form"] = timing(Reduced(gait), gait, parameters.runs)
    compared = {} if task.data is None else beside_the_author(walks, task.data, task.folder)
    rows = [*_timing_rows(timed, document), *_walk_rows(walks, gait, document)]
    rows.append(Row("farthest jump of a sole between two rows", jump, None, "mm"))
    for name, (apart, rise, author_rise) in compared.items():
        rows.append(Row(f"{name}: author's centre of mass off the optimum", apart, None, "mm"))
        rows.append(Row(f"{name}: a sole rises in 5 ms, beside the author's file", rise, author_rise, "mm"))
    ms = float(timed["the document's form"].mean())
    solved = all(i.status == Status.SOLVED for walk in walks.values() for i in walk.intervals)
    verdict = (
        f"an iteration of the document's form takes {ms:.2f} ms (document, C++: {document.cpp_ms:.2f}), the soles move "
        f"without a jump ({jump:.2f} mm), {'every' if solved else 'NOT every'} iteration is solved"
    )
    figures = {"milliseconds": {name: values.tolist() for name, values in timed.items()}, "author_mm": compared}
    holds = ms < document.cpp_ms and jump < parameters.continuous_mm and solved
    return Outcome(tuple(rows), verdict, holds, parameters, figures)


def timing(pattern: Pattern[Any], gait: Gait, runs: int) -> Float[np.ndarray, " runs"]:
    """Of an iteration, mean over the 100 of the straight walk, each run [ms]; compiled before."""
    velocity = CASES["straight"].velocity
    state = pattern.start()
    for _ in range(20):
        state, _ = pattern.step(state, velocity, ())
    means = np.empty(runs)
    for number in range(runs):
        state, began = pattern.start(), time.perf_counter()
        for _ in range(100):
            state, _ = pattern.step(state, velocity, ())
        means[number] = 10 * (time.perf_counter() - began)
    return means


def draw(name: str, case: Case, walk: Trajectory, gait: Gait, folder: Path) -> None:
    """Its panel of figure 4.1 or 4.2 from above, and of the turn the soles over time (figure 4.3)."""
    from toddle.outside.walk_pictures import feet_over_time, footprints
    from toddle.outside.walk_record import record_of_pattern

    record = record_of_pattern(walk, gait, [case.velocity] * case.iterations)
    command = ", ".join(f"{part:g}" for part in case.velocity)
    number = case.panel.replace("-", ".", 1).replace("-", " ")
    footprints(folder / f"figure-{case.panel}.png", record, gait, case.circles, title=f"figure {number}: ({command})")
    if name == "turn":
        feet_over_time(folder / "figure-4-3.png", record, title="figure 4.3: soles of the turn")


def beside_the_author(walks: Mapping[str, Trajectory], data: Path, folder: Path) -> dict[str, tuple[float, ...]]:
    """Ours and the author's trajectories, and a picture of both.

    Returns:
        Of the straight and the turned walk: how far the author's centre of mass lies from ours at most, and how far a
        sole rises between two rows, ours and the author's [mm].

    Raises:
        BadInput: a file isn't there, or isn't one of the author's.
    """
    from toddle.outside.document_pictures import paths_beside

    compared: dict[str, tuple[float, ...]] = {}
    for name in ("straight", "turn"):
        com, height = _author(data / f"cpp_nmpc_{name}.csv")
        ours = walks[name].com[:, 0, :2]
        rows = min(len(ours), len(com))
        apart = np.hypot(*(com[:rows] - ours[:rows]).T).max()
        rises = (float(1000 * np.diff(z, axis=0).max()) for z in (walks[name].feet[:, 0, :, 2], height))
        compared[name] = (float(1000 * apart), *rises)
        lines = {"exact optimum (ours)": ours[:rows], "the author's file": com[:rows]}
        paths_beside(folder / f"author-{name}.png", lines, title=f"{name}: centre of mass, exact and the author's")
    return compared


def _author(path: Path) -> tuple[Float[np.ndarray, "rows 2"], Float[np.ndarray, "rows 2"]]:
    """x and y of the centre of mass, and the soles' heights, in a trajectory of the author's C++ program [m]."""
    remedy = "give the folder of the author's cpp_nmpc_straight.csv and cpp_nmpc_turn.csv"
    try:
        lines = path.read_text().splitlines()
        rows = np.array([[float(word) for word in line.split(",")] for line in lines if line.strip()], dtype=float)
    except (OSError, ValueError) as fault:
        raise BadInput(f"it can't be read: {str(fault)[:80]}", where=str(path), remedy=remedy) from None
    if rows.ndim != 2 or len(rows) < 2 or rows.shape[1] < 21 or not np.isfinite(rows[:, [0, 3, 15, 19]]).all():
        raise BadInput("it is no trajectory of 21 columns", where=str(path), remedy=remedy)
    return rows[:, [0, 3]], rows[:, [15, 19]]


def _constant(velocity: Velocity, _: float) -> Velocity:
    return velocity


def _gait(robot: str) -> Gait:
    gait = HUMANOIDS[robot].document_gait
    if gait is None:
        raise BadInput("the document has no gait of it", where=robot, remedy="take hrp2")
    return gait


def _jump(feet: Float[np.ndarray, "rows 3 2 4"], dt: float) -> float:
    """How much farther a sole moves between two rows than the faster of its speeds there takes it [m]."""
    moved = np.abs(np.diff(feet[:, 0, :, :3], axis=0))
    speed = np.abs(feet[:, 1, :, :3])
    return float((moved - dt * np.maximum(speed[:-1], speed[1:])).max())


def _timing_rows(timed: Mapping[str, Float[np.ndarray, " runs"]], document: Printed) -> list[Row]:
    rows: list[Row] = []
    for name, values in timed.items():
        rows.append(Row(f"iteration, {name}, beside the document's C++", float(values.mean()), document.cpp_ms, "ms"))
        rows.append(Row("deviation over the runs", float(values.std()), document.cpp_std_ms, "ms"))
    rows.append(Row("iteration, the document's form, beside its Python", rows[0].ours, document.python_ms, "ms"))
    return rows


def _walk_rows(walks: Mapping[str, Trajectory], gait: Gait, document: Printed) -> list[Row]:
    rows = [
        Row(f"{name}: {axis} of the centre of mass at the end", float(walk.com[-1, 0, column]), None, unit)
        for name, walk in walks.items()
        for column, axis, unit in ((0, "x", "m"), (1, "y", "m"))
    ]
    rows.append(Row("turn: heading at the end", float(walks["turn"].com[-1, 0, 3]), None, "rad"))
    circle = CASES["obstacle"].circles[0]
    landed = np.array([(i.support.x, i.support.y) for i in walks["obstacle"].intervals])
    nearest = float(np.hypot(landed[:, 0] - circle.x, landed[:, 1] - circle.y).min()) - circle.radius
    rows.append(Row("obstacle: nearest sole's middle to its edge", nearest, document.margin, "m"))
    return rows


EXPERIMENT = Experiment("huber-patterns", "Huber 2019, figures 4.1-4.3 and section 4.1.1", run)
