"""The 21 tasks of a posture, compiled: their errors, how these fall with each variable, the normal equations.

Three rows each: centre of mass [m], left sole [m], its rotation, right sole [m], its rotation, waist, chest [rad].
Positions are in the world; a rotation errs by the logarithm of R' R_target, in the frame's own axes, and its derivative
is exact. Variables are the base's velocity in MuJoCo's order, then the joints that move.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from toddle.walk.posture.kernels import cross

ROWS = 21
WEIGHTS_AT = 45
"""A target is CoM (3), soles (2 x 3), rotations of the soles, the waist and the chest (4 x 9), weights (21)."""


@njit(cache=True, error_model="numpy")
def logarithm(rotation, target, out):
    """out: the rotation vector of rotation' @ target [rad]."""
    r = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            r[i, j] = rotation[0, i] * target[0, j] + rotation[1, i] * target[1, j] + rotation[2, i] * target[2, j]
    out[0], out[1], out[2] = 0.5 * (r[2, 1] - r[1, 2]), 0.5 * (r[0, 2] - r[2, 0]), 0.5 * (r[1, 0] - r[0, 1])
    sine = np.sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2])
    cosine = 0.5 * (r[0, 0] + r[1, 1] + r[2, 2] - 1.0)
    angle = np.arctan2(sine, cosine)
    if sine > 1e-5:
        for i in range(3):
            out[i] *= angle / sine
    elif cosine < 0.0:  # half a turn: r is 2 n n' - 1
        k = 0
        for i in range(1, 3):
            if r[i, i] > r[k, k]:
                k = i
        length, along = 0.0, 0.0
        for i in range(3):
            r[i, k] += 1.0 if i == k else 0.0
            length += r[i, k] * r[i, k]
            along += r[i, k] * out[i]
        for i in range(3):
            out[i] = (angle if along >= 0.0 else -angle) * r[i, k] / np.sqrt(length)


@njit(cache=True, error_model="numpy")
def turning(error, rotation, out):
    """out: how fast the logarithm falls with a turning of the frame in the world: J_l^-1(error) rotation'."""
    x, y, z = error[0], error[1], error[2]
    square = x * x + y * y + z * z
    if square < 1e-8:
        c = 1.0 / 12.0
    else:
        half = 0.5 * np.sqrt(square)
        c = (1.0 - half / np.tan(half)) / square
    inverse = np.empty((3, 3))
    inverse[0, 0], inverse[0, 1], inverse[0, 2] = 1 - c * (y * y + z * z), c * x * y + z / 2, c * x * z - y / 2
    inverse[1, 0], inverse[1, 1], inverse[1, 2] = c * x * y - z / 2, 1 - c * (x * x + z * z), c * y * z + x / 2
    inverse[2, 0], inverse[2, 1], inverse[2, 2] = c * x * z + y / 2, c * y * z - x / 2, 1 - c * (x * x + y * y)
    for i in range(3):
        for j in range(3):
            out[i, j] = inverse[i, 0] * rotation[j, 0] + inverse[i, 1] * rotation[j, 1] + inverse[i, 2] * rotation[j, 2]


@njit(cache=True, error_model="numpy")
def task_errors(target, com, at, facing, errors):
    """The 21 errors: centre of mass, left sole and its turn, right sole and its turn, waist, chest."""
    for i in range(3):
        errors[i] = target[i] - com[i]
        errors[3 + i] = target[3 + i] - at[0, i]
        errors[9 + i] = target[6 + i] - at[1, i]
    for f in range(4):
        row = 6 + 6 * f if f < 2 else 9 + 3 * f
        logarithm(facing[f], target[9 + 9 * f : 18 + 9 * f].reshape(3, 3), errors[row : row + 3])


@njit(cache=True, error_model="numpy")
def task_columns(skeleton, placed, at, facing, errors, columns):
    """Fills one row for each variable: how the 21 tasks move with it."""
    p, rotations, axes, anchors, levers, com, _ = placed
    maps, axis, arm = np.empty((4, 3, 3)), np.empty(3), np.empty(3)
    columns[:] = 0.0
    for f in range(4):
        row = 6 + 6 * f if f < 2 else 9 + 3 * f
        turning(errors[row : row + 3], facing[f], maps[f])
    for k in range(6 + axes.shape[0]):
        joint = k - 6
        if k < 3:
            columns[k, k] = columns[k, 3 + k] = columns[k, 9 + k] = 1.0
            continue
        if k < 6:
            var = k
            for j in range(3):
                axis[j], arm[j] = rotations[0, j, k - 3], com[j] - p[0, j]
        else:
            var = skeleton.variable[joint]
            if var < 0:
                continue
            axis[:] = axes[joint]
            arm[:] = levers[joint]
        column = columns[var]
        cross(axis, arm, column[0:3])
        for f in range(4):
            if k >= 6 and not skeleton.chain[f, joint]:
                continue
            row = 6 + 6 * f if f < 2 else 9 + 3 * f
            for i in range(3):
                column[row + i] = maps[f, i, 0] * axis[0] + maps[f, i, 1] * axis[1] + maps[f, i, 2] * axis[2]
            if f < 2:
                for j in range(3):
                    arm[j] = at[f, j] - (p[0, j] if k < 6 else anchors[joint, j])
                cross(axis, arm, column[row - 3 : row])


@njit(cache=True, error_model="numpy")
def normal_equations(skeleton, target, pull, q, errors, columns, hessian, gradient):
    """J'WJ + pull and J'We - pull (joints - home); only the columns that a task moves are multiplied."""
    n = gradient.shape[0]
    hessian[:] = 0.0
    gradient[:] = 0.0
    scaled = np.empty(6)
    for group in range(5):
        first = 0 if group == 0 else 6 * group - 3 if group < 3 else 3 * group + 6
        size = 6 if group == 1 or group == 2 else 3
        for a in range(n):
            i = skeleton.support[group, a]
            if i < 0:
                break
            for r in range(size):
                scaled[r] = target[WEIGHTS_AT + first + r] * columns[i, first + r]
                gradient[i] += scaled[r] * errors[first + r]
            for b in range(a + 1):
                j = skeleton.support[group, b]
                s = 0.0
                for r in range(size):
                    s += scaled[r] * columns[j, first + r]
                hessian[i, j] += s
    for joint in range(skeleton.lower.shape[0]):
        i = skeleton.variable[joint]
        if i >= 0:
            hessian[i, i] += pull
            gradient[i] -= pull * (q[7 + joint] - skeleton.home[joint])
