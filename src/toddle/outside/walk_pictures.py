"""Pictures of a walk: footprints from above, feet over time, error of the zero moment point, velocities.

After Huber 2019, figures 4.1-4.7 and 4.24.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure
from matplotlib.patches import Circle as Disc
from matplotlib.patches import Polygon

from toddle.outside.pictures import FAINT, INK, OURS, THEIRS, new_figure, plain_axes, save_figure
from toddle.outside.walk_figures import zmp_distance
from toddle.outside.walk_record import Record, standing
from toddle.robots.gait import Gait
from toddle.signals import Circle, Footstep

LEFT_INK, RIGHT_INK = "#2a7f62", "#8a5fb0"
_SMALL_YAW = 0.05  # not to be magnified [rad]
_POINTS = 4000  # a line has no more


class Stand(NamedTuple):
    """A foot on the floor from tick to tick."""

    step: Footstep
    first: int
    last: int


def stands(record: Record) -> list[Stand]:
    """Each foot's times on the floor, by the plan, in the order of their beginning."""
    found: list[Stand] = []
    down = standing(record.feet, record.feet_velocity)
    for side in (0, 1):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], down[:, side].astype(int), [0]])))
        for first, end in edges.reshape(-1, 2).tolist():
            x, y, _, yaw = record.feet[end - 1, side].tolist()
            found.append(Stand(Footstep(side, x, y, yaw), first, end - 1))
    return sorted(found, key=lambda stand: stand.first)


def sole_corners(step: Footstep, gait: Gait) -> Float[np.ndarray, "4 2"]:
    """Of a sole on the floor [m]."""
    x = gait.foot_ahead + gait.foot_length / 2 * np.array([1.0, 1.0, -1.0, -1.0])
    y = gait.foot_width / 2 * np.array([1.0, -1.0, -1.0, 1.0])
    cos, sin = np.cos(step.yaw), np.sin(step.yaw)
    return np.column_stack([step.x + cos * x - sin * y, step.y + sin * x + cos * y])


def hull(points: Float[np.ndarray, "points 2"]) -> Float[np.ndarray, "corners 2"]:
    """The convex hull of points in the plane, anticlockwise (Andrew's monotone chain)."""
    ordered = points[np.lexsort((points[:, 1], points[:, 0]))]
    return np.array([*_chain(ordered)[:-1], *_chain(ordered[::-1])[:-1]])


def _chain(ordered: Float[np.ndarray, "points 2"]) -> list[Float[np.ndarray, "2"]]:
    chain: list[Float[np.ndarray, "2"]] = []
    for point in ordered:
        while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= 0:
            chain.pop()
        chain.append(point)
    return chain


def _turn(a: Float[np.ndarray, "2"], b: Float[np.ndarray, "2"], c: Float[np.ndarray, "2"]) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def footprints(path: Path, record: Record, gait: Gait, circles: Sequence[Circle], *, title: str) -> None:
    """Soles, polygons of support, centre of mass and zero moment point from above [m] (figures 4.4-4.7)."""
    placed = stands(record)
    reach = np.concatenate([record.com[:, 0, :2], *(sole_corners(stand.step, gait) for stand in placed)])
    reach = np.concatenate([reach, *(_box(circle) for circle in circles)])
    span = np.maximum(np.ptp(reach, axis=0), 0.6)
    width = 11.0 if span[0] > 1.3 * span[1] else 7.0
    figure = new_figure(width, float(np.clip(width * span[1] / span[0] + 1.4, 3.2, 11.0)))
    axes = plain_axes(figure)
    for one, other in pairwise(placed):
        both = np.concatenate([sole_corners(one.step, gait), sole_corners(other.step, gait)])
        axes.add_patch(Polygon(hull(both), closed=True, facecolor=FAINT, alpha=0.13, edgecolor="none", zorder=1))
    for stand in placed:
        ink = (LEFT_INK, RIGHT_INK)[stand.step.side]
        corners = sole_corners(stand.step, gait)
        axes.add_patch(Polygon(corners, closed=True, facecolor=ink, alpha=0.16, edgecolor="none", zorder=2))
        axes.add_patch(Polygon(corners, closed=True, fill=False, edgecolor=ink, lw=0.9, zorder=3))
    for circle in circles:
        axes.add_patch(Disc((circle.x, circle.y), circle.radius, facecolor=THEIRS, alpha=0.55, zorder=2))
    if record.measured is not None:
        axes.plot(*_thin(record.measured.zmp).T, color=FAINT, lw=0.6, zorder=4, label="ZMP, sensors")
    axes.plot(*_thin(record.zmp).T, color=THEIRS, lw=0.9, zorder=5, label="ZMP, plan")
    if record.measured is not None:
        axes.plot(*_thin(record.measured.com[:, :2]).T, color=INK, lw=0.7, zorder=6, label="CoM, sensors")
    axes.plot(*_thin(record.com[:, 0, :2]).T, color=OURS, lw=1.3, zorder=7, label="CoM, plan")
    low, high = reach.min(axis=0) - 0.08, reach.max(axis=0) + 0.08
    axes.set(xlabel="x [m]", ylabel="y [m]", title=title, xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axes.set_aspect("equal")
    figure.legend(frameon=False, ncols=4, loc="outside lower center", fontsize=9)
    save_figure(figure, path)


def feet_over_time(path: Path, record: Record, *, title: str) -> None:
    """The interpolated soles over time: x, y, height and yaw (figures 4.2, 4.3)."""
    figure = new_figure(10.0, 7.0)
    rows = _over_time(figure, record, ("x [m]", "y [m]", "height [cm]", "yaw [rad]"), title)
    for column, axes in enumerate(rows):
        scale = 100 if column == 2 else 1
        for side, (label, ink) in enumerate((("left", LEFT_INK), ("right", RIGHT_INK))):
            if record.measured is not None:
                measured = _thin(scale * record.measured.feet[:, side, column])
                axes.plot(_thin(record.t), measured, color=ink, lw=0.6, alpha=0.45, label=f"{label}, sensors")
            axes.plot(_thin(record.t), _thin(scale * record.feet[:, side, column]), color=ink, lw=1.2, label=label)
        if column < 2:
            com = _thin(record.com[:, 0, column])
            axes.plot(_thin(record.t), com, color=OURS, lw=0.9, ls="--", label="centre of mass")
    low, high = rows[3].get_ylim()
    rows[3].set_ylim(min(low, -_SMALL_YAW), max(high, _SMALL_YAW))
    rows[0].legend(frameon=False, ncols=5, fontsize=8, loc="upper left")
    save_figure(figure, path)


def zmp_error(path: Path, record: Record, *, title: str) -> None:
    """How far the measured zero moment point lies from the planned one: histogram (section 4.1.2, figure 4.24)."""
    figure = new_figure()
    axes = plain_axes(figure)
    distance = 100 * zmp_distance(record)
    top = max(float(np.percentile(distance, 99.5)), 0.5) if len(distance) else 1.0
    axes.hist(np.minimum(distance, top), bins=60, range=(0, top), color=OURS, alpha=0.85)
    if len(distance):
        mean, std = distance.mean(), distance.std()
        axes.axvline(mean, color=THEIRS, lw=1.4, label=f"mean {mean:.2f} cm")
        axes.axvspan(max(mean - std, 0), mean + std, color=THEIRS, alpha=0.12, lw=0, label=f"± {std:.2f} cm")
        axes.legend(frameon=False)
    axes.set(xlabel="distance of planned and measured ZMP [cm]", ylabel="ticks of 10 ms", title=title, xlim=(0, top))
    save_figure(figure, path)


def velocity_tracking(path: Path, record: Record, *, title: str) -> None:
    """Command and achieved velocity over time."""
    figure = new_figure(10.0, 6.0)
    rows = _over_time(figure, record, ("ahead [m/s]", "to the left [m/s]", "turning left [rad/s]"), title)
    for column, axes in enumerate(rows):
        shown = [record.allowed[:, column]]
        if record.measured is not None:
            shown.append(record.measured.velocity[:, column])
            axes.plot(_thin(record.t), _thin(shown[1]), color=OURS, lw=1.1, label="measured, over two steps")
        axes.plot(_thin(record.t), _thin(shown[0]), color=THEIRS, lw=1.2, ls="--", label="command")
        low, high = (float(of(np.concatenate(shown))) for of in (np.nanmin, np.nanmax))
        room = max(0.2 * (high - low), 0.03)
        axes.set_ylim(low - room, high + room)
    rows[0].legend(frameon=False, ncols=2, fontsize=8, loc="lower right")
    save_figure(figure, path)


def _over_time(figure: Figure, record: Record, names: Sequence[str], title: str) -> list[Any]:
    """Axes one above the other, with one time."""
    rows: list[Any] = []
    for name in names:
        axes = plain_axes(figure, 100 * len(names) + 11 + len(rows), sharex=rows[0] if rows else None)
        axes.set_ylabel(name)
        axes.tick_params(labelbottom=len(rows) == len(names) - 1)
        rows.append(axes)
    rows[0].set_title(title)
    rows[0].set_xlim(0, max(float(record.t[-1]), 0.1))
    rows[-1].set_xlabel("time [s]")
    figure.align_ylabels(rows)
    return rows


def _box(circle: Circle) -> Float[np.ndarray, "2 2"]:
    return np.array([[circle.x - circle.radius, circle.y - circle.radius],
                     [circle.x + circle.radius, circle.y + circle.radius]])  # fmt: skip


def _thin(values: np.ndarray) -> np.ndarray:
    """No more rows than a line needs."""
    return values[:: max(len(values) // _POINTS, 1)]
