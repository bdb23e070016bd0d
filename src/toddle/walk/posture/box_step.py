"""The step of damped least squares inside its box: min 1/2 d'Hd - g'd, lower <= d <= upper, by an active set.

Bounds that the descent presses against are held, the rest is solved by Cholesky; a step that meets a bound stops there
and holds it; a held bound whose multiplier has the wrong sign is let go (Nocedal and Wright 2006, section 16.5).
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy")
def solve_positive(matrix, right):
    """Solve by Cholesky, in place: the lower triangle becomes the factor, the right side the solution."""
    n = right.shape[0]
    for j in range(n):
        s = matrix[j, j]
        for k in range(j):
            s -= matrix[j, k] * matrix[j, k]
        inverse = 1.0 / np.sqrt(s)
        matrix[j, j] = inverse
        for i in range(j + 1, n):
            s = matrix[i, j]
            for k in range(j):
                s -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = s * inverse
    for i in range(n):
        s = right[i]
        for k in range(i):
            s -= matrix[i, k] * right[k]
        right[i] = s * matrix[i, i]
    for i in range(n - 1, -1, -1):
        s = right[i]
        for k in range(i + 1, n):
            s -= matrix[k, i] * right[k]
        right[i] = s * matrix[i, i]


@njit(cache=True, error_model="numpy")
def slopes(hessian, gradient, d, out):
    """out = gradient - hessian @ d, from the lower triangle."""
    n = d.shape[0]
    for i in range(n):
        out[i] = gradient[i]
    for i in range(n):
        if d[i] != 0.0:
            for j in range(i + 1):
                out[j] -= hessian[i, j] * d[i]
            for j in range(i + 1, n):
                out[j] -= hessian[j, i] * d[i]


@njit(cache=True, error_model="numpy")
def box_step(hessian, gradient, lower, upper):
    """The step.

    Args:
        hessian: positive definite; only its lower triangle is read.
        gradient: the descent direction g.
        lower: at most 0.
        upper: at least 0.

    Returns:
        The step, inside the box, and which bounds hold it: -1 the lower one, 1 the upper one, 0 none.
    """
    n = gradient.shape[0]
    d, slope, part = np.zeros(n), np.empty(n), np.empty(n)
    held, free, square = np.zeros(n, np.int8), np.empty(n, np.int64), np.empty((n, n))
    greatest = 0.0
    for i in range(n):
        greatest = max(greatest, abs(gradient[i]))
        if gradient[i] > 0.0 and upper[i] <= 0.0:
            held[i] = 1
        elif gradient[i] < 0.0 and lower[i] >= 0.0:
            held[i] = -1
    for _ in range(4 * n + 8):
        slopes(hessian, gradient, d, slope)
        count = 0
        for i in range(n):
            if held[i] == 0:
                free[count] = i
                count += 1
        for a in range(count):
            part[a] = slope[free[a]]
            for b in range(a + 1):
                square[a, b] = hessian[free[a], free[b]]
        solve_positive(square[:count, :count], part[:count])
        length, blocking = 1.0, -1
        for a in range(count):
            i = free[a]
            room = upper[i] - d[i] if part[a] > 0.0 else d[i] - lower[i]
            if room < length * abs(part[a]):
                length, blocking = room / abs(part[a]), a
        for a in range(count):
            d[free[a]] += length * part[a]
        if blocking >= 0:
            i = free[blocking]
            held[i] = 1 if part[blocking] > 0.0 else -1
            d[i] = upper[i] if held[i] > 0 else lower[i]
            continue
        if count == n:
            break
        slopes(hessian, gradient, d, slope)
        worst, released = -1e-12 * greatest, -1
        for i in range(n):
            if held[i] != 0 and held[i] * slope[i] < worst:
                worst, released = held[i] * slope[i], i
        if released < 0:
            break
        held[released] = 0
    for i in range(n):
        d[i] = min(max(d[i], lower[i]), upper[i])
    return d, held
