"""A command that would walk into an obstacle is bent around it, or held back: before any step is planned.

The robot is a disc about the middle of its feet. Its distance d to an obstacle may shrink no faster than gamma d (a
control barrier function): far away that is no limit, near by the robot slides along the edge, and in front of a wall
of obstacles it stands. The nearest velocity that keeps this to every obstacle is a programme of two unknowns. What it
lets through, the predictive controller's own rows for soles, swing and body seldom have to correct.
"""

from __future__ import annotations

import math

import daqp
import numpy as np
from jaxtyping import Float

from toddle.robots.gait import Gait
from toddle.signals import Velocity
from toddle.walk.pattern.displacement import rotate

GAMMA = 0.5
"""Share of the distance that may go in a second [1/s]."""

ROOM = 0.17
"""Around the feet of a robot of iCub's size, for its legs, arms and sway [m]; it scales with the height."""

_FAR = 1.5  # obstacles farther than this hold nothing back [m]
_TRIED = 0.465  # height of the centre of mass that ROOM was found with [m]


def radius(gait: Gait) -> float:
    """Of the disc that is kept clear: half the feet's distance, and room [m]."""
    return gait.foot_distance / 2 + ROOM * gait.com_height / _TRIED + gait.foot_width / 2


def held_back(
    velocity: Velocity, circles: Float[np.ndarray, "circles 3"], place: tuple[float, float, float], gait: Gait
) -> Velocity:
    """The velocity nearest to the one asked that doesn't lead into an obstacle.

    Args:
        velocity: asked, in the robot's frame.
        circles: obstacles: centre and radius [m].
        place: x, y [m] and heading [rad] of the robot, in the same frame as the obstacles.
        gait: how wide the robot is.
    """
    rows, least = [], []
    for x, y, size in circles.tolist():
        dx, dy = rotate(-place[2], (place[0] - x, place[1] - y))
        away = math.hypot(dx, dy)
        left = away - size - radius(gait)
        if away > 0 and left < _FAR:
            rows.append((dx / away, dy / away))
            least.append(-GAMMA * left)
    if not rows or all(nx * velocity.vx + ny * velocity.vy >= b for (nx, ny), b in zip(rows, least, strict=True)):
        return velocity
    upper = np.full(len(rows), 1e30)
    sense = np.zeros(len(rows), np.int32)
    wanted = np.array([-velocity.vx, -velocity.vy])
    found, _, flag, _ = daqp.solve(np.eye(2), wanted, np.array(rows), upper, np.array(least), sense)
    if flag < 1 or not np.isfinite(found).all():
        return Velocity(0.0, 0.0, velocity.omega)
    return Velocity(float(found[0]), float(found[1]), velocity.omega)
