"""Levenberg-Marquardt for the numbers of a soft arm, with a quadratic prior and weighted movements.

    least over the numbers:  sum_m w_m |x_m - tip(q_m)|^2 / sigma^2 + prior,

the damping after Nielsen (1999), in units of each number's size, and the wild movements told apart afterwards.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from toddle.reach.model.curvature_chain import Shape, number_slopes, tips
from toddle.reach.model.curvature_prior import Normal

_WILD = 25.0  # squared distance in units of sigma: by chance one movement in 60,000
_MEDIAN = {2: 1.386, 3: 2.366}  # of chi squared


class Seen(NamedTuple):
    """Movements and what each counts for."""

    q: Float[np.ndarray, "movements joints"]
    x: Float[np.ndarray, "movements space"]
    weight: Float[np.ndarray, " movements"]


def descend(
    shape: Shape,
    numbers: Float[np.ndarray, " numbers"],
    seen: Seen,
    prior: Normal,
    sizes: Float[np.ndarray, " numbers"],
    sigma: float,
    iterations: int,
) -> tuple[Float[np.ndarray, " numbers"], float]:
    """The numbers of least cost that a way downhill from the given ones leads to, and that cost."""

    def cost(at: Float[np.ndarray, " numbers"]) -> float:
        miss = seen.x - tips(shape, at, seen.q)
        return float(seen.weight @ (miss * miss).sum(1)) / sigma**2 + float(
            at @ (prior.precision @ at - 2 * prior.pull)
        )

    now, damping, growth = cost(numbers), -1.0, 2.0
    normal = gradient = np.zeros(0)
    for _ in range(iterations):
        if growth == 2.0:
            data = quadratic(shape, numbers, seen, sigma)
            normal = (data.precision + prior.precision) * np.outer(sizes, sizes)
            gradient = sizes * (data.pull + prior.pull - (data.precision + prior.precision) @ numbers)
            damping = 1e-3 * float(np.median(np.diag(normal))) if damping < 0 else damping
        step = np.linalg.solve(normal + damping * np.eye(len(numbers)), gradient)
        tried = numbers + sizes * step
        gain = now - cost(tried)
        if gain > 0:
            numbers, now, growth = tried, now - gain, 2.0
            damping *= max(1 / 3, 1 - (2 * gain / float(step @ (damping * step + gradient)) - 1) ** 3)
            if gain < 1e-4:  # of one movement's standard error: further steps change nothing that can be known
                break
        else:
            damping, growth = damping * growth, growth * 2
            if growth > 2.0**12:
                break
    return numbers, now


def quadratic(shape: Shape, numbers: Float[np.ndarray, " numbers"], seen: Seen, sigma: float) -> Normal:
    """What the movements say of the numbers near the given ones, linearised."""
    tip, slope = number_slopes(shape, numbers, seen.q)
    flat = slope.reshape(-1, len(numbers))
    weighted = (slope * (seen.weight / sigma**2)[:, None, None]).reshape(flat.shape)
    precision = weighted.T @ flat
    return Normal(precision, precision @ numbers + weighted.T @ (seen.x - tip).ravel())


def spread_of(miss: Float[np.ndarray, "movements space"]) -> float:
    """Standard deviation on each axis [m], from the median, which wild movements hardly touch."""
    return float(np.sqrt(np.median((miss * miss).sum(1)) / _MEDIAN[miss.shape[1]])) + 1e-12


def tame(miss: Float[np.ndarray, "movements space"], sigma: float) -> Bool[np.ndarray, " movements"]:
    """Movements that are no outliers at a standard deviation on each axis [m]."""
    return (miss * miss).sum(1) <= _WILD * sigma**2


def doubted(miss: Float[np.ndarray, "movements space"], width: float) -> Float[np.ndarray, " movements"]:
    """Weights after Geman and McClure: half the slope at a distance of about the width [m], none far from it."""
    return 1 / (1 + (miss * miss).sum(1) / width**2) ** 2
