"""Compiled inverse kinematics: damped Gauss-Newton steps on the tasks' errors (Huber 2019, eq. 2.112-2.113).

The cost is 1/2 sum w e^2 + pull/2 |joints - home|^2. The damping is the least one plus a tenth of the cost (after
Sugihara 2011, whose damping is the cost), so that a target out of reach is neared without swinging; a step that would
raise the cost is damped more and tried again.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from toddle.walk.posture.box_step import box_step
from toddle.walk.posture.kernels import place, place_frames
from toddle.walk.posture.tasks import ROWS, WEIGHTS_AT, normal_equations, task_columns, task_errors

LONGEST = 0.5
"""No component of one step is longer [m or rad]."""
RETRIES = 12
"""Steps tried, each damped more, before the descent gives up."""
RELEASED = 0.1
"""A row whose weight is under this part of its task's greatest is free to err."""


@njit(cache=True, error_model="numpy")
def cost_of(skeleton, target, pull, q, errors):
    """Half the weighted squares of the errors, and of the distance from home."""
    cost = 0.0
    for i in range(ROWS):
        cost += 0.5 * target[WEIGHTS_AT + i] * errors[i] * errors[i]
    for joint in range(skeleton.lower.shape[0]):
        if skeleton.variable[joint] >= 0:
            away = q[7 + joint] - skeleton.home[joint]
            cost += 0.5 * pull * away * away
    return cost


@njit(cache=True, error_model="numpy")
def moved(skeleton, q, d, out):
    """out: the configuration after a step; the base turns by the exponential, in its own axes."""
    for i in range(3):
        out[i] = q[i] + d[i]
    angle = np.sqrt(d[3] * d[3] + d[4] * d[4] + d[5] * d[5])
    w = np.cos(0.5 * angle)
    k = 0.5 if angle < 1e-9 else np.sin(0.5 * angle) / angle
    x, y, z = k * d[3], k * d[4], k * d[5]
    a, b, c, e = q[3], q[4], q[5], q[6]
    out[3], out[4] = a * w - b * x - c * y - e * z, a * x + b * w + c * z - e * y
    out[5], out[6] = a * y - b * z + c * w + e * x, a * z + b * y - c * x + e * w
    length = np.sqrt(out[3] ** 2 + out[4] ** 2 + out[5] ** 2 + out[6] ** 2)
    for i in range(3, 7):
        out[i] /= length
    for joint in range(skeleton.lower.shape[0]):
        var = skeleton.variable[joint]
        out[7 + joint] = q[7 + joint]
        if var >= 0:
            out[7 + joint] = min(max(q[7 + joint] + d[var], skeleton.lower[joint]), skeleton.upper[joint])


@njit(cache=True, error_model="numpy")
def room(skeleton, q, lower, upper):
    """How far each variable may step: to its joint's limits, and never far."""
    lower[:] = -LONGEST
    upper[:] = LONGEST
    for joint in range(skeleton.lower.shape[0]):
        i = skeleton.variable[joint]
        if i >= 0:
            lower[i] = max(skeleton.lower[joint] - q[7 + joint], -LONGEST)
            upper[i] = min(skeleton.upper[joint] - q[7 + joint], LONGEST)


@njit(cache=True, error_model="numpy")
def missed(target, errors, metres, radians, out):
    """out: by how much each of the seven tasks is missed, released rows left out; returns whether none is by much."""
    met = True
    for task in range(ROWS // 3):
        greatest, square = 0.0, 0.0
        for i in range(3 * task, 3 * task + 3):
            greatest = max(greatest, target[WEIGHTS_AT + i])
        for i in range(3 * task, 3 * task + 3):
            weight = target[WEIGHTS_AT + i]
            if weight > 0.0 and weight >= RELEASED * greatest:
                square += errors[i] * errors[i]
        out[task] = np.sqrt(square)
        met = met and out[task] <= (metres if task == 0 or task == 1 or task == 3 else radians)
    return met


@njit(cache=True, error_model="numpy")
def descend(skeleton, start, target, damping, pull, metres, radians, iterations):
    """Up to ``iterations`` steps; fewer when one is shorter than 1e-8 or gains less than 1e-10 of the cost.

    Args:
        skeleton: the robot.
        start: configuration to start from; joints that move and are beyond their limits are first set to them.
        target: as told in `toddle.walk.posture.tasks`.
        damping: the least one.
        pull: weight of the distance from home.
        metres: how far a position may miss and count as met.
        radians: the same of a rotation.
        iterations: steps allowed.

    Returns:
        The configuration; by how much each task is missed; whether all are met; the steepest slopes of the cost that
        no limit blocks and that a limit blocks (0 when all are met); which joints that move are at a limit; steps made.
    """
    joints, n = skeleton.lower.shape[0], 6
    for joint in range(joints):
        if skeleton.variable[joint] >= 0:
            n += 1
    q, tried = np.empty(start.shape[0]), np.empty(start.shape[0])
    errors, errors_tried = np.empty(ROWS), np.empty(ROWS)
    columns, hessian, gradient = np.empty((n, ROWS)), np.empty((n, n)), np.empty(n)
    lower, upper = np.empty(n), np.empty(n)
    moved(skeleton, start, np.zeros(n), q)
    placed = place(skeleton, q)
    at, facing = place_frames(skeleton, placed[0], placed[1])
    task_errors(target, placed[5], at, facing, errors)
    cost = cost_of(skeleton, target, pull, q, errors)
    steps, extra, going = 0, 0.1 * cost, True
    while going and steps < iterations:
        task_columns(skeleton, placed, at, facing, errors, columns)
        normal_equations(skeleton, target, pull, q, errors, columns, hessian, gradient)
        room(skeleton, q, lower, upper)
        added, going = 0.0, False
        for _ in range(RETRIES):
            for i in range(n):
                hessian[i, i] += damping + extra - added
            added = damping + extra
            d, _ = box_step(hessian, gradient, lower, upper)
            moved(skeleton, q, d, tried)
            placed_tried = place(skeleton, tried)
            at_tried, facing_tried = place_frames(skeleton, placed_tried[0], placed_tried[1])
            task_errors(target, placed_tried[5], at_tried, facing_tried, errors_tried)
            cost_tried = cost_of(skeleton, target, pull, tried, errors_tried)
            if np.isfinite(cost) and cost_tried <= cost * (1.0 + 1e-12) + 1e-20:
                going = np.max(np.abs(d)) > 1e-8 and cost - cost_tried > 1e-10 * cost
                q[:] = tried
                errors[:] = errors_tried
                cost, placed, at, facing = cost_tried, placed_tried, at_tried, facing_tried
                extra = min(0.2 * extra, 0.1 * cost)
                steps += 1
                break
            extra = 5.0 * extra + damping
    misses, limited, steepest, blocked = np.empty(ROWS // 3), np.zeros(joints, np.bool_), 0.0, 0.0
    met = missed(target, errors, metres, radians, misses)
    room(skeleton, q, lower, upper)
    for joint in range(joints):
        i = skeleton.variable[joint]
        limited[joint] = i >= 0 and (lower[i] > -1e-9 or upper[i] < 1e-9)
    if not met:
        task_columns(skeleton, placed, at, facing, errors, columns)
        normal_equations(skeleton, target, pull, q, errors, columns, hessian, gradient)
        for i in range(n):
            if (gradient[i] > 0.0 and upper[i] > 1e-9) or (gradient[i] < 0.0 and lower[i] < -1e-9):
                steepest = max(steepest, abs(gradient[i]))
            else:
                blocked = max(blocked, abs(gradient[i]))
    return q, misses, met, steepest, blocked, limited, steps
