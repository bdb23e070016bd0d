"""Where the next footsteps go by the command alone: the displacement of each from the one before.

With t the stance foot's yaw, sg = +1 for a left stance foot and fe = foot distance + |vy| T:

    D = -R(t) (0, sg fe / 2) + R(t + omega T / 2) v T + R(t + omega T) (0, -sg fe / 2),   next yaw t + omega T

so that the middle between the feet moves by v T along the heading half-way through the turn.
"""

from __future__ import annotations

import math

from toddle.robots.humanoid import LEFT
from toddle.signals import Velocity

Pair = tuple[float, float]


def rotate(yaw: float, vector: Pair) -> Pair:
    """The vector, turned left by yaw [rad]."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    return cos * vector[0] - sin * vector[1], sin * vector[0] + cos * vector[1]


def displacement(foot_distance: float, step_time: float, velocity: Velocity, stance: int, yaw: float) -> Pair:
    """From the stance foot to the next one [m].

    Args:
        foot_distance: between the soles when standing [m].
        step_time: of a step [s].
        velocity: command.
        stance: side that carries.
        yaw: of the stance foot [rad].
    """
    half = (foot_distance + abs(velocity.vy) * step_time) / 2 * (1 if stance == LEFT else -1)
    turn = velocity.omega * step_time
    from_foot = rotate(yaw, (0.0, -half))
    ahead = rotate(yaw + turn / 2, (velocity.vx * step_time, velocity.vy * step_time))
    to_foot = rotate(yaw + turn, (0.0, -half))
    return from_foot[0] + ahead[0] + to_foot[0], from_foot[1] + ahead[1] + to_foot[1]


def displacements(
    foot_distance: float, step_time: float, velocity: Velocity, stance: int, yaw: float, count: int
) -> list[Pair]:
    """Of the next ``count`` footsteps, each from the one before [m]."""
    found = []
    for _ in range(count):
        found.append(displacement(foot_distance, step_time, velocity, stance, yaw))
        yaw += velocity.omega * step_time
        stance = 1 - stance
    return found
