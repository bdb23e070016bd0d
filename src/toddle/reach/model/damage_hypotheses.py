"""What may have happened to a rigid arm, as families of small problems that are solved side by side.

A hypothesis has a few numbers ``theta = mean + root z`` with z standard normal before anything is seen. In the family
of joints, joint j goes to ``theta_0 + theta_1 q_j``: a slip (theta_1 = 1), a lock (0) or a weaker joint (between). In
the family of links, the frame at the far end of a link is moved by the twist theta (shift [m], turn [rad]) in its own
axes: a bend, or without the turn, a link of another length (as a shift without a turn it is the same wherever on the
axes a learned arm has its frames). What comes before and after is untouched, so that a link's hypothesis needs no
kinematics: the tip is ``F B c`` with F and c known.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.reach.model.rigid import twist_motion
from toddle.robots.linkage import Linkage, axis_frames, pose_slopes

_SLIP, _LOCK_PLACE, _REMAINS = 0.3, 0.1, 0.3  # [rad] a slip; how far from where it stood a joint locks; share
_SHIFT, _TURN, _LENGTH = 0.1, 0.3, 0.1  # [m], [rad] of a bend, [m] of a replaced link

Predict = Callable[
    [Float[np.ndarray, "cases numbers"]],
    tuple[Float[np.ndarray, "cases movements 4 4"], Float[np.ndarray, "cases movements 6 numbers"]],
]


class Family(NamedTuple):
    """Hypotheses of one form.

    Attributes:
        kinds: "slip", "lock", "weaken", "bend" or "replace", for each.
        axes: the axis (links: that comes before it) or the joint that each is about.
        mean: of its numbers before anything is seen.
        root: of their covariance; columns of zeros where it has fewer numbers.
        starts: values of z to start from.
        predict: tip transforms, and how shift and turn of the tip change with the numbers; rows as `kinds`.
    """

    kinds: tuple[str, ...]
    axes: tuple[int, ...]
    mean: Float[np.ndarray, "cases numbers"]
    root: Float[np.ndarray, "cases numbers numbers"]
    starts: Float[np.ndarray, "starts numbers"]
    predict: Predict


def joint_family(
    linkage: Linkage,
    q: Float[np.ndarray, "movements joints"],
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    stood: Float[np.ndarray, " joints"] | None,
) -> Family:
    """Slips, locks and weaker joints, three for each joint.

    Args:
        linkage: the arm before.
        q: joint values commanded since [rad or m].
        lower: lower limits [rad or m].
        upper: upper limits [rad or m].
        stood: where the joints stood before; None: not known.
    """
    count = q.shape[1]
    slides = linkage.slides[np.argmax(np.abs(linkage.gain), axis=0)] > 0
    unit = np.where(slides, (upper - lower) / 2, 1.0)  # a sliding joint is measured by its stroke
    place = (lower + upper) / 2 if stood is None else stood
    around = (upper - lower) / 3 if stood is None else _LOCK_PLACE * unit
    mean, root = np.zeros((3, count, 2)), np.zeros((3, count, 2, 2))
    mean[0, :, 1], root[0, :, 0, 0] = 1.0, _SLIP * unit
    mean[1, :, 0], root[1, :, 0, 0] = place, around
    mean[2, :, 0], mean[2, :, 1] = place / 2, 0.5
    root[2, :, 0, 0], root[2, :, 0, 1], root[2, :, 1, 1] = around / 2, -_REMAINS * place, _REMAINS
    joints = np.tile(np.arange(count), 3)

    def predict(
        numbers: Float[np.ndarray, "cases 2"],
    ) -> tuple[Float[np.ndarray, "cases movements 4 4"], Float[np.ndarray, "cases movements 6 2"]]:
        cases = np.arange(len(numbers))
        told = np.repeat(q[None], len(numbers), axis=0)
        asked = told[cases, :, joints]
        told[cases, :, joints] = numbers[:, :1] + numbers[:, 1:] * asked
        pose, slope = pose_slopes(linkage, told.reshape(-1, count))
        slope = slope.reshape(len(numbers), -1, 6, count)[cases, :, :, joints]
        return pose.reshape(*told.shape[:2], 4, 4), np.stack([slope, slope * asked[..., None]], axis=3)

    places = (0.0, 2.0, -2.0) if stood is not None else (0.0, 1.0, -1.0, 2.0, -2.0)
    starts = np.array([[place, 0.0] for place in places])
    kinds = ("slip",) * count + ("lock",) * count + ("weaken",) * count
    return Family(kinds, tuple(joints.tolist()), mean.reshape(-1, 2), root.reshape(-1, 2, 2), starts, predict)


def link_family(linkage: Linkage, q: Float[np.ndarray, "movements joints"]) -> Family:
    """Bends and links of another length, one of each after each axis."""
    axes = len(linkage.slides)
    far = np.concatenate([linkage.before[1:], linkage.tip[None]])
    frames = axis_frames(linkage, q) @ far[:, None]  # the far end of each link, before the next axis moves it
    root = np.zeros((2, axes, 6, 6))
    root[0] = np.diag([_SHIFT] * 3 + [_TURN] * 3)
    root[1] = np.diag([_LENGTH] * 3 + [0.0] * 3)
    which = np.tile(np.arange(axes), 2)
    beyond = np.linalg.inv(frames) @ frames[-1]  # from there to the tip

    def predict(
        numbers: Float[np.ndarray, "cases 6"],
    ) -> tuple[Float[np.ndarray, "cases movements 4 4"], Float[np.ndarray, "cases movements 6 6"]]:
        motion = twist_motion(numbers)
        tip = frames[which] @ motion[:, None] @ beyond[which]
        turn = frames[which][..., :3, :3]
        arm = (motion[:, None] @ beyond[which])[..., :3, 3] - numbers[:, None, :3]
        slope = np.zeros((*tip.shape[:2], 6, 6))
        slope[..., :3, :3] = turn
        slope[..., 3:, 3:] = turn @ turn_slope(numbers[:, 3:])[:, None]
        slope[..., :3, 3:] = -turn @ _cross(arm) @ turn_slope(numbers[:, 3:])[:, None]
        return tip, slope

    kinds = ("bend",) * axes + ("replace",) * axes
    return Family(
        kinds, tuple(which.tolist()), np.zeros((2 * axes, 6)), root.reshape(-1, 6, 6), np.zeros((1, 6)), predict
    )


def turn_slope(turn: Float[np.ndarray, "cases 3"]) -> Float[np.ndarray, "cases 3 3"]:
    """How a rotation turns, in the outer frame, with its rotation vector [rad]: the left Jacobian of SO(3)."""
    angle = np.linalg.norm(turn, axis=1)[:, None, None]
    cross = _cross(turn)
    small = angle < 1e-3
    safe = np.where(small, 1.0, angle)
    third = np.where(small, 1 / 6, (safe - np.sin(safe)) / safe**3)
    return np.eye(3) + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * cross + third * cross @ cross


def _cross(vector: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3 3"]:
    """The matrix that multiplies as the vector's cross product does."""
    cross = np.zeros((*vector.shape, 3))
    cross[..., 0, 1], cross[..., 0, 2], cross[..., 1, 2] = -vector[..., 2], vector[..., 1], -vector[..., 0]
    return cross - np.swapaxes(cross, -1, -2)
