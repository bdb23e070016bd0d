"""Where a foot may land, and the range of commands that such steps follow.

A command fits if the displacements that it asks of both feet (`displacement`) lie in the hull, the yaw between two feet
within ``longest_turn``, and the soles don't touch. Steps may be wider than asked: that takes nothing from the speed, so
it is enough that one widening, the same for both feet, brings all of that about. For the box of a robot of iCub's size
that is |vx| <= 0.40 m/s, |vy| <= 0.13 m/s and |omega| <= 0.67 rad/s, each by itself.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT, RIGHT
from toddle.signals import Velocity
from toddle.walk.pattern.displacement import displacement

_ROUNDING = 1e-9
_HALVINGS = 30
_TRIED = 0.465  # centre of mass of the robot that the box below was found on [m]; it scales


class Hull(NamedTuple):
    """Where the left sole's origin may land, in the right sole's frame; mirrored for the right one.

    Attributes:
        rows: of each edge the outward normal and its distance: x nx + y ny <= d [m].
        corners: x, y, clockwise [m].
        reach: of the farthest corner [m].
    """

    rows: Float[np.ndarray, "edges 3"]
    corners: Float[np.ndarray, "edges 2"]
    reach: float


@lru_cache(maxsize=64)
def landing_hull(gait: Gait) -> Hull:
    """The gait's own hull; without one a box: 0.24 m ahead and back, 0.12 to 0.3 m aside for a robot of iCub's size.

    Raises:
        BadInput: the corners don't go round a convex area clockwise, or the foot distance isn't in it.
    """
    corners = np.array(gait.hull, dtype=float) if gait.hull else landing_box(gait)
    along = np.roll(corners, -1, axis=0) - corners
    following = np.roll(along, -1, axis=0)
    turns = along[:, 0] * following[:, 1] - along[:, 1] * following[:, 0]
    lengths = np.linalg.norm(along, axis=1)
    if len(corners) < 3 or (lengths < 1e-9).any() or (turns > 1e-12).any():
        raise BadInput(
            "the corners don't go clockwise round a convex area",
            where="gait, hull",
            remedy="begin with the rear inner corner of the left sole, then outwards, ahead, and back inside",
        )
    normals = np.column_stack([-along[:, 1], along[:, 0]]) / lengths[:, None]
    rows = np.column_stack([normals, (normals * corners).sum(axis=1)])
    if (normals @ np.array([0.0, gait.foot_distance]) > rows[:, 2] + 1e-9).any():
        raise BadInput(
            f"the hull leaves no room for feet {gait.foot_distance:g} m apart",
            where="gait, hull",
            remedy="its inner edge must not lie beyond foot_distance",
        )
    return Hull(np.ascontiguousarray(rows), corners, float(np.linalg.norm(corners, axis=1).max()))


def landing_box(gait: Gait) -> Float[np.ndarray, "4 2"]:
    """Corners of the box for a gait that has no hull: the inner edge lies nearer than the foot distance [m]."""
    scale = gait.com_height / _TRIED
    ahead, inner, outer = 0.24 * scale, gait.foot_distance - 0.02 * scale, gait.foot_distance + 0.16 * scale
    return np.array([[-ahead, inner], [-ahead, outer], [ahead, outer], [ahead, inner]])


@lru_cache(maxsize=1024)
def cap(velocity: Velocity, gait: Gait) -> Velocity:
    """The command itself if it fits; else the fastest that fits with the same curve, slower in all three parts alike.

    Args:
        velocity: asked; a number that isn't finite asks to stand.
        gait: how the robot steps.
    """
    if not all(map(math.isfinite, velocity)):
        return Velocity(0.0, 0.0, 0.0)
    if fits(velocity, gait):
        return velocity
    inside, outside = 0.0, 1.0
    while outside > 1e-3 and not fits(_slower(velocity, outside), gait):
        outside /= 2
    inside, outside = outside if outside > 1e-3 else 0.0, min(2 * outside, 1.0)
    for _ in range(_HALVINGS):
        middle = (inside + outside) / 2
        if fits(_slower(velocity, middle), gait):
            inside = middle
        else:
            outside = middle
    return _slower(velocity, inside)


def fits(velocity: Velocity, gait: Gait) -> bool:
    """Whether steps within the hull follow a command."""
    return widening(velocity, gait) is not None


@lru_cache(maxsize=1024)
def widening(velocity: Velocity, gait: Gait) -> float | None:
    """What the foot distance has to grow by so that both displacements lie in the hull [m]; None: nothing helps.

    Where one foot alone were held back by the hull, the robot would drift to the other side.
    """
    turn = velocity.omega * gait.step_time
    if abs(turn) > gait.longest_turn + _ROUNDING:
        return None
    hull, between = landing_hull(gait), (0.0, math.inf)
    cos, sin = math.cos(turn), math.sin(turn)
    apart = gait.foot_width / 2 * (1 + cos) + (gait.foot_length / 2 + abs(gait.foot_ahead)) * abs(sin)
    for stance, side in ((LEFT, -1.0), (RIGHT, 1.0)):
        x, y = displacement(gait.foot_distance, gait.step_time, velocity, stance, 0.0)
        beside = apart if abs(x) < gait.foot_length else 0.0
        rows = np.vstack([hull.rows, [0.0, -1.0, -beside]])
        way = np.array([-side * sin, 1 + cos]) / 2
        between = _narrowed(between, rows[:, :2] @ way, rows[:, 2] - rows[:, :2] @ np.array([x, side * y]))
    return between[0] if between[0] <= between[1] + _ROUNDING else None


def fastest(gait: Gait) -> Velocity:
    """The greatest speed that fits along each axis by itself: forward, to the left [m/s], turning left [rad/s]."""
    far = 100.0
    ahead, aside, turning = (cap(Velocity(*row), gait) for row in (far * np.eye(3)).tolist())
    return Velocity(ahead.vx, aside.vy, turning.omega)


def _narrowed(
    between: tuple[float, float], slope: Float[np.ndarray, " rows"], room: Float[np.ndarray, " rows"]
) -> tuple[float, float]:
    """The interval of e in which also slope e <= room holds."""
    least, most = between
    for along, left in zip(slope.tolist(), room.tolist(), strict=True):
        if abs(along) < 1e-12:
            if left < -_ROUNDING:
                return math.inf, -math.inf
        elif along > 0:
            most = min(most, left / along)
        else:
            least = max(least, left / along)
    return least, most


def _slower(velocity: Velocity, share: float) -> Velocity:
    return Velocity(*(share * number for number in velocity))
