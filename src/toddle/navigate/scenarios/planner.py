"""Which layouts can be solved at all, and how short the shortest way is: A* on a grid (Hart, Nilsson, Raphael 1968).

Independent of how the walker is steered: it only knows the robot as a disc and obstacles as circles. The grid's way is
then pulled tight. A disc that just fits counts as fitting, but for half a centimetre.
"""

from __future__ import annotations

import heapq
import itertools
import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from toddle.failures import BadInput
from toddle.navigate.scenarios.layouts import Layout, layouts

CELL = 0.05
"""Of the grid [m]."""

_SPARE = 0.005  # so that the straight way between two free cells stays free too [m]
_AROUND = 1.0  # the grid reaches so far beyond start, goal and circles [m]
_STEPS = [(a, b, CELL * math.hypot(a, b)) for a, b in itertools.product((-1, 0, 1), repeat=2) if a or b]


@dataclass(frozen=True)
class Way:
    """A way from the start to a goal that keeps the robot's disc out of all circles.

    Attributes:
        points: corners of the way, the start and the goal included [m].
        length: of the way [m]; at most a few per cent above the shortest.
    """

    points: Float[np.ndarray, "points 2"]
    length: float


def plan(
    goal: Float[np.ndarray, "2"],
    circles: Float[np.ndarray, "circles 3"],
    *,
    body: float = 0.2,
    start: Float[np.ndarray, "2"] | None = None,
) -> Way | None:
    """The shortest way.

    Args:
        goal: x, y [m].
        circles: x, y, radius [m]; a negative radius for none.
        body: radius of the robot [m].
        start: x, y [m]; None: the origin.

    Returns:
        The way; None where there is none.

    Raises:
        BadInput: a number that is not finite.
    """
    begin, end = (np.asarray(point, float) for point in (np.zeros(2) if start is None else start, goal))
    grown = np.asarray(circles, float)
    if not (np.isfinite(grown).all() and np.isfinite([*begin, *end, body]).all()):
        raise BadInput("a number isn't finite", where="plan, start, goal, circles, body", remedy="give finite numbers")
    grown = grown[grown[:, 2] >= 0] + np.array([0.0, 0.0, body])
    if (_gap(np.stack([begin, end]), grown) < 0).any():
        return None
    if _straight(begin, end, grown):
        return Way(np.stack([begin, end]), float(np.hypot(*(end - begin))))
    cells = _cells(begin, end, grown)
    if cells is None:
        return None
    points = _tight(np.vstack([begin, cells, end]), grown)
    return Way(points, float(np.hypot(*np.diff(points, axis=0).T).sum()))


def solvable_layouts(
    seed: int, count: int, *, circles: int = 5, goal: tuple[float, float] = (0.5, 3.0), body: float = 0.2
) -> tuple[Layout, Float[np.ndarray, " layouts"], int]:
    """Layouts that have a way.

    Args:
        seed: of the draw.
        count: of layouts.
        circles: 0 to so many in each.
        goal: how far away, at least and at most [m].
        body: radius of the robot, with what it is to keep between itself and a circle [m].

    Returns:
        The layouts, the length of the way in each [m], and how many were drawn to find them.

    Raises:
        BadInput: hardly any layout has a way.
    """
    drawn = layouts(seed, 4 * count + 16, circles=circles, goal=goal, body=body)
    chosen, lengths = [], []
    for number, (end, those) in enumerate(zip(drawn.goal, drawn.circles, strict=True)):
        way = plan(end, those, body=body)
        if way is not None:
            chosen.append(number)
            lengths.append(way.length)
        if len(chosen) == count:
            return Layout(drawn.goal[chosen], drawn.circles[chosen]), np.array(lengths), number + 1
    raise BadInput(
        f"{len(chosen)} of {len(drawn.goal)} layouts have a way", where="layouts", remedy="ask for fewer circles"
    )


def _gap(points: Float[np.ndarray, "*points 2"], grown: Float[np.ndarray, "circles 3"]) -> Float[np.ndarray, "*points"]:
    """From each point to the nearest rim [m]; infinite without circles."""
    away = np.hypot(points[..., None, 0] - grown[:, 0], points[..., None, 1] - grown[:, 1]) - grown[:, 2]
    return away.min(axis=-1, initial=np.inf)


def _straight(
    start: Float[np.ndarray, "2"], end: Float[np.ndarray, "2"], grown: Float[np.ndarray, "circles 3"]
) -> bool:
    """Whether the straight way stays out of all circles."""
    along = end - start
    share = (grown[:, :2] - start) @ along / max(float(along @ along), 1e-12)
    nearest = start + np.clip(share, 0.0, 1.0)[:, None] * along
    return bool((np.hypot(*(grown[:, :2] - nearest).T) >= grown[:, 2]).all())


def _cells(
    start: Float[np.ndarray, "2"], end: Float[np.ndarray, "2"], grown: Float[np.ndarray, "circles 3"]
) -> Float[np.ndarray, "cells 2"] | None:
    """Middles of the cells that the shortest way on the grid runs through; None without a way."""
    reach = grown[:, 2:] + _AROUND
    low = np.vstack([start - _AROUND, end - _AROUND, grown[:, :2] - reach]).min(axis=0)
    high = np.vstack([start + _AROUND, end + _AROUND, grown[:, :2] + reach]).max(axis=0)
    xs, ys = (np.arange(low[axis], high[axis], CELL) for axis in (0, 1))
    middles = np.stack(np.meshgrid(xs, ys, indexing="ij"), axis=-1)
    free = _gap(middles, grown) >= _SPARE
    first, last = (_nearest(point, middles, free, grown) for point in (start, end))
    if first is None or last is None:
        return None
    found = _astar(free, first, last)
    return None if found is None else np.array([middles[cell] for cell in found])


def _nearest(
    point: Float[np.ndarray, "2"],
    middles: Float[np.ndarray, "xs ys 2"],
    free: Bool[np.ndarray, "xs ys"],
    grown: Float[np.ndarray, "circles 3"],
) -> tuple[int, int] | None:
    """The nearest free cell that a straight way leads to."""
    away = np.where(free, np.hypot(*np.moveaxis(middles - point, -1, 0)), np.inf)
    for flat in np.argsort(away, axis=None)[:20]:
        cell = tuple(int(part) for part in np.unravel_index(flat, away.shape))
        if np.isfinite(away[cell]) and _straight(point, middles[cell], grown):
            return cell[0], cell[1]
    return None


def _astar(
    free: Bool[np.ndarray, "xs ys"], first: tuple[int, int], last: tuple[int, int]
) -> list[tuple[int, int]] | None:
    """Cells of the shortest way with eight neighbours each."""
    cost, before = {first: 0.0}, {first: first}
    waiting, done = [(0.0, first)], set()
    while waiting:
        _, at = heapq.heappop(waiting)
        if at == last:
            return _back(before, last)
        if at in done:
            continue
        done.add(at)
        for a, b, step in _STEPS:
            to = (at[0] + a, at[1] + b)
            if not (0 <= to[0] < free.shape[0] and 0 <= to[1] < free.shape[1] and free[to]):
                continue
            through = cost[at] + step
            if through < cost.get(to, math.inf):
                cost[to], before[to] = through, at
                heapq.heappush(waiting, (through + CELL * math.dist(to, last), to))
    return None


def _back(before: dict[tuple[int, int], tuple[int, int]], last: tuple[int, int]) -> list[tuple[int, int]]:
    cells = [last]
    while before[cells[-1]] != cells[-1]:
        cells.append(before[cells[-1]])
    return cells[::-1]


def _tight(points: Float[np.ndarray, "points 2"], grown: Float[np.ndarray, "circles 3"]) -> Float[np.ndarray, "kept 2"]:
    """The way without the corners that a straight way passes by, seen from each kept one."""
    kept, at = [0], 0
    while at < len(points) - 1:
        straight = (
            to for to in range(len(points) - 1, at, -1) if to == at + 1 or _straight(points[at], points[to], grown)
        )
        at = next(straight)
        kept.append(at)
    return points[kept]
