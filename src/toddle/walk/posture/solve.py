"""Whole-body inverse kinematics: a centre of mass, two soles, a waist and a chest become joint angles.

Damped least squares (Huber 2019, eq. 2.112-2.113) whose joint limits are an active set inside every step, warm-started
from the last configuration: one or two steps a tick follow a walking reference. What cannot be met is neared as far as
the weights say, and the answer tells what and why.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from toddle.failures import BadInput
from toddle.signals import Reference, Verdict
from toddle.walk.posture.descent import descend
from toddle.walk.posture.model import PostureModel
from toddle.walk.posture.survey import checked

TASKS = (
    "the centre of mass",
    "the left sole",
    "the left sole's rotation",
    "the right sole",
    "the right sole's rotation",
    "the waist",
    "the chest",
)
"""Names of the rows of `Posture.misses`; each has three rows of weights."""
POSITIONS = (0, 1, 3)
"""Those of the tasks that are positions [m]; the others are rotations [rad]."""

WEIGHTS = np.concatenate(([1.0, 1.0, 0.1], np.repeat([10.0, 0.1], (12, 6))))
"""The soles first, then where the centre of mass is over them, then its height and the trunk [cost/m^2, cost/rad^2].

Where an ankle stops at its limit, the height gives: a walk bears a low centre of mass better than one out of place."""
WEIGHTS.flags.writeable = False

FLAT = 1e-5
"""A slope of the cost that counts as none [cost/rad]."""
_TARGET_SIZE = 66


class PostureTarget(NamedTuple):
    """What the posture should be, in the world.

    Attributes:
        com: centre of mass [m].
        soles: origins of the left and the right sole [m].
        sole_rotations: of the soles' frames.
        waist_rotation: of the pelvis.
        chest_rotation: of the upper torso.
        weights: of the squared errors, three for each of `TASKS`: positions along the world's axes, rotations about
            the frame's own. A row under a tenth of its task's greatest is released: it may err, and is not judged.
    """

    com: Float[np.ndarray, "3"]
    soles: Float[np.ndarray, "2 3"]
    sole_rotations: Float[np.ndarray, "2 3 3"]
    waist_rotation: Float[np.ndarray, "3 3"]
    chest_rotation: Float[np.ndarray, "3 3"]
    weights: Float[np.ndarray, "21"] = WEIGHTS


class Posture(NamedTuple):
    """A configuration near the target.

    Attributes:
        q: base position [m], its quaternion (w, x, y, z), joints within their limits [rad].
        misses: the distance of each of `TASKS` from its target [m, rad], released rows left out.
        verdict: reached; at a joint limit, which the tasks press against; out of reach: no posture is nearer; or not
            converged: more iterations come nearer.
        at_limit: which joints that move are at a limit.
        iterations: steps made.
    """

    q: Float[np.ndarray, " positions"]
    misses: Float[np.ndarray, "7"]
    verdict: Verdict
    at_limit: Bool[np.ndarray, " joints"]
    iterations: int


def solve_posture(
    model: PostureModel, q: Float[np.ndarray, " positions"], target: PostureTarget, iterations: int = 1
) -> Posture:
    """Near a target by a few steps from a configuration; never raises the cost, never leaves the joints' limits.

    Args:
        model: the robot.
        q: where to start: the last answer. Joints that walking does not move stay as they are.
        target: what to near. Where it is not finite the answer is the start, not converged, its misses not finite.
        iterations: steps; one or two follow a reference, `settle` takes many.

    Raises:
        BadInput: a configuration or a target of the wrong size.
    """
    goal = np.concatenate(target, axis=None, dtype=float)
    if goal.size != _TARGET_SIZE:
        raise BadInput(f"a target of {goal.size} numbers", where="posture", remedy=f"it has {_TARGET_SIZE}")
    q, misses, met, steepest, blocked, limited, steps = descend(
        model.skeleton, checked(model, q), goal, model.damping, model.pull, *model.tolerance, iterations
    )
    if met:
        verdict = Verdict.REACHED
    elif not np.isfinite(misses).all():
        verdict = Verdict.NOT_CONVERGED
    elif blocked > FLAT:
        verdict = Verdict.AT_JOINT_LIMIT
    else:
        verdict = Verdict.OUT_OF_REACH if steepest < FLAT else Verdict.NOT_CONVERGED
    return Posture(q, misses, verdict, limited, steps)


def settle(
    model: PostureModel, q: Float[np.ndarray, " positions"], target: PostureTarget, iterations: int = 300
) -> Posture:
    """The same with steps enough to come from afar: where a walk starts.

    Args:
        model: the robot.
        q: where to start.
        target: what to near.
        iterations: the most steps.

    Raises:
        BadInput: a configuration or a target of the wrong size.
    """
    return solve_posture(model, q, target, iterations)


def posture_target(reference: Reference, weights: Float[np.ndarray, "21"] = WEIGHTS) -> PostureTarget:
    """What a walking pattern asks: flat soles, and an upright trunk that faces ahead.

    Args:
        reference: one instant of the pattern.
        weights: of the squared errors.
    """
    turns = np.zeros((3, 3, 3))
    for turn, yaw in zip(turns, (reference.feet[0, 3], reference.feet[1, 3], reference.yaw[0]), strict=True):
        turn[0, 0] = turn[1, 1] = math.cos(yaw)
        turn[1, 0] = math.sin(yaw)
        turn[0, 1] = -turn[1, 0]
        turn[2, 2] = 1.0
    return PostureTarget(reference.com[0], reference.feet[:, :3], turns[:2], turns[2], turns[2], weights)


def explain(model: PostureModel, posture: Posture) -> str:
    """One sentence: what a posture misses, and which joints are at their limits.

    Args:
        model: the robot.
        posture: an answer for it.
    """
    off = [
        f"{TASKS[i]} by {1000 * miss:.1f} mm" if i in POSITIONS else f"{TASKS[i]} by {math.degrees(miss):.1f} degrees"
        for i, miss in enumerate(posture.misses)
        if not miss <= model.tolerance[i not in POSITIONS]
    ]
    at = [name for name, limited in zip(model.joints, posture.at_limit, strict=True) if limited]
    said = f"{posture.verdict}: misses {', '.join(off)}" if off else str(posture.verdict)
    return f"{said}; at a limit: {', '.join(at)}" if at else said
