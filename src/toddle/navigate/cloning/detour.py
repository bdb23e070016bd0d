"""Ways around circles that a disc can take, from where it is: how far each heading is free, and where to go first.

The first corner is that of the shortest way in a visibility graph whose nodes stand on rings around the circles
(Lozano-Perez and Wesley 1979); turning right at first costs more than turning left, and so does another heading than
the last one.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Bool, Float

from toddle.navigate.scenarios.rooms import Hall

_RING = np.arange(14) * math.pi / 7  # where nodes stand around a circle [rad]
_CHORD = 1.0 / math.cos(math.pi / 14)  # so that the way between two neighbours stays clear of it
_SPARE = 0.03  # beyond the disc [m]
_SLACK = 0.06  # of a disc that stands at a circle, or it would see no way along it [m]
_TOUCH = 0.001  # between a disc and what it overlapped [m]
_PASSED = 0.15  # a corner so near is not gone to: the one after it must show then [m]
_HOPS = 8  # corners of a way, at most
_STEP = 0.1  # between places along a heading that are compared with walls [m]

Points = Float[np.ndarray, "points 2"]
Circles = Float[np.ndarray, "circles 3"]


def narrowed(circles: Circles, place: Float[np.ndarray, "2"], body: float, slack: float = _TOUCH) -> Circles:
    """Circles that the disc is nearer to than the slack, made smaller by up to that, or so that it may walk away.

    Args:
        circles: x, y, radius [m].
        place: of the disc [m].
        body: radius of the disc [m].
        slack: [m].
    """
    left = np.hypot(*(circles[:, :2] - place).T) - circles[:, 2] - body
    less = np.minimum(slack - left, np.maximum(slack, _TOUCH - left))
    return np.column_stack([circles[:, :2], circles[:, 2] - np.maximum(less, 0.0)])


def free_lengths(
    place: Float[np.ndarray, "2"], headings: Float[np.ndarray, " ways"], circles: Circles, hall: Hall | None,
    body: float, most: float,
) -> Float[np.ndarray, " ways"]:  # fmt: skip
    """How far a disc may walk along each heading [m].

    Args:
        place: of the disc [m].
        headings: [rad].
        circles: x, y, radius [m].
        hall: the walls.
        body: radius of the disc [m].
        most: no heading is followed farther [m].
    """
    ways = np.stack([np.cos(headings), np.sin(headings)], axis=1)
    free = np.full(len(headings), most)
    if len(circles):
        small = narrowed(circles, place, body)
        off, reach = small[:, :2] - place, small[:, 2] + body
        along = ways @ off.T
        inside = reach**2 - ((off**2).sum(axis=1) - along**2)
        enters = np.where((inside > 0) & (along > 0), along - np.sqrt(np.maximum(inside, 0.0)), most)
        free = np.minimum(free, np.maximum(enters, 0.0).min(axis=1))
    if hall is not None:
        far = np.arange(_STEP, most + _STEP / 2, _STEP)
        left = hall.inside(place + far[:, None, None] * ways)
        bad = (left < body) & (left < float(hall.inside(place)) - 1e-6)
        free = np.minimum(free, np.where(bad.any(axis=0), far[bad.argmax(axis=0)] - _STEP, most))
    return free


def gaps(
    place: Float[np.ndarray, "2"], headings: Float[np.ndarray, " ways"], circles: Circles, far: float
) -> Float[np.ndarray, " ways"]:
    """The least distance to rims of circles ahead, along each heading [m]; infinite where none is ahead."""
    if not len(circles):
        return np.full(len(headings), np.inf)
    ways = np.stack([np.cos(headings), np.sin(headings)], axis=1)
    off = circles[:, :2] - place
    along = np.clip(ways @ off.T, 0.0, far)
    apart = np.hypot(*(off[None] - along[..., None] * ways[:, None]).transpose(2, 0, 1)) - circles[:, 2]
    return np.asarray(np.where(along > 0, apart, np.inf).min(axis=1))


def first_corner(
    place: Float[np.ndarray, "2"], goal: Float[np.ndarray, "2"], circles: Circles, hall: Hall | None,
    body: float, heading: float, right: float, change: float,
) -> Float[np.ndarray, "2"]:  # fmt: skip
    """Where to go first on the shortest way to a goal; the goal itself where the way is free, or there is none.

    Args:
        place: of the disc [m].
        goal: [m].
        circles: x, y, radius [m].
        hall: the walls.
        body: radius of the disc [m].
        heading: the last one [rad]; NaN: none.
        right: what a radian to the right of the goal costs at first [m].
        change: what a radian away from the last heading costs [m].
    """
    small = narrowed(circles, place, body, _SLACK)
    if not len(small) or bool(_clear(place[None], goal[None], small, body)[0, 0]):
        return goal
    nodes = np.vstack([goal, _nodes(circles, hall, body)])
    clear = _clear(nodes, nodes, small, body)
    lengths = np.where(clear, np.hypot(*(nodes[:, None] - nodes[None]).transpose(2, 0, 1)), np.inf)
    left = np.where(np.arange(len(nodes)) == 0, 0.0, np.inf)
    for _ in range(_HOPS):
        left = np.minimum(left, (lengths + left[None]).min(axis=1))
    towards = nodes - place
    bearing = np.arctan2(towards[:, 1], towards[:, 0])
    aside = _wrapped(bearing - math.atan2(goal[1] - place[1], goal[0] - place[0]))
    cost = np.hypot(*towards.T) + left + right * np.maximum(-aside, 0.0)
    if math.isfinite(heading):
        cost += change * np.abs(_wrapped(bearing - heading))
    passed = np.hypot(*towards.T) < _PASSED
    passed[0] = False
    cost = np.where(_clear(place[None], nodes, small, body)[0] & ~passed, cost, np.inf)
    best = int(np.argmin(cost))
    return nodes[best] if math.isfinite(cost[best]) else goal


def _nodes(circles: Circles, hall: Hall | None, body: float) -> Points:
    """Places on rings around the circles that are clear of the others and of the walls."""
    reach = (circles[:, 2] + body + _SPARE) * _CHORD
    around = np.stack([np.cos(_RING), np.sin(_RING)], axis=1)
    points = (circles[:, None, :2] + reach[:, None, None] * around).reshape(-1, 2)
    off = np.hypot(*(points[:, None] - circles[None, :, :2]).transpose(2, 0, 1)) - circles[:, 2]
    free = (off >= body).all(axis=1)
    if hall is not None:
        free &= hall.inside(points) >= body
    return points[free]


def _clear(
    starts: Float[np.ndarray, "starts 2"], ends: Float[np.ndarray, "ends 2"], circles: Circles, body: float
) -> Bool[np.ndarray, "starts ends"]:
    """Whether a disc can go straight from each start to each end."""
    way = ends[None] - starts[:, None]
    square = np.maximum((way**2).sum(axis=2), 1e-12)
    off = circles[:, :2] - starts[:, None]
    along = np.einsum("abk,ack->abc", way, off) / square[..., None]
    share = np.clip(along, 0.0, 1.0)
    apart = (off**2).sum(axis=2)[:, None] - share * (2 * along - share) * square[..., None]
    return np.asarray((apart >= (circles[:, 2] + body) ** 2 - 1e-9).all(axis=2))


def _wrapped(angles: Float[np.ndarray, " ways"]) -> Float[np.ndarray, " ways"]:
    return np.remainder(angles + math.pi, 2 * math.pi) - math.pi
