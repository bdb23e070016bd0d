"""What is out of reach: the nearest that the tip comes, and whether a joint's limit is what keeps it away.

The ends of the starts that failed are brought to their least-squares minima inside the limits
(`toddle.reach.solve.settling_kernels`), and the least of them is the nearest reachable pose. Where the joints that
stand at a limit there would reach the target if they could go on, the limit is the reason.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.reach.solve.damped_kernels import Arm
from toddle.reach.solve.search_kernels import FAILED, REACHED, search
from toddle.reach.solve.settling_kernels import settle
from toddle.signals import Verdict


class Judgement(NamedTuple):
    """Whether a target can be reached, and what keeps the tip away.

    Attributes:
        verdict: reached, out of reach, or at a joint limit.
        joints: the joints that would have to go beyond their limits; none but for the last verdict.
    """

    verdict: Verdict
    joints: tuple[int, ...] = ()


def settled(
    arm: Arm, aims: Float[np.ndarray, "batch 12"], rows: int, found: np.ndarray
) -> Float[np.ndarray, "batch _"]:
    """The nearest that the tip comes to targets that no start reached.

    Args:
        arm: the arm.
        aims, rows: the targets, as `search` takes them.
        found: (batch, ends, joints + 3) the ends of the starts.

    Returns:
        (batch, joints + 3) the least of the minima.
    """
    target, end = np.nonzero(found[:, :, -1] == FAILED)
    minima = np.ascontiguousarray(found[target, end, :-1])
    settle(arm, aims[target], rows, minima[:, :-2], 0.0, minima)
    merit = np.full(found.shape[:2], np.inf)
    merit[target, end] = minima[:, -2] ** 2 + (arm.weight[3] * minima[:, -1]) ** 2
    found[target, end, :-1] = minima
    least = found[np.arange(len(found)), np.argmin(merit, axis=1)]
    within = (least[:, -3] <= arm.within[0]) & (least[:, -2] <= arm.within[1])
    least[:, -1] = np.where(within, REACHED, FAILED)
    return least


def judged(arm: Arm, aim: Float[np.ndarray, " 12"], rows: int, nearest: Float[np.ndarray, " joints"]) -> Judgement:
    """Why a target isn't reached, from the nearest posture to it.

    Args:
        arm: the arm.
        aim, rows: the target, as `search` takes it.
        nearest: joint values of the least-squares minimum [rad or m].
    """
    lower, upper = arm.joints[0], arm.joints[1]
    held = (nearest <= lower) | (nearest >= upper)
    if held.any():
        room = np.where(held, np.maximum(upper - lower, np.pi), 0.0)
        opened = arm.joints.copy()
        opened[:2] = lower - room, upper + room
        found = np.empty((1, 1, len(nearest) + 3))
        search(arm._replace(joints=opened), aim[None], rows, nearest[None], -1, 0, 1, 0.0, found)
        q = found[0, 0, :-3]
        beyond = np.nonzero((q < lower) | (q > upper))[0]
        if found[0, 0, -1] == REACHED:
            return Judgement(Verdict.AT_JOINT_LIMIT, tuple(int(joint) for joint in beyond))
    return Judgement(Verdict.OUT_OF_REACH)
