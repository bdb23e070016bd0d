"""Drives through rooms from above: a panel for each scenario, every path coloured by how it ended."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.lines import Line2D

from toddle.navigate.scenarios.rooms import SCENARIOS
from toddle.navigate.task import Outcome
from toddle.outside.navigation.room_run import RoomFinish
from toddle.outside.pictures import FAINT, INK, OURS, THEIRS, new_figure, plain_axes, save_figure

_INKS = {
    Outcome.WON: OURS,
    Outcome.COLLIDED: THEIRS,
    Outcome.FELL: "#111111",
    Outcome.LATE: "#8a5fb0",
}


def room_paths(
    path: Path, finishes: Sequence[RoomFinish], targets: Sequence[tuple[float, float]], *, title: str
) -> None:
    """Draw the paths of many drives; each begins at the cross.

    Args:
        path: the PNG to write.
        finishes: how each ended.
        targets: where each target stood, x, y [m].
        title: says robot and driver.
    """
    named = {name: [i for i, one in enumerate(finishes) if one.room.scenario == name] for name in SCENARIOS}
    shown = {name: numbers for name, numbers in named.items() if numbers}
    columns = min(3, len(shown))
    rows = math.ceil(len(shown) / columns)
    figure = new_figure(4.2 * columns, 4.2 * rows + 0.5)
    grid = figure.add_gridspec(rows, columns)
    for place, (name, numbers) in enumerate(shown.items()):
        axes = plain_axes(figure, grid[place // columns, place % columns])
        for number in sorted(numbers, key=lambda i: finishes[i].outcome != Outcome.WON):
            _path(axes, finishes[number].path, finishes[number].outcome, targets[number])
        axes.scatter(0.0, 0.0, s=45, color=INK, marker="P", zorder=7)
        won = sum(finishes[i].outcome == Outcome.WON for i in numbers)
        axes.set_title(f"{name}: {won} of {len(numbers)}", fontsize=10)
        axes.set(xlabel="x [m]", ylabel="y [m]")
        axes.set_aspect("equal", adjustable="datalim")
    ended = [outcome for outcome in _INKS if any(one.outcome == outcome for one in finishes)]
    lines = [Line2D([], [], color=_INKS[outcome], lw=2, label=outcome.name.lower()) for outcome in ended]
    figure.legend(handles=lines, frameon=False, loc="outside lower center", ncols=len(lines))
    figure.suptitle(title)
    save_figure(figure, path)


def _path(axes: Any, path: Float[np.ndarray, "looks 4"], outcome: Outcome, target: tuple[float, float]) -> None:
    won, ink = outcome == Outcome.WON, _INKS.get(outcome, FAINT)
    axes.plot(*path[:, 1:3].T, color=ink, lw=0.8 if won else 1.5, alpha=0.55 if won else 1.0, zorder=3 if won else 5)
    axes.scatter(*target, s=14, color=ink, marker="o" if won else "X", zorder=6, linewidths=0)
