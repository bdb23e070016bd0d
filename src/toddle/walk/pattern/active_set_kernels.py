"""Least-distance problems by a dual active set, compiled: many small ones, without Python between them.

    min |u|^2 / 2 + sum e_i^2 / (2 slack_i)   with   low - e <= M u <= high + e,   e = 0 for hard rows

The method of DAQP (Arnstrom, Bemporad, Axehill 2022, algorithm 1). With W the active rows and b their bounds,

    (M_W M_W' + slack) l = -b,   u = -M_W' l,   l >= 0 at an upper bound, l <= 0 at a lower one

begins with W empty; the most violated row comes in, and rows leave whose multiplier l would change its sign. The
products of an active row with all others are kept, so that looking for violated rows takes one product by W. The
Cholesky factor grows by a row, and is made anew from where a row has left.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

SOLVED, INFEASIBLE = 0, 1
CHANGES = 500  # of the active set at most; most problems take fewer than ten
NEAR = 1e-9  # by so much a row may be violated, scaled to length 1
DEPENDENT = 1e-11  # a hard row of which no more is left (squared) depends on the active ones


@njit(cache=True, fastmath={"reassoc", "contract"})
def products(matrix, row, out):
    """Of a row with each row of a matrix."""
    for i in range(matrix.shape[0]):
        total = 0.0
        for j in range(matrix.shape[1]):
            total += matrix[i, j] * matrix[row, j]
        out[i] = total


@njit(cache=True)
def factor(root, gram, active, slack, first, count):
    """Rows ``first`` to ``count`` of the Cholesky factor; whether the last one depends on those before."""
    pivot = 1.0
    for k in range(first, count):
        row = active[k]
        for j in range(k):
            total = gram[k, active[j]]
            for t in range(j):
                total -= root[k, t] * root[j, t]
            root[k, j] = total / root[j, j]
        own = gram[k, row] + slack[row]
        pivot = own
        for t in range(k):
            pivot -= root[k, t] * root[k, t]
        pivot /= own
        root[k, k] = math.sqrt(max(pivot, DEPENDENT) * own)
    return pivot <= DEPENDENT


@njit(cache=True)
def multipliers(root, bound, count, out):
    """Of the active rows, by the factor."""
    for k in range(count):
        total = -bound[k]
        for t in range(k):
            total -= root[k, t] * out[t]
        out[k] = total / root[k, k]
    back(root, count, out)


@njit(cache=True)
def back(root, count, out):
    """By the factor's transpose, in place."""
    for k in range(count - 1, -1, -1):
        total = out[k]
        for t in range(k + 1, count):
            total -= root[t, k] * out[t]
        out[k] = total / root[k, k]


@njit(cache=True)
def most_violated(values, low, high, lengths, matrix):
    """The row, and whether its upper bound is violated; -1: none."""
    worst, found, upper = NEAR, -1, False
    for i in range(values.shape[0]):
        over, under = values[i] - high[i], low[i] - values[i]
        beyond = max(over, under)
        if beyond > 0.0:
            if lengths[i] < 0.0:
                total = 0.0
                for j in range(matrix.shape[1]):
                    total += matrix[i, j] * matrix[i, j]
                lengths[i] = math.sqrt(total)
            if beyond > worst * lengths[i]:
                worst = beyond / max(lengths[i], 1e-300)
                found, upper = i, over > under
    return found, upper


@njit(cache=True)
def nearest(matrix, low, high, marks, slack, u):
    """Writes the point nearest to zero that keeps the rows to ``u``; arguments as in `quadratic.least_distance`."""
    rows, wide = matrix.shape
    u[:] = 0.0
    values, lengths = np.zeros(rows), np.full(rows, -1.0)
    row, upper = most_violated(values, low, high, lengths, matrix)
    if row < 0:
        return SOLVED
    most = wide + 1
    for i in range(rows):
        if marks[i] != 0:
            most += 1
    most = min(most, rows)
    gram, root = np.empty((most, rows)), np.empty((most, most))
    active, side = np.empty(most, np.int64), np.empty(most)
    bound, at, towards = np.empty(most), np.empty(most), np.empty(most)
    softness = np.where(marks == 0, 0.0, slack)
    count, singular = 0, False
    for _ in range(CHANGES):
        if row >= 0:
            if count == most or lengths[row] < 1e-12:
                return INFEASIBLE
            active[count] = row
            side[count] = 1.0 if upper else -1.0
            bound[count] = high[row] if upper else low[row]
            at[count] = 0.0
            products(matrix, row, gram[count])
            singular = factor(root, gram, active, softness, count, count + 1)
            count += 1
            row = -1
        if singular:  # along this direction only the multipliers change, until one of them is 0
            last = count - 1
            for k in range(last):
                towards[k] = -side[last] * root[last, k]
            back(root, last, towards)
            towards[last] = side[last]
        else:
            multipliers(root, bound, count, towards)
            for k in range(count):
                towards[k] -= at[k]
        share, leaves = (np.inf if singular else 1.0), -1
        for k in range(count):
            speed = side[k] * towards[k]
            if speed < 0.0 and high[active[k]] > low[active[k]] and side[k] * at[k] < share * -speed:
                share, leaves = -side[k] * at[k] / speed, k
        if singular and leaves < 0:
            return INFEASIBLE
        for k in range(count):
            at[k] += share * towards[k]
        if leaves >= 0:
            count -= 1
            for k in range(leaves, count):
                active[k], side[k], bound[k], at[k] = active[k + 1], side[k + 1], bound[k + 1], at[k + 1]
                gram[k] = gram[k + 1]
            singular = factor(root, gram, active, softness, leaves, count)
            continue
        values[:] = 0.0
        for k in range(count):
            for i in range(rows):
                values[i] -= at[k] * gram[k, i]
        for k in range(count):  # but for rounding, and for what a soft row exceeds
            values[active[k]] = bound[k]
        row, upper = most_violated(values, low, high, lengths, matrix)
        if row < 0:
            for k in range(count):
                for j in range(wide):
                    u[j] -= at[k] * matrix[active[k], j]
            return SOLVED
    return INFEASIBLE
