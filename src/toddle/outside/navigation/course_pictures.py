"""Courses from above: the paths that the robot took, after Huber 2019, figure 4.32."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.lines import Line2D
from matplotlib.patches import Circle as Disc
from matplotlib.patches import Polygon

from toddle.navigate.task import Outcome
from toddle.outside.navigation.course import PACE, Course, Finish
from toddle.outside.pictures import FAINT, INK, OURS, THEIRS, new_figure, plain_axes, save_figure
from toddle.outside.walk_pictures import LEFT_INK, RIGHT_INK, sole_corners
from toddle.robots.gait import Gait
from toddle.signals import Circle

GOAL_INK = "#c9a227"
_INKS = {
    Outcome.WON: OURS,
    Outcome.COLLIDED: THEIRS,
    Outcome.FELL: "#111111",
    Outcome.LATE: "#8a5fb0",
    Outcome.LOST: "#b08a5f",
}
_ARROW = 0.16  # [m]
_BETWEEN = 0.25  # arrows stand so far apart along the path [m] ...
_TURNED = 0.5  # ... or where the robot has turned so much [rad]
_ROOM = 0.3  # around what is shown [m]


def cases(
    path: Path,
    courses: Sequence[Course],
    finishes: Sequence[Finish],
    *,
    title: str,
    near: float = 0.2,
    gait: Gait | None = None,
) -> None:
    """Some courses beside each other: path, heading, goal, circles, where people walked; the soles, if wanted.

    Args:
        path: the PNG to write.
        courses: two columns are filled; four make a good figure.
        finishes: how each ended.
        title: says robot and driver.
        near: so near the goal is reached [m].
        gait: of the robot, to draw its soles; None: they are left out.
    """
    columns = min(2, len(courses))
    rows = math.ceil(len(courses) / columns)
    figure = new_figure(4.6 * columns, 4.3 * rows + 0.6)
    grid = figure.add_gridspec(rows, columns)
    for number, (course, finish) in enumerate(zip(courses, finishes, strict=True)):
        axes = plain_axes(figure, grid[number // columns, number % columns])
        _scene(axes, course, finish, near)
        if gait is not None:
            _soles(axes, finish, gait)
        axes.plot(*finish.path[:, 1:3].T, color=OURS, lw=1.5, zorder=5)
        _arrows(axes, finish.path)
        ended = f"{finish.outcome.name.lower()} after {finish.seconds:.1f} s"
        axes.set_title(f"({chr(ord('a') + number)}) {ended}, {finish.length:.2f} m", fontsize=10)
        _square(axes, _shown(course, finish))
        axes.locator_params(nbins=6)
    figure.suptitle(title)
    save_figure(figure, path)


def all_paths(path: Path, courses: Sequence[Course], finishes: Sequence[Finish], *, title: str) -> None:
    """Every path in one picture, coloured by how it ended; circles too, faintly, where there are any."""
    figure = new_figure(7.4, 7.4)
    axes = plain_axes(figure)
    counts = dict.fromkeys(_INKS, 0)
    for course, finish in zip(courses, finishes, strict=True):
        won = finish.outcome == Outcome.WON
        counts[finish.outcome] += 1
        ink = _INKS[finish.outcome]
        for circle in course.circles:
            axes.add_patch(Disc((circle.x, circle.y), circle.radius, facecolor=FAINT, alpha=0.06, zorder=1))
        axes.plot(*finish.path[:, 1:3].T, color=ink, lw=0.8 if won else 1.5, alpha=0.55 if won else 1.0, zorder=3)
        axes.scatter(*course.goal, s=14, color=ink, marker="o" if won else "X", zorder=4 if won else 6, linewidths=0)
    axes.scatter(0.0, 0.0, s=45, color=INK, marker="P", zorder=7)
    shown = [
        Line2D([], [], color=_INKS[outcome], lw=2, label=f"{outcome.name.lower()}: {count}")
        for outcome, count in counts.items()
        if count
    ]
    axes.legend(handles=shown, frameon=False, loc="upper left")
    axes.set_title(title)
    _square(axes, np.vstack([_shown(*pair) for pair in zip(courses, finishes, strict=True)]))
    save_figure(figure, path)


def _scene(axes: Any, course: Course, finish: Finish, near: float) -> None:
    for circle in course.circles:
        _disc(axes, circle, THEIRS, 0.55)
    if course.people is not None:
        until = max(round(finish.seconds / PACE) + 1, 2)
        for number, person in enumerate(course.walking(finish.seconds)):
            axes.plot(*course.people[:until, number].T, color=THEIRS, lw=1.0, ls=":", zorder=2)
            _disc(axes, person, THEIRS, 0.3)
    axes.add_patch(Disc(course.goal, near, facecolor=GOAL_INK, alpha=0.25, edgecolor="none", zorder=2))
    axes.scatter(*course.goal, s=50, color=GOAL_INK, marker="*", zorder=6)
    axes.scatter(0.0, 0.0, s=35, color=INK, marker="P", zorder=6)


def _disc(axes: Any, circle: Circle, ink: str, alpha: float) -> None:
    axes.add_patch(Disc((circle.x, circle.y), circle.radius, facecolor=ink, alpha=alpha, edgecolor="none", zorder=2))


def _soles(axes: Any, finish: Finish, gait: Gait) -> None:
    for foot in finish.feet:
        ink = (LEFT_INK, RIGHT_INK)[foot.side]
        axes.add_patch(Polygon(sole_corners(foot, gait), closed=True, fill=False, edgecolor=ink, lw=0.6, zorder=3))


def _arrows(axes: Any, path: Float[np.ndarray, "looks 4"]) -> None:
    """Where the robot faces: at the start, then each time that it has gone or turned far enough, and at the end."""
    chosen = [0]
    for number in range(1, len(path)):
        _, dx, dy, turned = path[number] - path[chosen[-1]]
        if math.hypot(dx, dy) > _BETWEEN or abs(math.remainder(turned, 2 * math.pi)) > _TURNED:
            chosen.append(number)
    for _, x, y, yaw in path[sorted({*chosen, len(path) - 1})]:
        along = (_ARROW * math.cos(yaw), _ARROW * math.sin(yaw))
        axes.arrow(x, y, *along, color=INK, lw=0.7, head_width=0.045, length_includes_head=True, zorder=7)


def _shown(course: Course, finish: Finish) -> Float[np.ndarray, "points 2"]:
    """What must be in the picture."""
    discs = [(c.x + a * c.radius, c.y + a * c.radius) for c in course.circles for a in (-1, 1)]
    return np.vstack([finish.path[:, 1:3], [course.goal], [(0.0, 0.0)], *([discs] if discs else [])])


def _square(axes: Any, points: Float[np.ndarray, "points 2"]) -> None:
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = (low + high) / 2, float((high - low).max()) / 2 + _ROOM
    axes.set(
        xlim=(middle[0] - half, middle[0] + half),
        ylim=(middle[1] - half, middle[1] + half),
        xlabel="x [m]",
        ylabel="y [m]",
    )
    axes.set_aspect("equal")
