"""The sole in the air: 4th order in height, 5th order along, across and in yaw (Huber 2019, equations 2.89 to 2.110).

A quintic starts from where the sole is, how fast it moves and how it accelerates, so that it may be fitted anew at
every tick: that is the document's feedback. Compiled, since the robot's loop asks at every tick.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numba import njit


@njit(cache=True)
def quintic(
    start: Float[np.ndarray, "3 axes"], goal: Float[np.ndarray, " axes"], duration: float
) -> Float[np.ndarray, "6 axes"]:
    """The polynomial that leaves as it is told and comes to rest at the goal (2.101 to 2.110).

    Args:
        start: position, velocity and acceleration, one row each, of any axes [m or rad, s].
        goal: position there; velocity and acceleration end at zero.
        duration: from start to goal, above 0 [s].

    Returns:
        Coefficients, the constant one first.
    """
    a = np.empty((6, start.shape[1]))
    d = duration
    for i in range(start.shape[1]):
        x, v, h = start[0, i], start[1, i], start[2, i] / 2
        far = goal[i] - x - d * (v + d * h)
        slow = -v - 2 * d * h
        bent = -2 * h
        a[0, i], a[1, i], a[2, i] = x, v, h
        a[3, i] = (10 * far - 4 * d * slow + d * d * bent / 2) / d**3
        a[4, i] = (-15 * far + 7 * d * slow - d * d * bent) / d**4
        a[5, i] = (6 * far - 3 * d * slow + d * d * bent / 2) / d**5
    return a


@njit(cache=True)
def quartic(height: float, rate: float, apex: float, landing: float, duration: float) -> Float[np.ndarray, "5 1"]:
    """The polynomial of the sole's height: through an apex at half time, at rest on landing (2.92 to 2.100).

    Args:
        height: at the start [m].
        rate: at the start [m/s].
        apex: height at half of the duration [m].
        landing: height at the end [m].
        duration: of the swing, above 0 [s].

    Returns:
        Coefficients, the constant one first, as a column: an axis for `evaluate`.
    """
    d = duration
    a = np.empty((5, 1))
    a[0, 0], a[1, 0] = height, rate
    a[2, 0] = (-11 * height - 4 * d * rate + 16 * apex - 5 * landing) / d**2
    a[3, 0] = (18 * height + 5 * d * rate - 32 * apex + 14 * landing) / d**3
    a[4, 0] = (-8 * height - 2 * d * rate + 16 * apex - 8 * landing) / d**4
    return a


@njit(cache=True)
def evaluate(coefficients: Float[np.ndarray, "terms axes"], t: float) -> Float[np.ndarray, "3 axes"]:
    """Value, first and second derivative of polynomials at a time [s] (2.89 to 2.91)."""
    terms, axes = coefficients.shape
    out = np.zeros((3, axes))
    for i in range(axes):
        value, slope, bend = 0.0, 0.0, 0.0
        for n in range(terms - 1, -1, -1):
            bend = bend * t + 2 * slope
            slope = slope * t + value
            value = value * t + coefficients[n, i]
        out[0, i], out[1, i], out[2, i] = value, slope, bend
    return out
