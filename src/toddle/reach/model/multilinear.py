"""A rigid arm of few joints, by one linear regression: the tip is multilinear in 1, cos q, sin q of each joint.

Every joint of a rigid chain turns or slides about a line that the joints before it carry along, so each coordinate of
the tip is a sum of products with one factor of each joint: 1, cos q_i or sin q_i where it turns, 1 or q_i where it
slides. 3^n coefficients an axis, found by ridge regression; the ridge is the one of greatest evidence (MacKay 1992,
"Bayesian interpolation"), for which one eigendecomposition serves every ridge that is tried.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from toddle.failures import BadInput
from toddle.reach.model.model import Fit
from toddle.signals import Experience

MOST = 3**7  # coefficients an axis: seven turning joints
_TRIED = 3**5  # up to here it is affordable to try each joint either way
_EXACT = 1e-16  # [m^2]: misses that are rounding
_LEAST, _GREATEST = -26.0, 0.0  # ridge: powers of ten of the largest eigenvalue


@dataclass(frozen=True)
class Multilinear:
    """A tip that is multilinear in functions of each joint; a `toddle.reach.model.model.Model`.

    Attributes:
        slides: joints that slide; the others turn.
        middle: what is taken from the joint values first [rad or m].
        weights: coefficients [m].
        root: a square root of the coefficients' covariance for a unit of noise.
        noise: covariance of the seen tip about the model [m^2].
    """

    slides: Bool[np.ndarray, " joints"]
    middle: Float[np.ndarray, " joints"]
    weights: Float[np.ndarray, "features space"]
    root: Float[np.ndarray, "features rank"]
    noise: Float[np.ndarray, "space space"]

    @property
    def space(self) -> int:
        """How many coordinates the tip's position has."""
        return self.weights.shape[1]

    def forward(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch space"]:
        """Tip positions [m] for joint values [rad or m]."""
        return features(q - self.middle, self.slides) @ self.weights

    def slope(
        self, q: Float[np.ndarray, "batch joints"]
    ) -> tuple[Float[np.ndarray, "batch space"], Float[np.ndarray, "batch space joints"]]:
        """Tip positions [m], and how they change with the joint values."""
        factors = _factors(q - self.middle, self.slides)
        slopes = _factor_slopes(q - self.middle, self.slides)
        columns = [
            _products([*factors[:i], slopes[i], *factors[i + 1 :]]) @ self.weights for i in range(len(self.slides))
        ]
        return _products(factors) @ self.weights, np.stack(columns, axis=2)

    def spread(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch space space"]:
        """Covariance of what the model may be wrong by at each posture [m^2]."""
        share = np.sum((features(q - self.middle, self.slides) @ self.root) ** 2, axis=1)
        return share[:, None, None] * self.noise


def fit_multilinear(
    experience: Experience,
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    *,
    seed: int = 0,
    slides: Bool[np.ndarray, " joints"] | None = None,
) -> Fit:
    """Learn a rigid arm of few joints.

    Args:
        experience: the movements [rad or m, m].
        lower, upper: the joints' limits [rad or m].
        seed: not used, nothing is drawn; every fit has one.
        slides: joints that slide; None: found by the evidence of each joint taken either way, up to five joints;
            taken as none beyond.

    Raises:
        BadInput: the arm has too many joints, or there are fewer movements than joints.
    """
    start, middle = time.perf_counter(), (lower + upper) / 2
    sliding = np.zeros(len(lower), bool) if slides is None else slides
    if np.prod(np.where(sliding, 2.0, 3.0)) > MOST:
        raise BadInput(
            f"{len(lower)} joints are too many for products of all of them", remedy="learn it as screws or a network"
        )
    if len(experience.q) < len(lower) + 1:
        raise BadInput(f"{len(experience.q)} movements", remedy=f"give {len(lower) + 1} or more")
    best = _regress(experience, middle, sliding)
    while slides is None and 3 ** len(lower) <= _TRIED:
        others = [_regress(experience, middle, sliding ^ (np.arange(len(lower)) == i)) for i in range(len(lower))]
        better = min(others, key=lambda other: other.surprise)
        if better.surprise >= best.surprise or not _clearly_less(better, best):
            break
        sliding, best = better.model.slides, better
    miss = np.linalg.norm(experience.x - best.model.forward(experience.q), axis=1)
    sensor = float(np.sqrt(np.trace(best.model.noise) / experience.x.shape[1]))
    notes = tuple(f"joint {i + 1} of {len(lower)} slides" for i in np.flatnonzero(sliding))
    wild = np.zeros(len(miss), bool)
    return Fit(best.model, "multilinear", miss, sensor, wild, time.perf_counter() - start, notes)


def features(
    q: Float[np.ndarray, "batch joints"], slides: Bool[np.ndarray, " joints"]
) -> Float[np.ndarray, "batch features"]:
    """All products of one function of each joint."""
    return _products(_factors(q, slides))


class _Regression(NamedTuple):
    surprise: float  # negative log evidence, up to a constant
    model: Multilinear


def _clearly_less(one: _Regression, other: _Regression) -> bool:
    """Whether one misses less; a joint that doesn't move the tip is simpler as a slide, and turns nevertheless."""
    return bool(np.trace(one.model.noise) + _EXACT < 0.8 * (np.trace(other.model.noise) + _EXACT))


def _regress(
    experience: Experience, middle: Float[np.ndarray, " joints"], slides: Bool[np.ndarray, " joints"]
) -> _Regression:
    """Ridge regression, its ridge of greatest evidence with the noise profiled out."""
    x, (count, space) = experience.x, experience.x.shape
    matrix = features(experience.q - middle, slides)
    left, size, right = np.linalg.svd(matrix, full_matrices=False)
    along = left.T @ x
    outside = np.sum(x**2) - np.sum(along**2)
    ridges = size[0] ** 2 * np.logspace(_LEAST, _GREATEST, 400)
    shrink = 1 + size**2 / ridges[:, None]
    chi = np.sum(np.sum(along**2, axis=1) / shrink, axis=1) + max(outside, 0.0)
    surprise = 0.5 * space * (np.sum(np.log(shrink), axis=1) + count * np.log(chi))
    best = int(np.argmin(surprise))
    ridge = ridges[best]
    weights = right.T @ (size[:, None] * along / (size**2 + ridge)[:, None])
    # as many numbers as movements explain all of them: then the noise is that of the evidence, chi over the count
    noise = chi[best] / (count * space) * _shape(x - matrix @ weights)
    seen = right.T / np.sqrt(size**2 + ridge)
    return _Regression(
        float(surprise[best]), Multilinear(slides, middle, weights, _with_unseen(seen, right, ridge), noise)
    )


def _with_unseen(
    seen: Float[np.ndarray, "features rank"], right: Float[np.ndarray, "rank features"], ridge: float
) -> Float[np.ndarray, "features _"]:
    """The covariance's root with the directions that no movement showed, where only the ridge limits the weights."""
    if len(right) == right.shape[1]:
        return seen
    unseen = np.linalg.qr(right.T, mode="complete")[0][:, len(right) :]
    return np.concatenate([seen, unseen / np.sqrt(ridge)], axis=1)


def _shape(rest: Float[np.ndarray, "movements space"]) -> Float[np.ndarray, "space space"]:
    """How residuals share out among the axes: their covariance, scaled to a mean variance of one."""
    matrix = rest.T @ rest
    return matrix / max(np.trace(matrix) / len(matrix), 1e-300)


def _factors(
    q: Float[np.ndarray, "batch joints"], slides: Bool[np.ndarray, " joints"]
) -> list[Float[np.ndarray, "batch _"]]:
    one = np.ones(len(q))
    return [
        np.stack([one, value] if sliding else [one, np.cos(value), np.sin(value)], axis=1)
        for value, sliding in zip(q.T, slides, strict=True)
    ]


def _factor_slopes(
    q: Float[np.ndarray, "batch joints"], slides: Bool[np.ndarray, " joints"]
) -> list[Float[np.ndarray, "batch _"]]:
    one, zero = np.ones(len(q)), np.zeros(len(q))
    return [
        np.stack([zero, one] if sliding else [zero, -np.sin(value), np.cos(value)], axis=1)
        for value, sliding in zip(q.T, slides, strict=True)
    ]


def _products(factors: list[Float[np.ndarray, "batch _"]]) -> Float[np.ndarray, "batch features"]:
    whole = factors[0]
    for factor in factors[1:]:
        whole = (whole[:, :, None] * factor[:, None, :]).reshape(len(whole), -1)
    return whole
