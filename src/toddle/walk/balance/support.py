"""The area on which the robot stands: one sole, or the convex hull of both; plain arithmetic on a few corners."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT, RIGHT
from toddle.walk.balance.pendulum import Pair

Corners = list[Pair]


def sole_corners(gait: Gait, x: float, y: float, yaw: float, share: float = 1.0) -> Corners:
    """Corners of a sole on the floor, counter-clockwise [m]; ``share`` shrinks it about its middle."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    length, width = share * gait.foot_length / 2, share * gait.foot_width / 2
    ahead = gait.foot_ahead
    box = ((ahead + length, -width), (ahead + length, width), (ahead - length, width), (ahead - length, -width))
    return [(x + cos * a - sin * b, y + sin * a + cos * b) for a, b in box]


def area(gait: Gait, soles: Sequence[tuple[float, float, float]], share: float = 1.0) -> Corners:
    """Of one sole or of both, poses x, y [m] and yaw [rad]; counter-clockwise [m]; ``share`` shrinks each sole."""
    corners = [sole_corners(gait, *pose, share) for pose in soles]
    return corners[0] if len(corners) == 1 else hull([*corners[0], *corners[1]])


def load_share(soles: Float[np.ndarray, "2 4"], zmp: Pair, carries: int | None) -> Pair:
    """How the weight is shared: by the ZMP's place on the line between feet that both stand; a part each of 1.

    Args:
        soles: poses, left and right.
        zmp: zero moment point [m].
        carries: side of the only foot that stands; None: both do.
    """
    if carries is not None:
        return (1.0, 0.0) if carries == LEFT else (0.0, 1.0)
    (lx, ly), (rx, ry) = soles[LEFT, :2].tolist(), soles[RIGHT, :2].tolist()
    dx, dy = lx - rx, ly - ry
    share = ((zmp[0] - rx) * dx + (zmp[1] - ry) * dy) / max(dx * dx + dy * dy, 1e-9)
    share = min(max(share, 0.0), 1.0)
    return share, 1.0 - share


def hull(points: Sequence[Pair]) -> Corners:
    """The convex hull, counter-clockwise (Andrew's monotone chain)."""
    ordered = sorted(points)
    lower = _chain(ordered)
    upper = _chain(ordered[::-1])
    return lower[:-1] + upper[:-1]


def _chain(points: Sequence[Pair]) -> Corners:
    chain: Corners = []
    for x, y in points:
        while len(chain) > 1:
            (ax, ay), (bx, by) = chain[-2], chain[-1]
            if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0:
                break
            chain.pop()
        chain.append((x, y))
    return chain


def margin(corners: Corners, point: Pair) -> float:
    """Distance from the point to the nearest edge's line [m]; negative outside. Corners are counter-clockwise."""
    x, y = point
    least = math.inf
    ax, ay = corners[-1]
    for bx, by in corners:
        ex, ey = bx - ax, by - ay
        length = math.hypot(ex, ey)
        if length > 0:
            least = min(least, (ex * (y - ay) - ey * (x - ax)) / length)
        ax, ay = bx, by
    return least


def clip(corners: Corners, inside: Pair, point: Pair) -> Pair:
    """The point, or where the line from ``inside`` to it leaves the area."""
    x0, y0 = inside
    dx, dy = point[0] - x0, point[1] - y0
    share = 1.0
    ax, ay = corners[-1]
    for bx, by in corners:
        ex, ey = bx - ax, by - ay
        leaving = ey * dx - ex * dy
        if leaving > 0:
            room = ex * (y0 - ay) - ey * (x0 - ax)
            share = min(share, max(room / leaving, 0.0))
        ax, ay = bx, by
    return x0 + share * dx, y0 + share * dy
