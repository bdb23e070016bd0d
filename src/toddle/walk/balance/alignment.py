"""The body's place in the plan's frame, compiled: forward kinematics aligned through the soles that carry."""

from __future__ import annotations

import math

import numpy as np
from numba import njit


@njit(cache=True)
def multiply(a, b, out):
    """``out`` = a b, of two 3 x 3 matrices."""
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@njit(cache=True)
def apply(rotation, vector, out):
    """``out`` = rotation vector."""
    for i in range(3):
        out[i] = rotation[i, 0] * vector[0] + rotation[i, 1] * vector[1] + rotation[i, 2] * vector[2]


@njit(cache=True)
def angles(rotation, out):
    """Roll, pitch and yaw: about x, then y, then z, all of the frame outside."""
    out[0] = math.atan2(rotation[2, 1], rotation[2, 2])
    out[1] = math.atan2(-rotation[2, 0], math.hypot(rotation[2, 1], rotation[2, 2]))
    out[2] = math.atan2(rotation[1, 0], rotation[0, 0])


@njit(cache=True)
def matrix(quaternion, out):
    """The rotation of a quaternion (w, x, y, z) of any length."""
    w, x, y, z = quaternion
    s = 2.0 / (w * w + x * x + y * y + z * z)
    out[0, 0], out[0, 1], out[0, 2] = 1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)
    out[1, 0], out[1, 1], out[1, 2] = s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)
    out[2, 0], out[2, 1], out[2, 2] = s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)


@njit(cache=True)
def quaternion(m, out):
    """The unit quaternion of a rotation, w not negative; through its largest component (Shepperd 1978)."""
    w, x = 1 + m[0, 0] + m[1, 1] + m[2, 2], 1 + m[0, 0] - m[1, 1] - m[2, 2]
    y, z = 1 - m[0, 0] + m[1, 1] - m[2, 2], 1 - m[0, 0] - m[1, 1] + m[2, 2]
    wx, wy, wz = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    xy, xz, yz = m[1, 0] + m[0, 1], m[0, 2] + m[2, 0], m[2, 1] + m[1, 2]
    if w >= max(x, y, z):
        out[0], out[1], out[2], out[3] = w, wx, wy, wz
    elif x >= max(y, z):
        out[0], out[1], out[2], out[3] = wx, x, xy, xz
    elif y >= z:
        out[0], out[1], out[2], out[3] = wy, xy, y, yz
    else:
        out[0], out[1], out[2], out[3] = wz, xz, yz, z
    length = math.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2 + out[3] ** 2)
    if out[0] < 0:
        length = -length
    for i in range(4):
        out[i] /= length


@njit(cache=True)
def align(orientation, com, soles_p, soles_R, waist_R, imu_R, anchors, shares):
    """The robot put where its soles are planned to stand.

    Args:
        orientation: of the inertial unit against the vertical, its yaw unknown, (w, x, y, z).
        com: centre of mass with body 0 at the origin, unturned [m]; so are the next four.
        soles_p: the soles' places [m].
        soles_R: their rotations.
        waist_R: of the waist.
        imu_R: of the inertial unit.
        anchors: where the soles stand by the plan: x, y, z [m] and yaw [rad].
        shares: how much each of them counts; they add up to 1.

    Returns:
        Body 0's place and quaternion (7), the centre of mass, the soles (2, 4), their roll and pitch, their
        rotations, and the waist's roll, pitch and yaw.
    """
    world, leaning, rotation, turn = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.zeros((3, 3))
    matrix(orientation, world)
    multiply(world, imu_R.T, leaning)
    yaw = 0.0
    for foot in range(2):
        multiply(leaning, soles_R[foot], rotation)
        error = anchors[foot, 3] - math.atan2(rotation[1, 0], rotation[0, 0])
        yaw += shares[foot] * math.atan2(math.sin(error), math.cos(error))
    turn[0, 0], turn[0, 1], turn[1, 0], turn[1, 1], turn[2, 2] = (
        math.cos(yaw),
        -math.sin(yaw),
        math.sin(yaw),
        math.cos(yaw),
        1.0,
    )
    multiply(turn, leaning, rotation)
    base, at, place = np.zeros(7), np.empty(3), np.empty((2, 3))
    for foot in range(2):
        apply(rotation, soles_p[foot], place[foot])
        for i in range(3):
            base[i] += shares[foot] * (anchors[foot, i] - place[foot, i])
    quaternion(rotation, base[3:])
    soles, tilt, turned, three = np.empty((2, 4)), np.empty((2, 2)), np.empty((2, 3, 3)), np.empty(3)
    for foot in range(2):
        multiply(rotation, soles_R[foot], turned[foot])
        angles(turned[foot], three)
        soles[foot, :3] = place[foot] + base[:3]
        soles[foot, 3] = three[2]
        tilt[foot] = three[:2]
    apply(rotation, com, at)
    multiply(rotation, waist_R, world)
    angles(world, three)
    return base, at + base[:3], soles, tilt, turned, three
