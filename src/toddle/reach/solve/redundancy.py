"""Redundancy is a choice: of all postures that reach a target the one nearest to another, or several unlike each other.

Solutions from several starts are turned by whole turns, and slid along the arm's self-motion, towards the posture
wanted: the minimum of |e|^2 + pull |u - u*|^2 with a pull that vanishes (`toddle.reach.solve.settling_kernels`), then
exactly onto the target again. Distances between postures are of joints measured by their ranges.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from toddle.reach.solve.damped_kernels import Arm
from toddle.reach.solve.search_kernels import REACHED, search
from toddle.reach.solve.settling_kernels import settle

_PULLS = (1e-3, 1e-5)  # [m^2]
_APART = 0.05  # of the ranges, root mean square over the joints: postures closer than this are one


def draw_near(
    arm: Arm, aims: Float[np.ndarray, "batch 12"], rows: int, found: np.ndarray, towards: Float[np.ndarray, "batch _"]
) -> Float[np.ndarray, "batch _"]:
    """Of each target's solutions the nearest to a posture, after all were drawn towards it.

    Args:
        arm: the arm.
        aims, rows: the targets, as `search` takes them.
        found: (batch, ends, joints + 3) what it found.
        towards: the postures [rad or m].

    Returns:
        A row of ``found`` for each target; the first where there is no solution.
    """
    n = arm.joints.shape[1]
    target, end = np.nonzero(found[:, :, -1] == REACHED)
    wanted, goals = towards[target], aims[target]
    turned = whole_turns(arm, found[target, end, :n], wanted)
    slid = np.concatenate([turned, np.zeros((len(target), 2))], axis=1)
    for pull in _PULLS:
        settle(arm, goals, rows, wanted, pull, slid)
    exact = np.empty((len(target), 1, n + 3))
    search(arm, goals, rows, np.ascontiguousarray(slid[:, :n]), -1, 0, 1, 0.0, exact)
    before, after = apart(arm, turned, wanted), apart(arm, exact[:, 0, :n], wanted)
    kept = (exact[:, 0, -1] == REACHED) & (after < before)
    found[target, end, :n] = turned
    found[target[kept], end[kept]] = exact[kept, 0]
    distance = np.full(found.shape[:2], np.inf)
    distance[target, end] = np.where(kept, after, before)
    return found[np.arange(len(found)), np.argmin(distance, axis=1)]


def unlike(
    arm: Arm, q: Float[np.ndarray, "solutions joints"], near: Float[np.ndarray, " joints"], count: int
) -> Float[np.ndarray, "chosen joints"]:
    """Of many solutions a few that are clearly unlike, the nearest to a posture first.

    The nearest one, then always the one that is farthest from all that were chosen; whole turns make no difference.
    """
    q = whole_turns(arm, q, np.broadcast_to(near, q.shape))
    distance = apart(arm, q, near)
    order = [int(np.argmin(distance))] if len(q) else []
    gap = np.full(len(q), np.inf)
    while 0 < len(order) < count:
        last = q[order[-1]]
        gap = np.minimum(gap, apart(arm, whole_turns(arm, q, np.broadcast_to(last, q.shape), held=False), last))
        if gap.max() < _APART:
            break
        order.append(int(np.argmax(gap)))
    return q[sorted(order, key=lambda row: distance[row])]


def apart(
    arm: Arm, q: Float[np.ndarray, "batch joints"], other: Float[np.ndarray, "*batch joints"]
) -> Float[np.ndarray, " batch"]:
    """How far postures are from others: of the ranges, root mean square over the joints."""
    return np.sqrt(np.mean(((q - other) / (arm.joints[1] - arm.joints[0])) ** 2, axis=1))


def whole_turns(
    arm: Arm, q: Float[np.ndarray, "batch joints"], towards: Float[np.ndarray, "batch joints"], *, held: bool = True
) -> Float[np.ndarray, "batch joints"]:
    """The same postures of the arm, by whole turns nearer to others; where limits are held, only as they allow."""
    lower, upper, period = arm.joints[0], arm.joints[1], arm.joints[4]
    turned = q + period * np.round((towards - q) / np.where(period > 0, period, np.inf))
    allowed: Bool[np.ndarray, "batch joints"] = (lower <= turned) & (turned <= upper) if held else period >= 0
    return np.where(allowed, turned, q)
