"""A learned rigid arm in elementary operations: where the tip is, how it turns, and how the joints move it.

The tip's transform is ``before[0] Z(m_0) before[1] Z(m_1) ... tip`` as in `toddle.robots.linkage`. Each factor is
linear in cos m, sin m and m, so all of them are made at once and only their products follow one after the other.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.outside.export_ops import Ops, Tensor
from toddle.outside.export_solve import Miss, Problem
from toddle.reach.model.rigid import Rigid
from toddle.robots.linkage import poses

LEVER = 0.3  # what an angle of a radian counts for [m]
_STRIDE = 0.7  # [rad]
_STARTS, _TURNED_STARTS = 1024, 4096
_CHORD = LEVER / np.sqrt(2)  # the distance of rotation matrices is about sqrt(2) times the angle between them
_NEXT, _AFTER = [1, 2, 0], [2, 0, 1]
_LEAST_SINE, _LEAST_COSINE = 1e-7, 1e-7


def rigid_problem(
    model: Rigid, lower: Float[np.ndarray, " joints"], upper: Float[np.ndarray, " joints"], *, turned: bool
) -> Problem:
    """What is exported of a rigid arm.

    Args:
        model: the arm.
        lower: lower limits [rad or m].
        upper: upper limits.
        turned: whether it may be asked for orientations, too.
    """
    count = _TURNED_STARTS if turned else _STARTS
    starts = lower + (upper - lower) * np.random.default_rng(0).random((count, len(lower)))
    tips = poses(model.linkage, starts)
    places = tips[:, model.coordinates, 3]
    if turned:
        places = np.concatenate([places, _CHORD * tips[:, :3, :3].reshape(-1, 9)], axis=1)
    scale = (upper - lower) / np.mean(upper - lower)
    return Problem(
        lower, upper, scale, _STRIDE, starts, places,
        rows=len(model.coordinates) + (3 if turned else 0),
        lever=LEVER,
        freest=False,
        goal=partial(_goal, len(model.coordinates)),
        miss=partial(_miss, model, scale, turned),
    )  # fmt: skip


def _goal(space: int, ops: Ops, target: Tensor, quaternion: Tensor | None = None) -> tuple[Tensor, Tensor]:
    """The target as the starts' places have it, and position, rotation row by row and 1 in a column (batch, 1, _, 1).

    A quaternion of zeros asks for no orientation: then the rotation and the last row are zeros.
    """
    at = ops.shape(target, (1, space, 1))
    if quaternion is None:
        return target, at
    square = ops.sum(quaternion * quaternion, -1)
    asked = ops.where(square > 0.25, 0.0 * square + 1.0, 0.0 * square)
    unit = quaternion / ops.sqrt(ops.maximum(square, ops.constant(0.25)))
    # a rotation is quadratic in its quaternion: each element a sum of ten products
    products = ops.take(unit, [0, 0, 0, 0, 1, 1, 1, 2, 2, 3], -1) * ops.take(unit, [0, 1, 2, 3, 1, 2, 3, 2, 3, 3], -1)
    turn = ops.matmul(products, ops.constant(_QUADRATIC)) * asked
    goal = ops.join([target, turn, asked], -1)
    return ops.join([target, _CHORD * turn], -1), ops.shape(goal, (1, space + 10, 1))


_ROTATION = {  # row by row: element -> {product of quaternion parts: factor}
    0: {"ww": 1, "xx": 1, "yy": -1, "zz": -1}, 1: {"xy": 2, "wz": -2}, 2: {"xz": 2, "wy": 2},
    3: {"xy": 2, "wz": 2}, 4: {"ww": 1, "xx": -1, "yy": 1, "zz": -1}, 5: {"yz": 2, "wx": -2},
    6: {"xz": 2, "wy": -2}, 7: {"yz": 2, "wx": 2}, 8: {"ww": 1, "xx": -1, "yy": -1, "zz": 1},
}  # fmt: skip
_PRODUCTS = "ww", "wx", "wy", "wz", "xx", "xy", "xz", "yy", "yz", "zz"
_QUADRATIC = np.array([[_ROTATION[element].get(product, 0) for element in range(9)] for product in _PRODUCTS])


class _Tip(NamedTuple):
    """Tip and slopes, (batch, lanes, ...): transform (4, 4), shift and turn of the tip by each axis (3, axes)."""

    pose: Tensor
    shift: Tensor
    turn: Tensor


def _miss(model: Rigid, scale: np.ndarray, turned: bool, ops: Ops, q: Tensor, goal: Tensor) -> Miss:
    tip, space = _tip(model, ops, q), len(model.coordinates)
    gain = ops.constant((model.linkage.gain * scale)[None, None])
    slope = ops.take(ops.matmul(tip.shift, gain), model.coordinates, -2)
    place = ops.take(ops.take(tip.pose, model.coordinates, -2), [3], -1)
    error = ops.take(goal, range(space), -2) - place
    square = _flat(ops, ops.sum(error * error, -2))
    if not turned:
        return Miss(error, slope, square, 0.0 * square)
    asked = ops.take(goal, [space + 9], -2)
    towards, angle = _turn_left(ops, ops.take(goal, range(space, space + 9), -2), tip.pose)
    return Miss(
        ops.join([error, LEVER * towards], -2),
        ops.join([slope, asked * LEVER * ops.matmul(tip.turn, gain)], -2),
        square,
        _flat(ops, angle),
    )


def _flat(ops: Ops, x: Tensor) -> Tensor:
    """(batch, lanes, 1, 1) as (batch, lanes, 1)."""
    return ops.shape(x, (-1, 1))


def _turn_left(ops: Ops, goal: Tensor, pose: Tensor) -> tuple[Tensor, Tensor]:
    """Rotation vector (3, 1) from the tip's orientation to the goal's in the base frame, and its length [rad]."""
    now = ops.take(ops.take(pose, range(3), -2), range(3), -1)
    aim = ops.shape(goal, (1, 3, 3))
    cross = ops.take(now, _NEXT, -2) * ops.take(aim, _AFTER, -2) - ops.take(now, _AFTER, -2) * ops.take(aim, _NEXT, -2)
    axis = 0.5 * ops.sum(cross, -1)
    sine = ops.sqrt(ops.sum(axis * axis, -2))
    cosine = 0.5 * (ops.sum(ops.sum(now * aim, -1), -2) - 1.0)
    # tan(angle / 2) = sin / (1 + cos) knows angles up to half a turn
    angle = 2.0 * ops.atan(sine / ops.maximum(1.0 + cosine, ops.constant(_LEAST_COSINE)))
    return axis * (angle / ops.maximum(sine, ops.constant(_LEAST_SINE))), angle


def _tip(model: Rigid, ops: Ops, q: Tensor) -> _Tip:
    linkage, axes = model.linkage, len(model.linkage.slides)
    gain, offset = ops.constant(linkage.gain.T[None]), ops.constant(linkage.offset[None, None])
    motion = ops.shape(ops.matmul(q, gain) + offset, (-1, axes, 1, 1))
    still, cos, sin, along = (part[None, None] for part in _factors(model))
    factors = ops.constant(still) + ops.constant(cos) * ops.cos(motion) + ops.constant(sin) * ops.sin(motion)
    if linkage.slides.any():
        factors = factors + ops.constant(along) * motion
    frames = []
    for axis in range(axes):
        factor = ops.shape(ops.take(factors, [axis], -3), (-1, 4, 4))
        frames.append(ops.matmul(frames[-1], factor) if frames else factor)
    pose = ops.matmul(frames[-1], ops.constant(linkage.tip[None, None]))
    beside = ops.join(frames, -1)
    line = ops.take(beside, [4 * axis + 2 for axis in range(axes)], -1)
    arm = ops.take(pose, [3], -1) - ops.take(beside, [4 * axis + 3 for axis in range(axes)], -1)
    swing = ops.take(line, _NEXT, -2) * ops.take(arm, _AFTER, -2) - ops.take(line, _AFTER, -2) * ops.take(
        arm, _NEXT, -2
    )
    slides, line = ops.constant(linkage.slides[None, None, None]), ops.take(line, range(3), -2)
    return _Tip(pose, swing * (1.0 - slides) + line * slides, line * (1.0 - slides))


def _factors(model: Rigid) -> tuple[Float[np.ndarray, "axes 4 4"], ...]:
    """What ``before Z(m)`` is at all times, and what cos m, sin m and m add to it."""
    before, slides = model.linkage.before, model.linkage.slides[:, None] > 0
    still, cos, sin, along = (np.zeros_like(before) for _ in range(4))
    x, y, z = (before[..., column] for column in range(3))
    still[..., 2:] = before[..., 2:]
    still[..., :2] = np.where(slides[..., None], before[..., :2], 0.0)
    cos[..., 0], cos[..., 1] = np.where(slides, 0.0, x), np.where(slides, 0.0, y)
    sin[..., 0], sin[..., 1] = np.where(slides, 0.0, y), np.where(slides, 0.0, -x)
    along[..., 3] = np.where(slides, z, 0.0)
    return still, cos, sin, along
