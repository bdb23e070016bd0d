"""Which start: the stored postures whose tip is nearest to the target first, the next one where a start failed."""

from __future__ import annotations

import numpy as np
from numba import njit

from toddle.reach.solve.damped_kernels import KERNEL, Work, descend

REACHED, FAILED, UNUSED, REFUSED = 1.0, 0.0, -1.0, -2.0


@njit(**KERNEL)
def survey(arm, target, rows, near, pull, far):
    """How far each stored posture puts the tip from the target, and is from ``near``: squared [m^2], but a constant."""
    count = far.shape[0]
    for i in range(count):
        far[i] = 0.0
    for r in range(3):
        value, weight = np.float32(target[r]), np.float32(arm.weight[r])
        for i in range(count):
            shift = arm.places[r, i] - value
            far[i] += weight * shift * shift
    for r in range(3, 12 if rows > 3 else 3):
        value = np.float32(target[r] * arm.weight[3] * arm.weight[3])
        for i in range(count):
            far[i] -= value * arm.places[r, i]
    for j in range(near.shape[0] if pull > 0.0 else 0):
        value, weight = near[j], pull / (arm.joints[1, j] - arm.joints[0, j]) ** 2
        for i in range(count):
            far[i] += weight * (arm.postures[i, j] - value) ** 2


@njit(**KERNEL)
def least(values):
    """Where the least value is."""
    at = 0
    for i in range(values.shape[0]):
        if values[i] < values[at]:
            at = i
    return at


@njit(**KERNEL)
def usable(target, rows):
    """Whether a target is finite and not absurdly far, and its turn a rotation."""
    total = abs(target[0]) + abs(target[1]) + abs(target[2])
    if rows > 3:
        for k in range(9):  # each row is the cross product of the other two
            row, i, j = k // 3, (k + 1) % 3, (k + 2) % 3
            a, b = 3 + 3 * ((row + 1) % 3), 3 + 3 * ((row + 2) % 3)
            total += 1e9 * abs(target[a + i] * target[b + j] - target[a + j] * target[b + i] - target[3 + k])
    return total < 1e6


@njit(**KERNEL)
def search(arm, targets, rows, nears, begin, tries, wanted, pull, found):
    """Solutions for a batch of targets, as many as wanted; beside them the best ends of the starts that failed.

    Args:
        arm: the arm.
        targets: (batch, 12) position [m] and rotation, row by row.
        rows: 3: only the position counts; 6: the pose.
        nears: a posture to be near, one for all targets or one for each.
        begin: -1: start from ``nears`` first; 0: from stored postures only.
        tries: how many stored postures to start from, at most.
        wanted: of how many solutions to stop; not more than there are rows.
        pull: of ``nears`` on the choice of starts, for the joints' mean square in parts of their ranges [m^2].
        found: (batch, ends, joints + 3) filled in: joint values, distance [m], angle [rad], and `REACHED`, `FAILED`,
            `UNUSED`, or in the first row `REFUSED` where the target isn't finite, is absurdly far or no rotation.
    """
    axes, n, ends = arm.axes.shape[0], arm.joints.shape[1], found.shape[1]
    work = Work(np.empty((axes, 6)), np.empty((n, 6)), np.empty((2, 6, 6)), np.empty((3, 12)), np.empty((4, n)))
    far, q, merits = np.empty(arm.postures.shape[0], np.float32), np.empty(n), np.empty(ends)
    for b in range(targets.shape[0]):
        target, near = targets[b], nears[min(b, nears.shape[0] - 1)]
        for k in range(ends):
            merits[k] = np.inf
            found[b, k, n + 2] = UNUSED
        if not usable(target, rows):
            found[b, 0, n + 2] = REFUSED
            continue
        survey(arm, target, rows, near, pull / n, far)
        solutions = 0
        for t in range(begin, tries):
            at = least(far)
            for j in range(n):
                q[j] = near[j] if t < 0 else arm.postures[at, j]
            if t >= 0:
                far[at] = np.inf
            squared, angle, within = descend(arm, target, rows, q, work)
            merit = squared + (arm.weight[3] * angle) ** 2
            k = 0  # a solution takes the next row, a failure that of the worst end so far
            if within:
                k, merit = solutions, -1.0
                solutions += 1
            else:
                for i in range(ends):
                    if merits[i] > merits[k]:
                        k = i
            if merit < merits[k]:
                merits[k] = merit
                for j in range(n):
                    found[b, k, j] = q[j]
                found[b, k, n], found[b, k, n + 1] = np.sqrt(squared), angle
                found[b, k, n + 2] = REACHED if within else FAILED
            if solutions == wanted:
                break
