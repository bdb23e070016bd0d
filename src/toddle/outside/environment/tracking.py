"""How well the robot does what an episode asks: its true velocity over two steps against the goal.

The waist sways with every step; over two steps, one of each foot, the sway is gone.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.signals import Velocity

FALL = -1.0
"""The reward of the step in which the robot falls."""

_HALF = 0.5  # an error of this share of the fastest velocity earns 1/e


class Place(NamedTuple):
    """Where the waist truly was: time [s], x, y [m], yaw [rad]."""

    t: float
    x: float
    y: float
    yaw: float


def mean_velocity(old: Place, new: Place) -> Float[np.ndarray, "3"]:
    """From one place to another, along the heading half-way [m/s, m/s, rad/s]; 0 where no time has passed."""
    if new.t <= old.t:
        return np.zeros(3)
    turned = math.remainder(new.yaw - old.yaw, 2 * math.pi)
    cos, sin = math.cos(old.yaw + turned / 2), math.sin(old.yaw + turned / 2)
    dx, dy = new.x - old.x, new.y - old.y
    return np.array([cos * dx + sin * dy, cos * dy - sin * dx, turned]) / (new.t - old.t)


def reward(velocity: Float[np.ndarray, "3"], goal: Velocity, fastest: Velocity, fell: bool) -> float:
    """Of one step: exp(-4 |e|^2), e the error of each component as a share of the fastest; `FALL` for a fall.

    It is positive as long as the robot stands, so that falling never pays.
    """
    if fell:
        return FALL
    error = (velocity - np.array(goal)) / np.array(fastest)
    return math.exp(-float(error @ error) / _HALF**2)
