"""A way around upright cylinders: from where the robot is, the velocity that leads it to a goal.

The shortest way among circles that are grown by a clearance runs straight between points on their rims (a visibility
graph, Lozano-Perez and Wesley 1979; rims are polygons here). It is planned once, from the goal outwards. Each question
looks which of its corners are in sight, turns towards the one on the shortest way, and walks the slower the more it has
to turn. Nothing is kept between questions: a push aside only changes the next answer.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from toddle.failures import BadInput
from toddle.signals import Circle, Velocity

_CORNERS = 16  # of the polygon around a circle
_CLEARANCES = (1.0, 0.85, 0.7, 0.55)  # shares of the clearance that are tried until there is a way
_INSIDE = 0.99  # of the distance: who is nearer than the clearance may leave, not come nearer still
_TURN_GAIN = 1.5  # yaw rate over bearing error [1/s]
_NARROW = 0.7  # error of the bearing at which walking ahead ends and turning in place begins [rad]


class Ways(NamedTuple):
    """The shortest ways to a goal that keep one clearance.

    Attributes:
        circles: x, y, radius of each obstacle, grown by the clearance [m].
        corners: points that a way may turn at; the last one is the goal [m].
        left: length of the way from each of them to the goal [m]; infinite without a way.
    """

    circles: Float[np.ndarray, "circles 3"]
    corners: Float[np.ndarray, "corners 2"]
    left: Float[np.ndarray, " corners"]

    def towards(self, place: Float[np.ndarray, "2"]) -> Float[np.ndarray, "2"] | None:
        """The corner in sight of a place that lies on the shortest way [m]; None without a way."""
        away = np.hypot(*(self.circles[:, :2] - place).T)
        grown = self.circles.copy()
        grown[:, 2] = np.minimum(grown[:, 2], _INSIDE * away)
        seen = free(np.broadcast_to(place, self.corners.shape), self.corners, grown)
        total = np.where(seen, np.hypot(*(self.corners - place).T) + self.left, np.inf)
        best = int(np.argmin(total))
        return self.corners[best] if math.isfinite(total[best]) else None


@dataclass(frozen=True)
class Guide:
    """Leads to a goal; call it with where the robot is.

    Attributes:
        goal: x, y [m].
        ways: by clearance, the widest first; the first that leads from where the robot is counts.
        speed: ahead [m/s].
        fastest_turn: yaw rate [rad/s].
        near: so near to the goal it is reached [m].
    """

    goal: tuple[float, float]
    ways: tuple[Ways, ...]
    speed: float
    fastest_turn: float
    near: float

    def __call__(self, place: Float[np.ndarray, "3"]) -> Velocity | None:
        """The velocity at a place.

        Args:
            place: x, y [m] and yaw [rad] of the robot, in the frame of circles and goal.

        Returns:
            The velocity; None where the goal is reached. Without any way, to stand.
        """
        x, y, yaw = place.tolist()
        if math.hypot(self.goal[0] - x, self.goal[1] - y) <= self.near:
            return None
        found = (ways.towards(place[:2]) for ways in self.ways)
        towards = next((corner for corner in found if corner is not None), None)
        if towards is None:
            return Velocity(0.0, 0.0, 0.0)
        off = math.remainder(math.atan2(towards[1] - y, towards[0] - x) - yaw, 2 * math.pi)
        ahead = self.speed * max(1.0 - abs(off) / _NARROW, 0.0)
        return Velocity(ahead, 0.0, min(max(_TURN_GAIN * off, -self.fastest_turn), self.fastest_turn))


def guide(
    circles: Sequence[Circle],
    goal: tuple[float, float],
    *,
    speed: float = 0.2,
    fastest_turn: float = 0.3,
    clearance: float = 0.4,
    near: float = 0.15,
) -> Guide:
    """A guide to a goal around circles.

    As a command source of the loop: ``lambda t: guided(place())``, where ``place`` tells where the robot is.

    Args:
        circles: obstacles, in the frame in which the goal is told, and later the place.
        goal: x, y [m].
        speed: ahead where the way is straight [m/s].
        fastest_turn: yaw rate [rad/s].
        clearance: of the robot's middle to an obstacle [m]; less, down to 0.55 of it, where no way is as wide.
        near: so near to the goal it is reached [m].

    Raises:
        BadInput: a number that is not finite or not above 0, or the goal lies in an obstacle.
    """
    numbers = {"speed": speed, "fastest_turn": fastest_turn, "clearance": clearance, "near": near}
    for name, value in numbers.items():
        if not (math.isfinite(value) and value > 0):
            raise BadInput(f"{value} is no use", where=f"guide, {name}", remedy="give a number above 0")
    rows = np.array([tuple(circle) for circle in circles], dtype=float).reshape(-1, 3)
    end = np.array(goal, dtype=float)
    if not (np.isfinite(rows).all() and np.isfinite(end).all()):
        raise BadInput("a number isn't finite", where="guide, circles and goal", remedy="give finite numbers")
    if (np.hypot(*(rows[:, :2] - end).T) <= rows[:, 2]).any():
        raise BadInput("it lies in an obstacle", where="guide, goal", remedy="choose another goal")
    ways = tuple(_planned(rows, end, share * clearance) for share in _CLEARANCES)
    return Guide((float(end[0]), float(end[1])), ways, speed, fastest_turn, near)


def _planned(rows: Float[np.ndarray, "circles 3"], goal: Float[np.ndarray, "2"], clearance: float) -> Ways:
    grown = rows + np.array([0.0, 0.0, clearance])
    grown[:, 2] = np.minimum(grown[:, 2], _INSIDE * np.hypot(*(rows[:, :2] - goal).T))
    corners = np.vstack([_rims(grown), goal])
    return Ways(grown, corners, _lengths(corners, grown))


def free(
    start: Float[np.ndarray, "ways 2"], end: Float[np.ndarray, "ways 2"], circles: Float[np.ndarray, "circles 3"]
) -> Bool[np.ndarray, " ways"]:
    """Whether each straight way stays out of all circles [m]."""
    along = end - start
    squared = np.maximum((along**2).sum(axis=1), 1e-12)
    middle = circles[None, :, :2] - start[:, None]
    share = np.clip((middle * along[:, None]).sum(axis=2) / squared[:, None], 0.0, 1.0)
    nearest = middle - share[:, :, None] * along[:, None]
    return (np.hypot(nearest[:, :, 0], nearest[:, :, 1]) >= circles[:, 2]).all(axis=1)


def _rims(circles: Float[np.ndarray, "circles 3"]) -> Float[np.ndarray, "corners 2"]:
    """Corners of polygons around the circles, those left out that lie in another one."""
    angle = 2 * math.pi * np.arange(_CORNERS) / _CORNERS
    around = np.column_stack([np.cos(angle), np.sin(angle)])
    far = (1.0 + 1e-6) * circles[:, 2] / math.cos(math.pi / _CORNERS)  # so that edges stay outside
    points = (circles[:, None, :2] + far[:, None, None] * around).reshape(-1, 2)
    return points[free(points, points, circles)]


def _lengths(
    corners: Float[np.ndarray, "corners 2"], circles: Float[np.ndarray, "circles 3"]
) -> Float[np.ndarray, " corners"]:
    """Of the shortest way from each corner to the last one [m] (Dijkstra)."""
    left = np.full(len(corners), np.inf)
    left[-1] = 0.0
    waiting = [(0.0, len(corners) - 1)]
    while waiting:
        length, at = heapq.heappop(waiting)
        if length > left[at]:
            continue
        start = np.broadcast_to(corners[at], corners.shape)
        through = length + np.hypot(*(corners - start).T)
        shorter = (through < left) & free(start, corners, circles)
        left[shorter] = through[shorter]
        for number in np.flatnonzero(shorter).tolist():
            heapq.heappush(waiting, (float(through[number]), number))
    return left
