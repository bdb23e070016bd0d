"""One arm, one target, one start: damped least squares inside the joint limits, a microsecond a step.

Each step solves (J J' + lambda I) y = e and moves the joints by J' y, with e the weighted error of the tip, J its
geometric Jacobian and lambda = 0.02 |e|^2 + 1e-9 (Wampler 1986; Nakamura and Hanafusa 1986; the damping that follows
the error: Sugihara 2011). A joint that a step would carry past a limit stops there, and the others take over what it
leaves undone. A start whose error stops falling is given up at once: the next one is cheaper than its last tenth.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

KERNEL = {"cache": True, "error_model": "numpy", "no_cfunc_wrapper": True}  # no door for C: a tenth less to compile


class Arm(NamedTuple):
    """What the kernels know of an arm.

    Attributes:
        before: (axes + 1, 12) constant transforms, the tip's last: upper three rows, row by row [m].
        axes: (axes, 2) motion when all joints are zero [rad or m]; 1.0 where the axis slides.
        drives: (drives, 3) which axis, by which joint, with what gain.
        joints: (5, joints) lower and upper limit, scale (its range over the mean range), middle, and the turn after
            which the arm is in the same posture again, 0 for none [rad or m].
        weight: (6,) of the errors: 1 or 0 for x, y, z, and metres that a radian counts for.
        postures: (postures, joints) stored starts [rad or m].
        places: (12, postures) where they put the tip: x, y, z [m] and the rotation row by row, in float32.
        within: (2,) what counts as reached [m], [rad].
    """

    before: np.ndarray
    axes: np.ndarray
    drives: np.ndarray
    joints: np.ndarray
    weight: np.ndarray
    postures: np.ndarray
    places: np.ndarray
    within: np.ndarray


class Work(NamedTuple):
    """Where the kernels compute.

    Attributes:
        twist: (axes, 6) each axis' motion of the tip: shift and turn.
        columns: (joints, 6) each joint's, weighted and scaled.
        matrix: (2, m, m) normal equations and their factor, m = max(6, joints).
        task: (3, 12) pose of the tip, its error, a right side.
        joint: (4, joints) a step, two gradients or flags, a posture kept.
    """

    twist: np.ndarray
    columns: np.ndarray
    matrix: np.ndarray
    task: np.ndarray
    joint: np.ndarray


@njit(**KERNEL)
def place(arm, q, work):
    """The tip's pose and its Jacobian."""
    twist, columns, pose = work.twist, work.columns, work.task[0]
    axes = twist.shape[0]
    for i in range(axes):
        twist[i, 0] = arm.axes[i, 0]
    for k in range(arm.drives.shape[0]):
        twist[int(arm.drives[k, 0]), 0] += arm.drives[k, 2] * q[int(arm.drives[k, 1])]
    for r in range(12):
        pose[r] = 1.0 if r % 4 == 3 else 0.0
    for i in range(axes + 1):
        b = arm.before[i]
        slides, motion, cos, sin = 0.0, 0.0, 1.0, 0.0
        if i < axes:
            slides, motion = arm.axes[i, 1], twist[i, 0]
            if slides == 0.0:
                cos, sin = np.cos(motion), np.sin(motion)
        for r in range(3):  # row by row: position, and what the frame's axes have in x, y or z
            k = 3 + 3 * r
            x, y, z = pose[k], pose[k + 1], pose[k + 2]
            ahead = x * b[2] + y * b[6] + z * b[10]
            pose[r] += x * b[3] + y * b[7] + z * b[11] + slides * motion * ahead
            x, y = x * b[0] + y * b[4] + z * b[8], x * b[1] + y * b[5] + z * b[9]
            pose[k], pose[k + 1], pose[k + 2] = cos * x + sin * y, cos * y - sin * x, ahead
            if i < axes:
                twist[i, r], twist[i, 3 + r] = pose[r], ahead
    for j in range(columns.shape[0]):
        for r in range(6):
            columns[j, r] = 0.0
    for i in range(axes):
        t = twist[i]
        if arm.axes[i, 1] != 0.0:
            t[0], t[1], t[2] = t[3], t[4], t[5]
            t[3] = t[4] = t[5] = 0.0
        else:
            x, y, z = pose[0] - t[0], pose[1] - t[1], pose[2] - t[2]
            t[0], t[1], t[2] = t[4] * z - t[5] * y, t[5] * x - t[3] * z, t[3] * y - t[4] * x
    for k in range(arm.drives.shape[0]):
        i, j = int(arm.drives[k, 0]), int(arm.drives[k, 1])
        gain = arm.drives[k, 2] * arm.joints[2, j]
        for r in range(6):
            columns[j, r] += gain * arm.weight[r] * twist[i, r]


@njit(**KERNEL)
def miss(arm, target, rows, work):
    """Fill in the weighted error; returns the squared distance [m^2] and the angle [rad] between tip and target."""
    pose, error = work.task[0], work.task[1]
    squared = 0.0
    for r in range(3):
        error[r] = arm.weight[r] * (target[r] - pose[r])
        squared += error[r] * error[r]
    if rows == 3:
        return squared, 0.0
    x = y = z = trace = 0.0
    for k in range(3, 6):
        ax, ay, az = pose[k], pose[k + 3], pose[k + 6]
        bx, by, bz = target[k], target[k + 3], target[k + 6]
        x += ay * bz - az * by
        y += az * bx - ax * bz
        z += ax * by - ay * bx
        trace += ax * bx + ay * by + az * bz
    sine = 0.5 * np.sqrt(x * x + y * y + z * z)
    angle = np.arctan2(sine, 0.5 * (trace - 1.0))
    if sine > 1e-9:
        size = 0.5 * angle / sine * arm.weight[3]
        error[3], error[4], error[5] = size * x, size * y, size * z
    else:
        error[3], error[4], error[5] = angle * arm.weight[3], 0.0, 0.0  # half a turn: any axis leads off
    return squared, angle


@njit(**KERNEL)
def step(arm, q, rows, damping, work):
    """Fill in the damped step within the limits, work.joint[0]; returns its largest part [rad or m]."""
    columns, matrix = work.columns, work.matrix[0]
    error, right = work.task[1], work.task[2]
    move, free = work.joint[0], work.joint[1]
    lower, upper, scale = arm.joints[0], arm.joints[1], arm.joints[2]
    n = q.shape[0]
    for j in range(n):
        free[j] = 1.0
    for _ in range(n):
        for r in range(rows):
            right[r] = error[r]
            for c in range(r):
                matrix[r, c] = 0.0
            matrix[r, r] = damping
        for j in range(n):
            if free[j] != 0.0:
                for r in range(rows):
                    value = columns[j, r]
                    for c in range(r + 1):
                        matrix[r, c] += value * columns[j, c]
        for j in range(rows):
            s = matrix[j, j]
            for k in range(j):
                s -= matrix[j, k] * matrix[j, k]
            inverse = 1.0 / np.sqrt(max(s, damping))  # no pivot is smaller, but for rounding
            matrix[j, j] = inverse
            for i in range(j + 1, rows):
                s = matrix[i, j]
                for k in range(j):
                    s -= matrix[i, k] * matrix[j, k]
                matrix[i, j] = s * inverse
            s = right[j]
            for k in range(j):
                s -= matrix[j, k] * right[k]
            right[j] = s * inverse
        for i in range(rows - 1, -1, -1):
            s = right[i]
            for k in range(i + 1, rows):
                s -= matrix[k, i] * right[k]
            right[i] = s * matrix[i, i]
        stopped = False
        for j in range(n):
            if free[j] != 0.0:
                s = 0.0
                for r in range(rows):
                    s += columns[j, r] * right[r]
                move[j] = s * scale[j]
                end = min(max(q[j] + move[j], lower[j]), upper[j])
                if end != q[j] + move[j]:
                    stopped = True
                    free[j] = 0.0
                    move[j] = end - q[j]
                    for r in range(rows):
                        error[r] -= move[j] / scale[j] * columns[j, r]
        if not stopped:
            break
    largest = 0.0
    for j in range(n):
        largest = max(largest, abs(move[j]))
    return largest


@njit(**KERNEL)
def descend(arm, target, rows, q, work):
    """Move q to the target; returns the squared distance [m^2], the angle [rad], and whether it is reached."""
    last, idle, rounds = np.inf, 0, 0
    while True:
        place(arm, q, work)
        squared, angle = miss(arm, target, rows, work)
        if squared <= arm.within[0] * arm.within[0] and angle <= arm.within[1]:
            return squared, angle, True
        total = squared + (arm.weight[3] * angle) ** 2
        idle = idle + 1 if total > 0.8 * last else 0
        rounds += 1
        if idle == 2 or rounds == 15:
            return squared, angle, False
        last = total
        largest = step(arm, q, rows, 0.02 * total + 1e-9, work)
        part = min(1.0, 0.7 / largest)
        for j in range(q.shape[0]):
            q[j] = min(max(q[j] + part * work.joint[0, j], arm.joints[0, j]), arm.joints[1, j])
