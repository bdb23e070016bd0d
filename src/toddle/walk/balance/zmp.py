"""The zero moment point (ZMP) from the wrenches at the soles (Huber 2019, eq. 2.8-2.17).

The floor presses on a sole at a point p. About the sensor, at height d over the sole, that force's torque is tau_x =
p_y f_z + d f_y and tau_y = -d f_x - p_x f_z, which is solved for p. Equation 2.10 prints the sign of tau_x wrong, and
2.11-2.12 mix the indices 1 and i; what stands here is what follows from the mechanics.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

LEAST = 1.0
"""Under this load there is no zero moment point [N]."""


def sole_zmp(wrench: Float[np.ndarray, "6"], height: float = 0.0) -> Float[np.ndarray, "2"]:
    """Where the floor presses on one sole (2.11, 2.12).

    Args:
        wrench: force [N] and torque [N m] that the floor applies, in the sole's frame, about the sensor.
        height: of the sensor over the sole, d [m].

    Returns:
        x and y in the sole's frame [m]; NaN where the sole carries nothing.
    """
    fx, fy, fz, tx, ty, _ = wrench.tolist()
    if not fz >= LEAST:
        return np.full(2, math.nan)
    return np.array([-ty - fx * height, tx - fy * height]) / fz


def zmp(
    wrenches: Float[np.ndarray, "2 6"], soles: Float[np.ndarray, "2 4"], height: float = 0.0
) -> Float[np.ndarray, "2"]:
    """Where the floor presses on the robot: both soles' points, weighted by their loads (2.16, 2.17).

    Args:
        wrenches: of the left and the right sole, as in `sole_zmp`.
        soles: their places: x, y, z [m] and yaw [rad].
        height: of the sensors over the soles, d [m].

    Returns:
        x and y in the frame of ``soles`` [m]; NaN where neither carries anything.
    """
    total = x = y = 0.0
    for (fx, fy, fz, tx, ty, _), (sole_x, sole_y, _, yaw) in zip(wrenches.tolist(), soles.tolist(), strict=True):
        if fz >= LEAST:
            # p f_z in the sole's frame: the load itself is the weight
            ahead, left = -ty - fx * height, tx - fy * height
            cos, sin = math.cos(yaw), math.sin(yaw)
            x += sole_x * fz + cos * ahead - sin * left
            y += sole_y * fz + sin * ahead + cos * left
            total += fz
    return np.array([x, y]) / total if total >= LEAST else np.full(2, math.nan)
