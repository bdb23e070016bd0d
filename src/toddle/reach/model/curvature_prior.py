"""What is thought of a soft arm before it has moved: weak limits on its numbers, and regularities that it may have.

Many soft arms are regular: a segment's actuators stand in a ring, equally far from the middle line and from each other,
it is straight when they are equally long, its length is the mean of theirs, the foot is upright, the tip is in the
middle, nothing stiff is in between. None of that is assumed. Each regularity says that some linear combinations of the
numbers differ from it by a normal deviate of unknown size tau, and tau comes from the movements, as in MacKay's
evidence (1992): a regularity that the arm has is learned (tau falls to zero, and its numbers cost no accuracy any
more), and one that it hasn't is dropped (tau grows, and its numbers are free).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from toddle.reach.model.curvature_chain import Shape, degrees, places

_LEAST_TAU = 1e-6  # of the numbers' own scale
_ROUNDS, _SETTLED = 60, 1e-3


class Regularity(NamedTuple):
    """Combinations of the numbers that are near to a value: ``rows @ numbers`` is ``value`` up to ``tau``."""

    rows: Float[np.ndarray, "combinations numbers"]
    value: Float[np.ndarray, " combinations"]
    tau: float


class Normal(NamedTuple):
    """A quadratic in the numbers: precision, and precision times where its least is."""

    precision: Float[np.ndarray, "numbers numbers"]
    pull: Float[np.ndarray, " numbers"]

    def times(self, factor: float) -> Normal:
        """The quadratic times a factor."""
        return Normal(self.precision * factor, self.pull * factor)


def sizes_of_numbers(shape: Shape, scale: float) -> Float[np.ndarray, " numbers"]:
    """How large each number may well be, for tips that are spread over a scale [m]."""
    where = places(shape)
    sizes = np.empty(where.total)
    sizes[: shape.space], sizes[where.tilt], sizes[where.gaps], sizes[where.tip] = scale, 2.0, 0.1 * scale, 0.2 * scale
    for size, part in zip(shape.sizes, where.segments, strict=True):
        bend = np.where(degrees(size, shape.order) < 2, 1.0, 0.3)
        sizes[part] = np.concatenate([bend, bend, scale * bend])
    return sizes


def weak(shape: Shape, scale: float) -> list[Regularity]:
    """Nothing but the sizes of the numbers: enough to hold the few that move nothing."""
    return [Regularity(np.diag(1 / sizes_of_numbers(shape, scale)), np.zeros(places(shape).total), 1.0)]


def regularities(shape: Shape, numbers: Float[np.ndarray, " numbers"], scale: float) -> list[Regularity]:
    """What a soft arm of this shape may have in common with others; the rings' sense of turning as in the numbers."""
    where = places(shape)
    count = where.total
    foot = np.eye(count)[: shape.space] / scale
    groups = [
        (foot, np.zeros(shape.space)),
        (np.eye(count)[where.tilt], np.zeros(2)),
        (np.eye(count)[where.tip] / scale, np.zeros(3)),
        (np.eye(count)[where.gaps] / scale, np.zeros(len(shape.sizes) - 1)),
        *(_together(shape, numbers, scale, part) for part in (_ring, _straight, _equal, _mean_length)),
    ]
    groups += [_together(shape, numbers, scale, _of_degree(d)) for d in range(2, shape.order + 1)]
    return [Regularity(rows, value, 0.3) for rows, value in groups if len(rows)]


def joined(groups: list[Regularity], count: int) -> Normal:
    """The regularities as one quadratic."""
    normal = Normal(np.zeros((count, count)), np.zeros(count))
    for rows, value, tau in groups:
        normal = Normal(normal.precision + rows.T @ rows / tau**2, normal.pull + rows.T @ value / tau**2)
    return normal


def learned(groups: list[Regularity], data: Normal, floor: Normal) -> list[Regularity]:
    """The regularities with the most probable tau, by MacKay's fixed point in the quadratic of the fit.

    Args:
        groups: the regularities, with a first tau.
        data: what the movements say, as a quadratic around the fit.
        floor: the weak prior.
    """
    for _ in range(_ROUNDS):
        prior = joined(groups, len(data.pull))
        covariance = np.linalg.inv(data.precision + floor.precision + prior.precision)
        mean = covariance @ (data.pull + floor.pull + prior.pull)
        before, groups = groups, [_updated(group, mean, covariance) for group in groups]
        if all(abs(new.tau / old.tau - 1) < _SETTLED for new, old in zip(groups, before, strict=True)):
            break
    return groups


def _updated(
    group: Regularity, mean: Float[np.ndarray, " numbers"], covariance: Float[np.ndarray, "numbers numbers"]
) -> Regularity:
    off = group.rows @ mean - group.value
    known = len(off) - float(((group.rows @ covariance) * group.rows).sum()) / group.tau**2
    tau = float(np.sqrt(off @ off / max(known, 1e-6 * len(off)))) if known > 0 else group.tau
    return group._replace(tau=float(np.clip(tau, max(_LEAST_TAU, group.tau / 4), 10.0)))


class _Segment(NamedTuple):
    """One segment's weights (rows b_x, b_y, L; columns the products of its actuators), and their ranges [m]."""

    weights: Float[np.ndarray, "3 features"]
    middle: Float[np.ndarray, " own"]
    half: Float[np.ndarray, " own"]
    scale: float
    degrees: Int[np.ndarray, " features"]

    def rows(self, count: int) -> Float[np.ndarray, "rows 3 features"]:
        return np.zeros((count, *self.weights.shape))

    def all_equal(self) -> Float[np.ndarray, " features"]:
        """What the weights are multiplied with where the actuators are equally long, to first order."""
        factors = (self.degrees == 0).astype(float)
        factors[1 : 1 + len(self.half)] = (self.middle.mean() - self.middle) / self.half
        return factors


_Part = Callable[[_Segment], tuple[Float[np.ndarray, "rows 3 features"], Float[np.ndarray, " rows"]]]


def _together(
    shape: Shape, numbers: Float[np.ndarray, " numbers"], scale: float, part: _Part
) -> tuple[Float[np.ndarray, "rows numbers"], Float[np.ndarray, " rows"]]:
    """A regularity of one segment, for all of them."""
    where, all_rows, values, first = places(shape), [], [], 0
    for size, place in zip(shape.sizes, where.segments, strict=True):
        own = slice(first, first + size)
        known = degrees(size, shape.order)
        rows, value = part(_Segment(numbers[place].reshape(3, -1), shape.middle[own], shape.half[own], scale, known))
        wide = np.zeros((len(rows), where.total))
        wide[:, place] = rows.reshape(len(rows), -1)
        all_rows.append(wide)
        values.append(value)
        first += size
    return np.concatenate(all_rows), np.concatenate(values)


def _ring(segment: _Segment) -> tuple[Float[np.ndarray, "rows 3 features"], Float[np.ndarray, " rows"]]:
    """Each actuator bends as its neighbour does, turned by an equal share of the circle."""
    count, half = len(segment.half), segment.half.mean() / segment.half
    rows = segment.rows(2 * (count - 1))
    bend = segment.weights[:2, 1 : 1 + count]
    around = float(np.sign((bend[0] * np.roll(bend[1], -1) - bend[1] * np.roll(bend[0], -1)).sum()))
    angle = around * 2 * np.pi / count
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    for j in range(count - 1):
        rows[2 * j : 2 * j + 2, :2, 2 + j] = np.eye(2) * half[j + 1]
        rows[2 * j : 2 * j + 2, :2, 1 + j] = -turn * half[j]
    return rows, np.zeros(len(rows))


def _straight(segment: _Segment) -> tuple[Float[np.ndarray, "rows 3 features"], Float[np.ndarray, " rows"]]:
    """Equally long actuators don't bend."""
    rows = segment.rows(2)
    rows[0, 0] = rows[1, 1] = segment.all_equal()
    return rows, np.zeros(2)


def _equal(segment: _Segment) -> tuple[Float[np.ndarray, "rows 3 features"], Float[np.ndarray, " rows"]]:
    """Each actuator lengthens the segment as much as the next."""
    count, half = len(segment.half), segment.half.mean() / segment.half
    rows = segment.rows(count - 1)
    for j in range(count - 1):
        rows[j, 2, 1 + j], rows[j, 2, 2 + j] = half[j] / segment.scale, -half[j + 1] / segment.scale
    return rows, np.zeros(len(rows))


def _mean_length(segment: _Segment) -> tuple[Float[np.ndarray, "rows 3 features"], Float[np.ndarray, " rows"]]:
    """The segment is as long as its actuators are on average."""
    rows = segment.rows(2)
    rows[0, 2, 1 : 1 + len(segment.half)] = 1 / segment.scale
    rows[1, 2] = segment.all_equal() / segment.scale
    return rows, np.array([segment.half.mean(), segment.middle.mean()]) / segment.scale


def _of_degree(degree: int) -> _Part:
    def part(segment: _Segment) -> tuple[Float[np.ndarray, "rows 3 features"], Float[np.ndarray, " rows"]]:
        """Bend and length are linear in the actuators."""
        here = np.flatnonzero(segment.degrees == degree)
        rows = segment.rows(3 * len(here))
        for i, feature in enumerate(here):
            rows[3 * i : 3 * i + 3, :, feature] = np.diag([1.0, 1.0, 1 / segment.scale])
        return rows, np.zeros(len(rows))

    return part
