"""Where the search for a soft arm's geometry starts: what a quadratic through the movements says of it.

Near the middle of the actuators' ranges a soft arm is nearly straight along some z. A segment bent by b moves the tip
sideways by b l, l the length from the segment's middle to the tip, and draws it back along z by about b^2 l / 2, so

    z = - the direction of the summed second derivatives,  b' = -(second derivative along z) / (slope across z),

and with l all lengths follow. From there Levenberg-Marquardt finds the arm; without, half of its starts are lost.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.reach.model.curvature_chain import Shape, features, places, turn_of
from toddle.reach.model.curvature_descent import doubted

_RIDGE = 1e-3  # share of the movements: few movements don't settle every product of two actuators
_DOUBT = 4.0  # a wild movement is that many times the median from the quadratic


class Quadratic(NamedTuple):
    """A quadratic through the movements, at the middle of the ranges.

    Attributes:
        middle: the tip there [m].
        slope: by each scaled actuator [m].
        second: derivative by each scaled actuator [m].
        weight: what each movement counts for; wild ones hardly anything.
    """

    middle: Float[np.ndarray, "3"]
    slope: Float[np.ndarray, "joints 3"]
    second: Float[np.ndarray, "joints 3"]
    weight: Float[np.ndarray, " movements"]


def quadratic_of(
    shape: Shape, q: Float[np.ndarray, "movements joints"], x: Float[np.ndarray, "movements space"]
) -> Quadratic:
    """A robust quadratic through the movements; a tip in the plane is one at height zero."""
    u = (q - shape.middle) / shape.half
    count = u.shape[1]
    f = features(u, 2)
    ridge = _RIDGE * len(q) * np.diag((np.arange(f.shape[1]) > count).astype(float))
    weight, weights = np.ones(len(q)), np.zeros((f.shape[1], x.shape[1]))
    for _ in range(6):
        weights = np.linalg.solve((f.T * weight) @ f + ridge + 1e-9 * np.eye(len(ridge)), (f.T * weight) @ x)
        miss = x - f @ weights
        weight = doubted(miss, _DOUBT * float(np.median(np.linalg.norm(miss, axis=1))) + 1e-9)
    wide = np.zeros((f.shape[1], 3))
    wide[:, : x.shape[1]] = weights
    squares = 1 + count + np.cumsum([0, *range(count, 1, -1)])  # products of two, those of the first actuator first
    return Quadratic(wide[0], wide[1 : 1 + count], 2 * wide[squares], weight)


def start(
    shape: Shape, known: Quadratic, scale: float, number: int, rng: np.random.Generator
) -> Float[np.ndarray, " numbers"]:
    """Numbers to start from.

    Args:
        shape: what they mean.
        known: the quadratic.
        scale: how widely the tips are spread [m].
        number: of the start: in the even ones the foot may be anywhere, in the odd ones it is at the base frame's
            origin; from the third on they are shaken.
        rng: of the shaking.
    """
    free, shaken = number % 2 == 0, 0.0 if number < 2 else 1.0
    along = -known.second.sum(0) if free else known.middle.copy()
    along = along / (np.linalg.norm(along) + 1e-12) + 0.3 * shaken * rng.normal(size=3) * (np.arange(3) < shape.space)
    numbers, where = np.zeros(places(shape).total), places(shape)
    numbers[where.tilt] = tilt = _bend_towards(along / np.linalg.norm(along))
    frame = turn_of(tilt[None])[0]
    slope, second = known.slope @ frame, known.second @ frame
    first = slice(0, shape.sizes[0])
    drawn = max(-float(second[first, 2].sum()), 1e-3 * scale)
    length = float((slope[first, :2] ** 2).sum()) / drawn if free else float(np.linalg.norm(known.middle))
    length = float(np.clip(length, 0.5 * scale, 5 * scale)) * np.exp(0.2 * shaken * rng.normal())
    if free:
        numbers[: shape.space] = (known.middle - length * frame[:, 2])[: shape.space]
    arc, joint = length / len(shape.sizes), 0
    for i, (size, part) in enumerate(zip(shape.sizes, where.segments, strict=True)):
        weights = np.zeros((3, (part.stop - part.start) // 3))
        own = slice(joint, joint + size)
        weights[:2, 1 : 1 + size] = slope[own, :2].T / (length - (i + 0.5) * arc)
        weights[2, 0], weights[2, 1 : 1 + size] = arc, slope[own, 2]
        weights[:2, : 1 + size] += 0.15 * shaken * rng.normal(size=(2, 1 + size))
        numbers[part] = weights.ravel()
        joint += size
    return numbers


def _bend_towards(along: Float[np.ndarray, "3"]) -> Float[np.ndarray, "2"]:
    """The bend vector that turns z to a direction [rad]."""
    across = float(np.linalg.norm(along[:2]))
    angle = float(np.arctan2(across, along[2]))
    return along[:2] * (angle / across) if across > 1e-9 else np.array([angle, 0.0])
