"""Whether a body has the structure that it was taken to have: what a fit misses should be noise, not follow the joints.

Under the right structure the residuals r of the movements could be dealt out among the postures in any order. If they
follow the posture, postures that are near each other miss alike, and  Q = r' K r / r' r  is large, K being what "near"
is taken to mean (the score test of a variance component). Q is held against that of the residuals in random orders (a
permutation test, so that no assumption on the noise is made); the largest of four such K counts, each as a z-score.

How much follows the posture is what r ~ N(f, s^2 I) with f ~ N(0, t^2 K), both variances of greatest likelihood, says
of the size of f.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.reach.model.model import Fit
from toddle.signals import Experience

LEAST = 1e-4  # [m]: what is missed systematically by less is not worth another structure
_MOST, _ORDERS = 500, 399  # movements looked at; random orders
_LEVEL = 2  # of the orders, the true one among them, that may be as extreme: 2 / 400, the rate of false alarms


class Misfit(NamedTuple):
    """What a fit misses systematically.

    Attributes:
        size: root mean square of the tip's distance that follows the posture [m]; 0 where nothing is shown to.
        chance: share of random orders of the residuals that look as systematic.
    """

    size: float
    chance: float


def fits(experience: Experience, fit: Fit, *, least: float = LEAST) -> bool:
    """Whether nothing says that the structure is another one; wrong for 1 in 200 bodies whose structure is right.

    Args:
        experience: the movements that were fitted [rad or m, m].
        fit: the fit.
        least: systematic misses that are put up with [m].
    """
    return misfit(experience, fit).size <= least


def misfit(experience: Experience, fit: Fit, *, seed: int = 0) -> Misfit:
    """How much of what a fit misses follows the posture, and is not noise.

    Args:
        experience: the movements that were fitted [rad or m, m].
        fit: the fit; the movements that it left out as wild are left out here.
        seed: of the random orders.
    """
    rng, tame = np.random.default_rng(seed), np.flatnonzero(~fit.wild)
    some = rng.permutation(tame)[:_MOST]
    if len(some) < 20:
        return Misfit(0.0, 1.0)
    q = experience.q[some]
    rest = _tamed(experience.x[some] - fit.model.forward(q))
    kernels = _kernels((q - q.mean(0)) / np.maximum(np.ptp(q, axis=0), 1e-12))
    orders = np.concatenate([np.arange(len(some))[None], [rng.permutation(len(some)) for _ in range(_ORDERS)]])
    scores = np.stack([_scores(kernel, rest, orders) for kernel in kernels])
    scores = (scores - scores.mean(axis=1, keepdims=True)) / np.maximum(scores.std(axis=1, keepdims=True), 1e-12)
    greatest = scores.max(axis=0)
    extreme = int(np.sum(greatest >= greatest[0]))
    chance = extreme / len(orders)
    if extreme > _LEVEL:
        return Misfit(0.0, chance)
    return Misfit(_systematic(kernels[int(np.argmax(scores[:, 0]))], rest), chance)


def _tamed(rest: Float[np.ndarray, "movements space"]) -> Float[np.ndarray, "movements space"]:
    """Residuals about their mean, the longest ones shortened: single wild movements say nothing of a structure."""
    rest = rest - np.median(rest, axis=0)
    length = np.linalg.norm(rest, axis=1)
    limit = 4 * np.median(length)
    rest = rest * np.minimum(1.0, limit / np.maximum(length, 1e-300))[:, None]
    return rest - rest.mean(0)


def _kernels(u: Float[np.ndarray, "movements joints"]) -> list[Float[np.ndarray, "movements movements"]]:
    """What alike may mean: near in all joints, near in one joint at a time, products of two joints, or of three.

    The products are all those of different joints: their sum over joints is an elementary symmetric polynomial.
    """
    squares = (u[:, None] - u[None]) ** 2
    apart = squares.sum(2)
    kernels = [np.exp(-2 * apart / apart.mean()), np.exp(-squares / 0.05).mean(2)]
    z = u / u.std(axis=0).clip(1e-12)
    one, two, three = z @ z.T, z**2 @ (z**2).T, z**3 @ (z**3).T
    if u.shape[1] > 1:
        kernels.append((one**2 - two) / 2)
    if u.shape[1] > 2:
        kernels.append((one**3 - 3 * one * two + 2 * three) / 6)
    return [kernel - kernel.mean(0) - kernel.mean(1)[:, None] + kernel.mean() for kernel in kernels]


def _scores(
    kernel: Float[np.ndarray, "movements movements"],
    rest: Float[np.ndarray, "movements space"],
    orders: np.ndarray,
) -> Float[np.ndarray, " orders"]:
    """How alike near postures miss, for the residuals in each order."""
    dealt = rest[orders].transpose(1, 0, 2)
    alike = np.sum(dealt * (kernel @ dealt.reshape(len(rest), -1)).reshape(dealt.shape), axis=(0, 2))
    return alike / max(float(np.sum(rest**2)), 1e-300)


def _systematic(kernel: Float[np.ndarray, "movements movements"], rest: Float[np.ndarray, "movements space"]) -> float:
    """Root mean square of what follows the posture [m], its share of the variance that of greatest likelihood."""
    values, vectors = np.linalg.eigh(kernel)
    values = np.maximum(values, 0.0) / np.mean(np.diag(kernel))
    along = np.sum((vectors.T @ rest) ** 2, axis=1) / rest.shape[1]
    shares = np.logspace(-4, -1e-6, 200)
    variances = shares[:, None] * values + (1 - shares)[:, None]
    scale = np.mean(along / variances, axis=1)
    best = int(np.argmin(np.log(scale) + np.mean(np.log(variances), axis=1)))
    follows = shares[best] * values / variances[best]
    return float(np.sqrt(rest.shape[1] * np.mean(follows**2 * along + scale[best] * (1 - shares[best]) * follows)))
