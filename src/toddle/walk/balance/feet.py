"""The soles' reference, tick by tick: the swing foot is re-fitted to its goal from where it is.

x, y and yaw follow the quintic that ends at rest at the goal when the step ends (Huber 2019, 2.101-2.110); the height
rises to its apex in the first half of the swing and comes down in the second, by quintics too, so that an early or a
late end needs nothing else. Both are fitted anew every tick.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.walk.pattern.swing import evaluate, quintic

_LOWERING = 0.08  # a foot that should have landed goes on down so fast [m/s]
_LOWEST = -0.03  # and stops there, where there is no floor [m]
_SETTLE = 0.04  # time constant by which a landed foot's reference comes to the floor [s]
_LEAST_TIME = 0.02  # [s]
_OVER = 0.002  # the swing foot comes down to so far over the floor, until its step ends [m]
_PLANAR, _HEIGHT = [0, 1, 3], [2]


class Feet(NamedTuple):
    """Both soles: pose (x, y, z [m], yaw [rad]), its first and second derivatives."""

    pose: Float[np.ndarray, "2 4"]
    velocity: Float[np.ndarray, "2 4"]
    acceleration: Float[np.ndarray, "2 4"]


def swing(
    feet: Feet, side: int, goal: tuple[float, float, float], height: float, done: float, left: float, dt: float
) -> Feet:
    """One tick of the swing foot.

    Args:
        feet: both soles a tick ago.
        side: which one swings.
        goal: x, y [m] and yaw [rad] of its landing.
        height: of the apex [m].
        done: time since it lifted [s].
        left: time until it lands [s]; 0 or less: it is late, and goes on down.
        dt: of the tick [s].
    """
    now = np.stack([array[side] for array in feet])
    if left <= _LEAST_TIME:
        now[1:] = 0.0
        now[0, 2], now[1, 2] = max(now[0, 2] - _LOWERING * dt, _LOWEST), -_LOWERING
        return _with(feet, side, now)
    to_apex = (left - done) / 2
    top, until = (height, to_apex) if to_apex > _LEAST_TIME else (_OVER, left)
    now[:, _PLANAR] = evaluate(quintic(now[:, _PLANAR], np.array(goal), left), min(dt, left))
    now[:, _HEIGHT] = evaluate(quintic(now[:, _HEIGHT], np.array([top]), until), min(dt, until))
    return _with(feet, side, now)


def rest(feet: Feet, side: int, anchor: Float[np.ndarray, "4"], dt: float) -> Feet:
    """One tick of a foot that stands: its reference settles on its anchor."""
    now = np.zeros((3, 4))
    now[0] = feet.pose[side] + (anchor - feet.pose[side]) * min(dt / _SETTLE, 1.0)
    return _with(feet, side, now)


def _with(feet: Feet, side: int, now: Float[np.ndarray, "3 4"]) -> Feet:
    arrays = [array.copy() for array in feet]
    for array, row in zip(arrays, now, strict=True):
        array[side] = row
    return Feet(*arrays)
