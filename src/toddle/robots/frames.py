"""Homogeneous transforms in float64, for the constants of a chain: computed once, when a robot is read."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

Transform = Float[np.ndarray, "4 4"]


def transform(rotation: Float[np.ndarray, "3 3"] | None, position: Float[np.ndarray, "3"]) -> Transform:
    """The transform with this rotation (None: no turn) and this position [m]."""
    frame = np.eye(4)
    if rotation is not None:
        frame[:3, :3] = rotation
    frame[:3, 3] = position
    return frame


def inverse(frame: Transform) -> Transform:
    """The inverse of a rigid transform."""
    turn = frame[:3, :3].T
    return transform(turn, -turn @ frame[:3, 3])


def from_rpy(rpy: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """The rotation of URDF's roll, pitch, yaw [rad]: about the fixed x, then y, then z."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def from_quaternion(wxyz: Float[np.ndarray, "4"]) -> Float[np.ndarray, "3 3"]:
    """The rotation of a quaternion in MuJoCo's order (w, x, y, z); its length does not matter."""
    w, x, y, z = wxyz / np.linalg.norm(wxyz)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def turning_z_to(axis: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """A rotation that brings z onto the axis (of any length but zero)."""
    z = axis / np.linalg.norm(axis)
    if z[2] == 1.0:
        return np.eye(3)  # the common case leaves no rounding behind
    helper = np.eye(3)[np.argmin(np.abs(z))]
    x = np.cross(helper, z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def z_motion(motion: float, *, slides: bool) -> Transform:
    """The transform of one axis: a turn about z by motion [rad], or a slide along z by motion [m]."""
    if slides:
        return transform(None, np.array([0.0, 0.0, motion]))
    c, s = np.cos(motion), np.sin(motion)
    return transform(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), np.zeros(3))
