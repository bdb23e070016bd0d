"""A humanoid prepared for inverse kinematics: its tree and frames as arrays that compiled kernels take.

What never changes from tick to tick is worked out here once: which joints move which frame, which joints may be
moved at all, how far.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from toddle.failures import BadInput
from toddle.robots.humanoid import Humanoid, Tree

SOLES, WAIST, CHEST, IMU = slice(0, 2), 2, 3, 4
"""Rows of the frames."""


class Skeleton(NamedTuple):
    """The numbers of a humanoid, for kernels.

    Attributes:
        tree: its bodies.
        frame_body: bodies that carry the left sole, the right sole, the waist, the chest and the IMU.
        frame_position: of those frames in their bodies [m].
        frame_rotation: the same, as matrices.
        chain: whether a joint moves a frame.
        variable: column of each joint in the inverse kinematics, after the six of the base; -1: the joint is held.
        lower: limits of the joints [rad].
        upper: limits of the joints [rad].
        home: where the nullspace draws the joints [rad].
        support: for the CoM, the two soles, the waist and the chest: the columns that move it, in order, then -1.
    """

    tree: Tree
    frame_body: Int[np.ndarray, "5"]
    frame_position: Float[np.ndarray, "5 3"]
    frame_rotation: Float[np.ndarray, "5 3 3"]
    chain: Bool[np.ndarray, "5 joints"]
    variable: Int[np.ndarray, " joints"]
    lower: Float[np.ndarray, " joints"]
    upper: Float[np.ndarray, " joints"]
    home: Float[np.ndarray, " joints"]
    support: Int[np.ndarray, "5 variables"]


@dataclass(frozen=True)
class PostureModel:
    """What `toddle.walk.posture.solve.solve_posture` and `toddle.walk.posture.survey.survey` need of a robot.

    Attributes:
        joints: names of the joints.
        skeleton: the numbers.
        damping: the least lambda of Huber 2019, eq. 2.113; it grows with the error.
        pull: weight of the joints' distance from ``home`` [cost/rad^2].
        tolerance: within which a task counts as met [m], [rad].
    """

    joints: tuple[str, ...]
    skeleton: Skeleton
    damping: float = 2e-7
    pull: float = 2e-8
    tolerance: tuple[float, float] = (5e-4, 2e-3)


def posture_model(
    humanoid: Humanoid, *, damping: float = 2e-7, pull: float = 2e-8, tolerance: tuple[float, float] = (5e-4, 2e-3)
) -> PostureModel:
    """Prepare a humanoid, once.

    Args:
        humanoid: the robot; its arrays are copied.
        damping: the least damping, above 0.
        pull: weight of the joints' distance from home [cost/rad^2].
        tolerance: within which a task counts as met [m], [rad].

    Raises:
        BadInput: limits that contradict each other, no mass, or a setting out of range.
    """
    if not (damping > 0 and pull >= 0 and min(tolerance) > 0):
        raise BadInput("damping, pull or tolerance is out of range", where="posture", remedy="give numbers above 0")
    crossed = np.flatnonzero(~(humanoid.lower <= humanoid.upper))
    if crossed.size:
        name = humanoid.joints[int(crossed[0])]
        raise BadInput("the lower limit is above the upper one", where=f"joint {name}", remedy="swap the limits")
    if not humanoid.mass > 0:
        raise BadInput("the robot has no mass", where=humanoid.name, remedy="give its links masses above 0")
    return PostureModel(humanoid.joints, _skeleton(humanoid), damping, pull, tolerance)


def _skeleton(humanoid: Humanoid) -> Skeleton:
    tree, frames = humanoid.tree, (*humanoid.soles, humanoid.waist, humanoid.chest, humanoid.imu)
    integers = ("parent", "joint")
    chain = np.array([_moved_by(tree, frame.body, len(humanoid.joints)) for frame in frames])
    variable = np.where(humanoid.moves, 5 + np.cumsum(humanoid.moves), -1).astype(np.int64)
    return Skeleton(
        tree=Tree(
            *(np.array(a, np.int64 if n in integers else float) for n, a in zip(tree._fields, tree, strict=True))
        ),
        frame_body=np.array([frame.body for frame in frames], np.int64),
        frame_position=np.array([frame.position for frame in frames], float),
        frame_rotation=np.array([frame.rotation for frame in frames], float),
        chain=chain,
        variable=variable,
        lower=np.array(humanoid.lower, float),
        upper=np.array(humanoid.upper, float),
        home=np.array(humanoid.home[7:], float),
        support=_support(chain, variable),
    )


def _moved_by(tree: Tree, body: int, joints: int) -> Bool[np.ndarray, " joints"]:
    moved = np.zeros(joints, bool)
    while body >= 0:
        if tree.joint[body] >= 0:
            moved[tree.joint[body]] = True
        body = int(tree.parent[body])
    return moved


def _support(
    chain: Bool[np.ndarray, "5 joints"], variable: Int[np.ndarray, " joints"]
) -> Int[np.ndarray, "5 variables"]:
    """Columns that a task's rows can be nonzero in; positions are moved by the whole base, rotations by its turning."""
    moves = variable >= 0
    joints = [variable[moves], *(variable[moves & chain[frame]] for frame in range(4))]
    support = np.full((5, 6 + int(moves.sum())), -1, np.int64)
    for row, (first, columns) in enumerate(zip((0, 0, 0, 3, 3), joints, strict=True)):
        both = np.concatenate((np.arange(first, 6), columns))
        support[row, : both.size] = both
    return support
