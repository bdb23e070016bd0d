"""The push map as a picture: one rose for standing and for each speed, a line for each phase of the step."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from benchmarks.walking.pushes import DIRECTIONS, GRID, PHASES, SPEEDS

_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")
_LINES = ("-", "--", "-.", ":")


def draw_push_map(content: dict[str, Any], path: Path) -> None:
    """Draw what a file of the part ``pushes`` holds; cells that weren't run are left out."""
    largest: dict[tuple[float, float | None, int], float] = {
        (case["speed"], case["phase"], case["direction"]): case["row"]["largest"] for case in content["cases"]
    }
    figure = Figure(figsize=(11.5, 4.9))
    standing, *walking = np.ravel(figure.subplots(1, 1 + len(SPEEDS), subplot_kw={"projection": "polar"}))
    _rose(standing, "standing", [(0.0, None)], largest)
    for axis, speed in zip(walking, SPEEDS, strict=True):
        _rose(axis, f"walking, {speed:g} m/s", [(speed, phase) for phase in PHASES], largest)
    handles = [
        Line2D([], [], color=colour, linestyle=line, linewidth=2, label=f"{phase:g} of the step")
        for phase, colour, line in zip(PHASES, _COLOURS, _LINES, strict=True)
    ]
    figure.legend(handles=handles, loc="lower center", ncols=len(PHASES), frameon=False)
    figure.suptitle("Largest push survived [N s], by its direction; the left foot carries")
    figure.tight_layout(rect=(0, 0.08, 1, 1))
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120)


def _rose(axis: Any, title: str, stances: list[tuple[float, float | None]], largest: dict) -> None:
    turn = np.deg2rad([*DIRECTIONS, DIRECTIONS[0]])
    axis.set_theta_zero_location("N")
    axis.set_thetagrids(DIRECTIONS, ["ahead", "", "left", "", "back", "", "right", ""])
    axis.set_rlim(0, GRID[-1] + 0.5)
    axis.set_rgrids(GRID[1::2], fontsize=8, angle=22.5)
    axis.fill(np.linspace(0, 2 * np.pi, 90), np.full(90, 6.0), color="0.93", zorder=0)
    axis.set_title(title)
    for (speed, phase), colour, line in zip(stances, _COLOURS, _LINES, strict=False):
        values = np.array([largest.get((speed, phase, direction), np.nan) for direction in DIRECTIONS])
        style = {"color": "0.2" if phase is None else colour, "linewidth": 2, "marker": "o", "markersize": 4}
        axis.plot(turn, [*values, values[0]], line, **style)
