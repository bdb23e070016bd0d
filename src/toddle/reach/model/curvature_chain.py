"""The kinematics of a soft arm: segments in a row, each an arc of constant curvature, and their slopes.

A segment with bend vector b (angle theta = |b|, towards b) and arc length L turns and shifts by

    R = I + s K + v K^2,  p = L (v b_x, v b_y, s),  s = sin(theta) / theta,  v = (1 - cos theta) / theta^2,

K the cross product with (-b_y, b_x, 0): Webster and Jones 2010 (as in Thuruthel et al. 2016), smooth through the
straight segment. Bends and length follow the segment's own actuators, scaled to u in [-1, 1]: (b, L) = W f(u), with
f = (1, u), or products of u up to a higher order where an actuator is not linear. Between two segments there may be a
straight stiff piece, before the first a shift and a tilt of the foot, after the last an offset to the tip.

All those constants stand in one vector of numbers: shift of the foot [m], tilt [rad], W of each segment (rows b_x, b_y
[rad] and L [m]), the stiff pieces [m], the tip's offset [m].
"""

from __future__ import annotations

from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

_SERIES_BELOW = 0.5  # [rad^2] beneath this theta^2 the closed forms cancel
_FACTORIALS = np.cumprod(np.arange(1.0, 21.0))

Rows = Float[np.ndarray, "batch joints"]


class Shape(NamedTuple):
    """What a soft arm's numbers mean.

    Attributes:
        sizes: how many actuators each segment has, base first.
        order: the highest power of the actuators in a segment's bend and length.
        middle: actuator values that u = 0 stands for [m].
        half: what u = 1 adds to them [m].
        space: how many coordinates of the tip are seen.
    """

    sizes: tuple[int, ...]
    order: int
    middle: Float[np.ndarray, " joints"]
    half: Float[np.ndarray, " joints"]
    space: int


class Places(NamedTuple):
    """Where the parts of the vector of numbers are."""

    tilt: slice
    segments: tuple[slice, ...]
    gaps: slice
    tip: slice
    total: int


class Sweep(NamedTuple):
    """Everything along the arm, for a batch of postures, in the base frame.

    Attributes:
        tip: its position [m].
        frames: turn of the foot, then of each segment's head.
        locals: how the tip moves with (b_x, b_y, L) of the tilt and of each segment.
    """

    tip: Float[np.ndarray, "batch 3"]
    frames: Float[np.ndarray, "elements batch 3 3"]
    locals: Float[np.ndarray, "elements batch 3 3"]


def places(shape: Shape) -> Places:
    """The parts of the vector of numbers, the foot's shift first."""
    start, segments = shape.space + 2, []
    for size in shape.sizes:
        stop = start + 3 * len(_powers(size, shape.order))
        segments.append(slice(start, stop))
        start = stop
    gap = len(shape.sizes) - 1
    return Places(
        slice(shape.space, shape.space + 2),
        tuple(segments),
        slice(start, start + gap),
        slice(start + gap, start + gap + 3),
        start + gap + 3,
    )


def tips(shape: Shape, numbers: Float[np.ndarray, " numbers"], q: Rows) -> Float[np.ndarray, "batch space"]:
    """Tip positions [m] for actuator values q [m]."""
    where, u = places(shape), (q - shape.middle) / shape.half
    point, gaps = _tip_offset(numbers, where, len(q)), (0.0, *numbers[where.gaps])
    for i in reversed(range(len(shape.sizes))):
        bend, arc = _bend(shape, numbers, where, u, i)
        point = carry(bend, arc, point)
        point[:, 2] += gaps[i]
    tilt = np.broadcast_to(numbers[where.tilt], (len(q), 2))
    return carry(tilt, np.zeros(len(q)), point)[:, : shape.space] + numbers[: shape.space]


def number_slopes(
    shape: Shape, numbers: Float[np.ndarray, " numbers"], q: Rows
) -> tuple[Float[np.ndarray, "batch space"], Float[np.ndarray, "batch space numbers"]]:
    """Tip positions [m], and how they change with every number."""
    where, u = places(shape), (q - shape.middle) / shape.half
    along = sweep(shape, numbers, q)
    slopes = np.zeros((len(q), 3, where.total))
    slopes[:, : shape.space, : shape.space] = np.eye(shape.space)
    slopes[:, :, where.tilt] = along.locals[0][:, :, :2]
    for i, part in enumerate(where.segments):
        f = features(_own(shape, u, i), shape.order)
        slopes[:, :, part] = (along.locals[i + 1][:, :, :, None] * f[:, None, None, :]).reshape(len(q), 3, -1)
    slopes[:, :, where.gaps] = along.frames[1:-1, :, :, 2].transpose(1, 2, 0)
    slopes[:, :, where.tip] = along.frames[-1]
    return along.tip[:, : shape.space], slopes[:, : shape.space]


def joint_slopes(
    shape: Shape, numbers: Float[np.ndarray, " numbers"], q: Rows
) -> tuple[Float[np.ndarray, "batch space"], Float[np.ndarray, "batch space joints"]]:
    """Tip positions [m], and how they change with the actuator values [m/m]."""
    where, u = places(shape), (q - shape.middle) / shape.half
    along = sweep(shape, numbers, q)
    parts = []
    for i, part in enumerate(where.segments):
        own = numbers[part].reshape(3, -1) @ feature_slopes(_own(shape, u, i), shape.order)
        parts.append(along.locals[i + 1] @ own)
    slopes = np.concatenate(parts, axis=2) / shape.half
    return along.tip[:, : shape.space], slopes[:, : shape.space]


def sweep(shape: Shape, numbers: Float[np.ndarray, " numbers"], q: Rows) -> Sweep:
    """Frames, tip and local slopes along the arm."""
    where, u, count = places(shape), (q - shape.middle) / shape.half, len(shape.sizes)
    tilt = np.broadcast_to(numbers[where.tilt], (len(q), 2))
    bends = [(tilt, np.zeros(len(q))), *(_bend(shape, numbers, where, u, i) for i in range(count))]
    gaps = (0.0, 0.0, *numbers[where.gaps])
    points = [_tip_offset(numbers, where, len(q))]
    for i in reversed(range(count + 1)):
        points.append(carry(bends[i][0], bends[i][1], points[-1]))
        points[-1][:, 2] += gaps[i]
    points.reverse()  # points[i]: the tip in the frame before element i; points[i + 1]: in the one after it
    turn, frames, slopes = np.broadcast_to(np.eye(3), (len(q), 3, 3)), [], []
    for i, (bend, arc) in enumerate(bends):
        slopes.append(turn @ _carry_slope(bend, arc, points[i + 1]))
        turn = turn @ turn_of(bend)
        frames.append(turn)
    tip = points[0].copy()
    tip[:, : shape.space] += numbers[: shape.space]
    return Sweep(tip, np.stack(frames), np.stack(slopes))


def carry(
    bend: Float[np.ndarray, "batch 2"], arc: Float[np.ndarray, " batch"], point: Float[np.ndarray, "batch 3"]
) -> Float[np.ndarray, "batch 3"]:
    """A point of the frame at a segment's head [m], in the frame at its foot."""
    square = (bend * bend).sum(1)
    s, v, _, _ = _functions(square)
    along = arc - (bend * point[:, :2]).sum(1)
    moved = np.empty_like(point)
    moved[:, :2] = point[:, :2] + bend * (v * along + s * point[:, 2])[:, None]
    moved[:, 2] = point[:, 2] * (1 - v * square) + s * along
    return moved


def turn_of(bend: Float[np.ndarray, "batch 2"]) -> Float[np.ndarray, "batch 3 3"]:
    """The turn from a segment's foot to its head, for its bend vector [rad]."""
    square = (bend * bend).sum(1)
    s, v, _, _ = _functions(square)
    turn = np.empty((len(bend), 3, 3))
    turn[:, :2, :2] = np.eye(2) - v[:, None, None] * bend[:, :, None] * bend[:, None, :]
    turn[:, :2, 2] = s[:, None] * bend
    turn[:, 2, :2] = -s[:, None] * bend
    turn[:, 2, 2] = 1 - v * square
    return turn


def features(u: Float[np.ndarray, "batch own"], order: int) -> Float[np.ndarray, "batch features"]:
    """Products of a segment's scaled actuators up to an order, the constant first, then the actuators."""
    return np.stack([np.prod(u[:, list(power)], axis=1) for power in _powers(u.shape[1], order)], axis=1)


def feature_slopes(u: Float[np.ndarray, "batch own"], order: int) -> Float[np.ndarray, "batch features own"]:
    """How those products change with each scaled actuator."""
    powers = _powers(u.shape[1], order)
    slopes = np.zeros((len(u), len(powers), u.shape[1]))
    for row, power in enumerate(powers):
        for place, name in enumerate(power):
            slopes[:, row, name] += np.prod(u[:, [*power[:place], *power[place + 1 :]]], axis=1)
    return slopes


def degrees(size: int, order: int) -> Int[np.ndarray, " features"]:
    """How many actuators each product has."""
    return np.array([len(power) for power in _powers(size, order)])


def _powers(size: int, order: int) -> list[tuple[int, ...]]:
    return [power for degree in range(order + 1) for power in combinations_with_replacement(range(size), degree)]


def _own(shape: Shape, u: Rows, segment: int) -> Float[np.ndarray, "batch own"]:
    first = sum(shape.sizes[:segment])
    return u[:, first : first + shape.sizes[segment]]


def _bend(
    shape: Shape, numbers: Float[np.ndarray, " numbers"], where: Places, u: Rows, segment: int
) -> tuple[Float[np.ndarray, "batch 2"], Float[np.ndarray, " batch"]]:
    values = features(_own(shape, u, segment), shape.order) @ numbers[where.segments[segment]].reshape(3, -1).T
    return values[:, :2], values[:, 2]


def _tip_offset(numbers: Float[np.ndarray, " numbers"], where: Places, count: int) -> Float[np.ndarray, "batch 3"]:
    return np.tile(numbers[where.tip], (count, 1))


def _carry_slope(
    bend: Float[np.ndarray, "batch 2"], arc: Float[np.ndarray, " batch"], point: Float[np.ndarray, "batch 3"]
) -> Float[np.ndarray, "batch 3 3"]:
    """How a carried point changes with b_x, b_y and L."""
    square = (bend * bend).sum(1)
    s, v, ds, dv = _functions(square)
    along, z = arc - (bend * point[:, :2]).sum(1), point[:, 2]
    slope = np.empty((len(bend), 3, 3))
    # d(v along + s z) / db, the factor of b in the sideways part
    factor = 2 * (dv * along + ds * z)[:, None] * bend - v[:, None] * point[:, :2]
    slope[:, :2, :2] = (v * along + s * z)[:, None, None] * np.eye(2) + bend[:, :, None] * factor[:, None, :]
    slope[:, 2, :2] = (2 * ds * along - s * z)[:, None] * bend - s[:, None] * point[:, :2]
    slope[:, :2, 2] = v[:, None] * bend
    slope[:, 2, 2] = s
    return slope


def _functions(square: Float[np.ndarray, " batch"]) -> tuple[Float[np.ndarray, " batch"], ...]:
    """``s``, ``v`` and their derivatives by theta^2, exact at zero."""
    small = square < _SERIES_BELOW
    safe = np.where(small, 1.0, square)
    t = np.sqrt(safe)
    s, v = np.sin(t) / t, (1 - np.cos(t)) / safe
    ds, dv = (np.cos(t) - s) / (2 * safe), (s / 2 - v) / safe
    if small.any():
        x = np.where(small, square, 0.0)
        for value, series in zip((s, v, ds, dv), _series(x), strict=True):
            value[small] = series[small]
    return s, v, ds, dv


def _series(x: Float[np.ndarray, " batch"]) -> tuple[Float[np.ndarray, " batch"], ...]:
    k = np.arange(9)
    sign, odd, even = (-1.0) ** k, _FACTORIALS[2 * k], _FACTORIALS[2 * k + 1]  # (2 k + 1)!, (2 k + 2)!
    s, v = np.polynomial.Polynomial(sign / odd), np.polynomial.Polynomial(sign / even)
    return s(x), v(x), s.deriv()(x), v.deriv()(x)
