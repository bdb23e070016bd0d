"""Random fields of tall cylinders that a robot can cross, and that stand in its way; one seed makes one field.

The robot starts at the origin, facing x; the goal lies 6 m ahead. Five to nine cylinders of radius 0.06 to 0.18 m stand
0.9 to 5.1 m ahead and up to 1.3 m aside. The first one drawn stands in the way: its middle is at most 0.15 m off the
straight line. A field counts if its gaps are at least 0.1 m, and if a disc of radius 0.36 m (the robot, its sway, and
some room) fits through from start to goal on a grid of 5 cm without leaving a lane 5 m wide; else the next one is drawn
from the same seed.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from toddle.signals import Circle

GOAL = (6.0, 0.0)
"""Where a field is to be left [m]."""

DISC = 0.36
"""Radius of what must fit through [m]."""

_CELL, _HALF_LANE = 0.05, 2.5


def field(seed: int) -> tuple[Circle, ...]:
    """The field of a seed."""
    rng = np.random.default_rng([seed, 17])
    while True:
        circles = _drawn(rng)
        if _apart(circles) and solvable(circles):
            return circles


def solvable(circles: tuple[Circle, ...], disc: float = DISC) -> bool:
    """Whether a disc [m] fits from the start to the goal, on a grid (flood fill)."""
    x = np.arange(-0.5, GOAL[0] + 0.5 + _CELL / 2, _CELL)
    y = np.arange(-_HALF_LANE, _HALF_LANE + _CELL / 2, _CELL)
    clear = np.ones((len(x), len(y)), bool)
    for circle in circles:
        clear &= np.hypot(x[:, None] - circle.x, y[None, :] - circle.y) > circle.radius + disc
    start, goal = [(int(np.argmin(np.abs(x - px))), int(np.argmin(np.abs(y - py)))) for px, py in ((0.0, 0.0), GOAL)]
    if not (clear[start] and clear[goal]):
        return False
    waiting = deque([start])
    clear[start] = False
    while waiting:
        i, j = waiting.popleft()
        if (i, j) == goal:
            return True
        for near in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
            if 0 <= near[0] < len(x) and 0 <= near[1] < len(y) and clear[near]:
                clear[near] = False
                waiting.append(near)
    return False


def _drawn(rng: np.random.Generator) -> tuple[Circle, ...]:
    count = int(rng.integers(5, 10))
    x, y, radius = rng.uniform(0.9, 5.1, count), rng.uniform(-1.3, 1.3, count), rng.uniform(0.06, 0.18, count)
    y[0] = rng.uniform(-0.15, 0.15)
    return tuple(Circle(*numbers) for numbers in np.column_stack([x, y, radius]).round(3).tolist())


def _apart(circles: tuple[Circle, ...]) -> bool:
    pairs = [(a, b) for i, a in enumerate(circles) for b in circles[:i]]
    return all(math.hypot(a.x - b.x, a.y - b.y) > a.radius + b.radius + 0.1 for a, b in pairs)
