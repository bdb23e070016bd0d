"""An episode as a film strip: what was seen, how far away it was, what was asked for, and where the robot went."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from toddle.navigate.cloning.recording import Recording
from toddle.outside.files import make_folder

_LOOKS = 10
_FARTHEST = 5.0  # of the depth's colours [m]
_UNKNOWN = "black"
_ASKED, _TAUGHT = "#0072b2", "#d55e00"


def film_strip(path: Path, recording: Recording, title: str) -> None:
    """Draw an episode into a PNG.

    Args:
        path: of the picture; its folder is made if need be.
        recording: the episode.
        title: above it; room, driver and outcome are added.
    """
    make_folder(path.parent)
    looks = np.unique(np.linspace(0, len(recording.t) - 1, _LOOKS).round().astype(int))
    figure = Figure(figsize=(1.6 * _LOOKS, 6.4), layout="constrained")
    grid = figure.add_gridspec(3, _LOOKS, height_ratios=[1, 1, 2.4])
    _frames(figure, grid, recording, looks)
    _commands(figure.add_subplot(grid[2, : _LOOKS - 4]), recording, looks)
    _map(figure.add_subplot(grid[2, _LOOKS - 4 :]), recording, looks)
    room = recording.room
    figure.suptitle(
        f"{title}: {room.scenario} {room.number} of {room.split}, {recording.driver}, {recording.outcome.name.lower()} "
        f"after {recording.t[-1]:.1f} s"
    )
    figure.savefig(path, dpi=80)


def _frames(figure: Figure, grid: Any, recording: Recording, looks: Any) -> None:
    colours = matplotlib.colormaps["viridis_r"].with_extremes(bad=_UNKNOWN)
    drawn, row = None, []
    for place, look in enumerate(looks.tolist()):
        above, below = figure.add_subplot(grid[0, place]), figure.add_subplot(grid[1, place])
        above.imshow(recording.picture[look])
        depth = recording.depth[look]
        drawn = below.imshow(np.ma.masked_equal(depth, 0), cmap=colours, vmin=0, vmax=_FARTHEST)
        above.set_title(f"{recording.t[look]:.1f} s", fontsize=9)
        for axes in (above, below):
            axes.set_axis_off()
        row.append(below)
    if drawn is not None:
        figure.colorbar(drawn, ax=row, label="depth [m]", shrink=0.9, pad=0.01)


def _commands(axes: Any, recording: Recording, looks: Any) -> None:
    for column, (name, line) in {0: ("ahead [m/s]", "-"), 2: ("turning left [rad/s]", "--")}.items():
        axes.step(recording.t, recording.taught[:, column], line, where="post", color=_TAUGHT, label=f"taught, {name}")
        axes.step(recording.t, recording.asked[:, column], line, where="post", color=_ASKED, label=f"asked, {name}")
    axes.plot(recording.t[looks], np.full(len(looks), axes.get_ylim()[0]), "k^", markersize=4, clip_on=False)
    axes.set_xlabel("time [s]")
    axes.legend(fontsize=8, ncols=2)
    axes.grid(alpha=0.3)


def _map(axes: Any, recording: Recording, looks: Any) -> None:
    """From above, as the room was drawn; people where they were last, and their ways."""
    first, last = recording.circles[0], recording.circles[-1]
    for number, (x, y, radius) in enumerate(last.tolist()):
        if radius > 0:
            axes.add_patch(Circle((x, y), radius, color="crimson" if number == 0 else "0.6"))
        if (first[number, :2] != last[number, :2]).any():
            axes.plot(*recording.circles[:, number, :2].T, ":", color="0.3")
    x, y, yaw = recording.place.T
    axes.plot(x, y, color=_ASKED)
    axes.quiver(x[looks], y[looks], np.cos(yaw[looks]), np.sin(yaw[looks]), color=_ASKED, scale=25, width=0.006)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.grid(alpha=0.3)
