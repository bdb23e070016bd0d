"""Newton's method to the least-squares minimum inside the joint limits: how near a tip comes, or where it may rest.

The merit is half of |e|^2 + pull |u - u*|^2, with e the weighted error of the tip and u the scaled joints. Without pull
it ends where the tip is nearest to a target out of reach; with a small one it slides along the arm's self-motion to
the posture u* and keeps the target. Second derivatives are exact: of a chain they are cross products of the axes'
motions, d2x / dm_a dm_b = w_a x v_b for a <= b (Hourtash 2005), and the squared angle's is known in closed form. The
shift that makes an indefinite Hessian definite follows the outcome (Levenberg-Marquardt); joints that press against a
limit rest (Bertsekas 1982).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from toddle.reach.solve.damped_kernels import KERNEL, Work, miss, place


@njit(**KERNEL)
def curve(arm, rows, angle, work):
    """Fill in half the squared error's Hessian (lower triangle of work.matrix[1]) and its descent, work.joint[1]."""
    columns, twist, error = work.columns, work.twist, work.task[1]
    hessian, descent, along = work.matrix[1], work.joint[1], work.joint[2]
    half = 0.5 * angle
    cotangent = half / np.tan(half) if half > 1e-6 else 1.0
    inverse = 1.0 / (arm.weight[3] * angle) if angle > 1e-12 else 0.0
    for j in range(columns.shape[0]):
        descent[j] = along[j] = 0.0
        for r in range(rows):
            descent[j] += columns[j, r] * error[r]
        for r in range(3, rows):
            along[j] += columns[j, r] * error[r] * inverse
        for i in range(j + 1):
            shifted = turned = 0.0
            for r in range(3):
                shifted += columns[j, r] * columns[i, r]
            for r in range(3, rows):
                turned += columns[j, r] * columns[i, r]
            hessian[j, i] = shifted + cotangent * turned + (1.0 - cotangent) * along[j] * along[i]
    ex, ey, ez = error[0] * arm.weight[0], error[1] * arm.weight[1], error[2] * arm.weight[2]
    weight = 0.5 * arm.weight[3] if rows > 3 else 0.0
    tx, ty, tz = weight * error[3], weight * error[4], weight * error[5]
    for k in range(arm.drives.shape[0]):
        b, j = int(arm.drives[k, 0]), int(arm.drives[k, 1])
        gain = -arm.drives[k, 2] * arm.joints[2, j]
        t = twist[b]
        sx, sy, sz = gain * (t[1] * ez - t[2] * ey), gain * (t[2] * ex - t[0] * ez), gain * (t[0] * ey - t[1] * ex)
        for m in range(arm.drives.shape[0]):
            a, i = int(arm.drives[m, 0]), int(arm.drives[m, 1])
            if a > b:
                continue
            value = twist[a, 3] * sx + twist[a, 4] * sy + twist[a, 5] * sz
            if a < b:
                value += gain * (
                    twist[a, 3] * (t[4] * tz - t[5] * ty)
                    + twist[a, 4] * (t[5] * tx - t[3] * tz)
                    + twist[a, 5] * (t[3] * ty - t[4] * tx)
                )
            value *= arm.drives[m, 2] * arm.joints[2, i]
            if i < j or (i == j and a == b):
                hessian[j, i] += value
            elif i > j and a < b:
                hessian[i, j] += value
            elif i == j:
                hessian[j, j] += 2.0 * value


@njit(**KERNEL)
def factored(matrix, shift, right, out):
    """Solve (matrix[1] + shift) x = right by Cholesky, into out; False where that isn't positive definite."""
    hessian, factor = matrix[1], matrix[0]
    n = right.shape[0]
    for j in range(n):
        s = hessian[j, j] + shift
        for k in range(j):
            s -= factor[j, k] * factor[j, k]
        if not s > 1e-10:
            return False
        inverse = 1.0 / np.sqrt(s)
        factor[j, j] = inverse
        for i in range(j + 1, n):
            s = hessian[i, j]
            for k in range(j):
                s -= factor[i, k] * factor[j, k]
            factor[i, j] = s * inverse
        s = right[j]
        for k in range(j):
            s -= factor[j, k] * out[k]
        out[j] = s * inverse
    for i in range(n - 1, -1, -1):
        s = out[i]
        for k in range(i + 1, n):
            s -= factor[k, i] * out[k]
        out[i] = s * factor[i, i]
    return True


@njit(**KERNEL)
def settle(arm, targets, rows, towards, pull, found):
    """Move joint values to the minima of the merit, each from where it is.

    Args:
        arm: the arm.
        targets: (batch, 12) position [m] and rotation, row by row.
        rows: 3: only the position counts; 6: the pose.
        towards: (batch, joints) the posture u* for each target.
        pull: its weight [m^2].
        found: (batch, joints + 2) joint values, changed; distance [m] and angle [rad] there, filled in.
    """
    axes, n = arm.axes.shape[0], arm.joints.shape[1]
    size = max(6, n)
    work = Work(np.empty((axes, 6)), np.empty((n, 6)), np.empty((2, size, size)), np.empty((3, 12)), np.empty((4, n)))
    lower, upper, scale = arm.joints[0], arm.joints[1], arm.joints[2]
    move, descent, q, hessian = work.joint[0], work.joint[1], work.joint[3], work.matrix[1]
    for b in range(targets.shape[0]):
        target, toward, kept = targets[b], towards[b], found[b]
        best, shift, part = np.inf, 0.0, 0.0
        for j in range(n):
            move[j] = 0.0
        for _ in range(100):
            total = 0.0
            for j in range(n):
                q[j] = min(max(kept[j] + part * move[j] * scale[j], lower[j]), upper[j])
                total += pull * ((toward[j] - q[j]) / scale[j]) ** 2
            place(arm, q, work)
            squared, angle = miss(arm, target, rows, work)
            total += squared + (arm.weight[3] * angle) ** 2
            if total < best:
                small = best - total <= 1e-9 * total or total < 1e-14
                best, kept[n], kept[n + 1] = total, np.sqrt(squared), angle
                for j in range(n):
                    kept[j] = q[j]
                if small:
                    break
                curve(arm, rows, angle, work)
                shift = 0.1 * shift if shift > 1e-8 else 0.0
                for j in range(n):
                    descent[j] += pull * (toward[j] - q[j]) / scale[j]
                    hessian[j, j] += pull
                for j in range(n):
                    if (q[j] <= lower[j] and descent[j] < 0.0) or (q[j] >= upper[j] and descent[j] > 0.0):
                        descent[j] = 0.0
                        for i in range(n):
                            hessian[max(i, j), min(i, j)] = 0.0
                        hessian[j, j] = 1.0
            else:
                shift = max(4.0 * shift, 1e-3 * best + 1e-9)
            while not factored(work.matrix, shift, descent, move):
                shift = max(4.0 * shift, 1e-3 * best + 1e-6)
            largest = 0.0
            for j in range(n):
                largest = max(largest, abs(move[j] * scale[j]))
            if largest < 1e-9:
                break
            part = min(1.0, 0.7 / largest)
