"""The search for a soft arm's geometry: how actuators are shared out, starts, noise, regularities, wild movements."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from toddle.reach.model.curvature_chain import Shape, degrees, places, tips
from toddle.reach.model.curvature_descent import Seen, descend, doubted, quadratic, spread_of, tame
from toddle.reach.model.curvature_prior import joined, learned, regularities, sizes_of_numbers, weak
from toddle.reach.model.curvature_start import quadratic_of, start

_STARTS, _START_MOVEMENTS, _START_ITERATIONS = 8, 300, 60
_SAME = 1.05  # two starts that end within this ratio of spread have found the same arm
_ROUNDS = 6

Numbers = Float[np.ndarray, " numbers"]
Postures = Float[np.ndarray, "movements joints"]
Tips = Float[np.ndarray, "movements space"]


class Found(NamedTuple):
    """An arm as a search ended.

    Attributes:
        shape: what its numbers mean.
        numbers: its geometry.
        covariance: of the numbers.
        sigma: standard deviation of the tips about it on each axis [m].
        good: movements that are no outliers.
    """

    shape: Shape
    numbers: Numbers
    covariance: Float[np.ndarray, "numbers numbers"]
    sigma: float
    good: Bool[np.ndarray, " movements"]


def scale_of(x: Tips) -> float:
    """How widely tips are spread, wild ones or not [m]."""
    return float(np.sqrt(np.median(((x - np.median(x, axis=0)) ** 2).sum(1)))) + 1e-9


def groupings(count: int) -> list[tuple[int, ...]]:
    """How actuators may be shared out: equal segments of three, two or four, else mixed ones of three and two."""
    if count == 1:
        return [(1,)]
    equal = [(size,) * (count // size) for size in (3, 2, 4) if count % size == 0]
    return equal or [tuple(sizes) for sizes in _mixed(count)]


def searched(shapes: list[Shape], q: Postures, x: Tips, rng: np.random.Generator) -> tuple[Shape, Numbers, float]:
    """The likeliest of some shapes, by Schwarz' criterion on a part of the movements; its numbers and their spread."""
    some = rng.permutation(len(q))[:_START_MOVEMENTS]
    q, x = q[some], x[some]
    found = [(shape, *_best_start(shape, q, x, scale_of(x), rng)) for shape in shapes]

    def criterion(one: tuple[Shape, Numbers, float]) -> float:
        return x.size * float(np.log(one[2])) + 0.5 * len(one[1]) * float(np.log(x.size))

    return min(found, key=criterion)


def _best_start(shape: Shape, q: Postures, x: Tips, scale: float, rng: np.random.Generator) -> tuple[Numbers, float]:
    """The best of several starts, judged by the median miss; two that agree are enough."""
    known = quadratic_of(shape, q, x)
    prior, sizes = joined(weak(shape, scale), places(shape).total), sizes_of_numbers(shape, scale)
    ends: list[tuple[float, Numbers]] = []
    for number in range(_STARTS):
        numbers, weight = start(shape, known, scale, number, rng), known.weight
        for width, iterations in ((0.3, _START_ITERATIONS), (0.1, 15)):
            numbers, _ = descend(shape, numbers, Seen(q, x, weight), prior, sizes, 0.03 * scale, iterations)
            weight = doubted(x - tips(shape, numbers, q), width * scale)
        ends.append((spread_of(x - tips(shape, numbers, q)), numbers))
        ends.sort(key=lambda end: end[0])
        if len(ends) > 1 and ends[1][0] < _SAME * ends[0][0]:
            break
    return ends[0][1], ends[0][0]


def settled(shape: Shape, numbers: Numbers, sigma: float, q: Postures, x: Tips) -> Found:
    """From nearby numbers: all movements, with noise and regularities learned from them, wild movements left out."""
    scale = scale_of(x)
    floor, sizes = joined(weak(shape, scale), len(numbers)), sizes_of_numbers(shape, scale)
    groups, covariance = [], np.zeros((len(numbers), len(numbers)))
    good = tame(x - tips(shape, numbers, q), sigma)
    for _ in range(_ROUNDS):
        prior = joined([*weak(shape, scale), *groups], len(numbers))
        numbers, _ = descend(shape, numbers, Seen(q, x, good.astype(float)), prior, sizes, sigma, 20)
        miss = x - tips(shape, numbers, q)
        good = tame(miss, spread_of(miss))
        data = quadratic(shape, numbers, Seen(q, x, good.astype(float)), 1.0)
        covariance = np.linalg.inv(data.precision / sigma**2 + prior.precision)
        settled_numbers = float(np.trace(covariance @ data.precision)) / sigma**2
        last, sigma = sigma, float(np.sqrt((miss[good] ** 2).sum() / max(miss[good].size - settled_numbers, 1.0)))
        groups = learned(groups or regularities(shape, numbers, scale), data.times(1 / sigma**2), floor)
        if abs(sigma / last - 1) < 1e-4:
            break
    return Found(shape, numbers, covariance, sigma, good)


def raised(found: Found, order: int, q: Postures, x: Tips) -> Found:
    """The arm with bends and lengths of a higher order in the actuators, as far as the movements ask for it."""
    shape = found.shape._replace(order=order)
    where, old, numbers = places(shape), places(found.shape), np.zeros(places(shape).total)
    numbers[: where.tilt.stop] = found.numbers[: old.tilt.stop]
    numbers[where.gaps], numbers[where.tip] = found.numbers[old.gaps], found.numbers[old.tip]
    for size, part, before in zip(shape.sizes, where.segments, old.segments, strict=True):
        weights = np.zeros((3, len(degrees(size, order))))
        weights[:, : len(degrees(size, found.shape.order))] = found.numbers[before].reshape(3, -1)
        numbers[part] = weights.ravel()
    return settled(shape, numbers, found.sigma, q, x)


def _mixed(count: int) -> list[list[int]]:
    if count == 0:
        return [[]]
    return [[size, *rest] for size in (3, 2) if size <= count for rest in _mixed(count - size)]
