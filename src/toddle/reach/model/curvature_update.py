"""A learned soft arm goes on learning while it works: its numbers after the looks since, without a new fit.

With the numbers' covariance C from the fit, the slope J of the tips by the numbers and looks of variance s^2, the most
probable numbers after a batch of looks are reached by Gauss-Newton's steps (the iterated extended Kalman filter, Bell
and Cathey 1993):

    theta <- theta_0 + K (x - tip(theta) - J (theta_0 - theta)),  K = C J' (J C J' + s^2 I)^-1,  C <- (I - K J) C.

A look that is worth more than the movements of the fit, for its noise is less, mends the whole arm and not its
neighbourhood alone. After damage the places of the actuators are mended with it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from toddle.reach.model.crippled import Crippled, number_slope
from toddle.reach.model.curvature import Curvature
from toddle.reach.model.curvature_chain import number_slopes
from toddle.signals import Experience

_STEPS, _AT_ONCE = 3, 100


def updated(body: Curvature | Crippled, since: Experience, sensor: float) -> Curvature | Crippled:
    """The soft arm after the movements since it was learned, or since its damage was understood.

    Args:
        body: as it was learned, or as `toddle.reach.model.soft_damage.diagnose` found it.
        since: movements that it wasn't learned from [m].
        sensor: standard deviation of a look on each axis [m].
    """
    for first in range(0, len(since.q), _AT_ONCE):
        some = slice(first, first + _AT_ONCE)
        body = _updated(body, since.q[some], since.x[some], max(sensor, 1e-9))
    return body


def _updated(
    body: Curvature | Crippled,
    q: Float[np.ndarray, "looks joints"],
    x: Float[np.ndarray, "looks space"],
    sensor: float,
) -> Curvature | Crippled:
    prior, covariance = _numbers(body), _covariance(body)
    mean, noise = prior, sensor**2 * np.eye(x.size)
    slope = gain = np.zeros(0)
    for _ in range(_STEPS):
        tip, slope = _slopes(_with(body, mean, covariance), q)
        across = slope @ covariance
        gain = np.linalg.solve(across @ slope.T + noise, across).T
        mean = prior + gain @ ((x - tip).ravel() - slope @ (prior - mean))
    left = covariance - gain @ slope @ covariance
    return _with(body, mean, (left + left.T) / 2)


def _numbers(body: Curvature | Crippled) -> Float[np.ndarray, " numbers"]:
    if isinstance(body, Curvature):
        return body.numbers
    inner = body.model.numbers if isinstance(body.model, Curvature) else np.zeros(0)
    return np.concatenate([inner, body.place, body.share])


def _covariance(body: Curvature | Crippled) -> Float[np.ndarray, "numbers numbers"]:
    if isinstance(body, Curvature):
        return body.covariance
    inner = body.model.covariance if isinstance(body.model, Curvature) else np.zeros((0, 0))
    count = len(inner)
    whole = np.zeros((count + len(body.covariance),) * 2)
    whole[:count, :count], whole[count:, count:] = inner, body.covariance
    return whole


def _with(
    body: Curvature | Crippled,
    numbers: Float[np.ndarray, " numbers"],
    covariance: Float[np.ndarray, "numbers numbers"],
) -> Curvature | Crippled:
    if isinstance(body, Curvature):
        return replace(body, numbers=numbers, covariance=covariance)
    count = len(numbers) - 2 * len(body.place)
    inner = body.model
    if isinstance(inner, Curvature):
        inner = replace(inner, numbers=numbers[:count], covariance=covariance[:count, :count])
    place, share = np.split(numbers[count:], 2)
    return replace(body, model=inner, place=place, share=share, covariance=covariance[count:, count:])


def _slopes(
    body: Curvature | Crippled, q: Float[np.ndarray, "batch joints"]
) -> tuple[Float[np.ndarray, "batch space"], Float[np.ndarray, "rows numbers"]]:
    """Tips [m], and how their coordinates, one after the other, change with the numbers."""
    if isinstance(body, Curvature):
        tip, slope = number_slopes(body.shape, body.numbers, q)
        return tip, slope.reshape(tip.size, -1)
    actual = body.actual(q)
    tip, along = body.model.slope(actual)
    slope = number_slope(along, q - body.about)
    if isinstance(body.model, Curvature):
        own = number_slopes(body.model.shape, body.model.numbers, actual)[1]
        slope = np.concatenate([own, slope], axis=2)
    return tip, slope.reshape(tip.size, -1)
