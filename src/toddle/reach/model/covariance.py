"""How alike two postures are, learned from movements: the covariance that knows only that a body is smooth.

The covariance of two postures is the squared exponential of their distance in an embedding z(q), where a turning joint
stands as (cos, sin) and any other as itself, each with its own weight w (MacKay 1998, "Introduction to Gaussian
processes", periodic covariance):

    k(q, q') = exp(-|z - z'|^2 / 2) = exp(sum_i w_i^2 (cos(q_i - q_i') - 1))        for turning joints.

The weights and the noise are those of greatest evidence (Rasmussen and Williams 2006, equation 5.8) on a part of the
movements, the scale profiled out. A posture's variance given a part of the movements (equation 2.26) tells how far it
is from them, whatever model is fitted to them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.linalg import cho_solve, cholesky, solve_triangular
from scipy.optimize import minimize

_FIRST, _FEW, _MORE = 200, 500, 1500  # movements that the weights are sought with, ever more of them
_LEAST_NOISE = 1e-10  # of the variance: what keeps the covariance positive in float64
_ROWS = 512  # postures at a time, so that the covariances stay in the cache

Embedded = Float[np.ndarray, "batch parts"]


class Embedding(NamedTuple):
    """Where postures stand for the covariance.

    Attributes:
        turns: joints whose value is an angle.
        weight: of each joint, the inverse of its length scale [1/rad or 1/m].
    """

    turns: Bool[np.ndarray, " joints"]
    weight: Float[np.ndarray, " joints"]

    def of(self, q: Float[np.ndarray, "batch joints"]) -> Embedded:
        """The embedded postures: cosines and sines of the turning joints, then the others."""
        angle, w = q[:, self.turns], self.weight[self.turns]
        return np.concatenate([w * np.cos(angle), w * np.sin(angle), (q * self.weight)[:, ~self.turns]], axis=1)

    def chain(
        self, q: Float[np.ndarray, "batch joints"], slope: Float[np.ndarray, "batch space parts"]
    ) -> Float[np.ndarray, "batch space joints"]:
        """Slopes along the joints, of slopes along the embedding's parts."""
        angle, w, count = q[:, None, self.turns], self.weight[self.turns], int(self.turns.sum())
        along = np.empty((*slope.shape[:2], len(self.turns)))
        cos, sin, others = slope[..., :count], slope[..., count : 2 * count], slope[..., 2 * count :]
        along[..., self.turns] = w * (np.cos(angle) * sin - np.sin(angle) * cos)
        along[..., ~self.turns] = self.weight[~self.turns] * others
        return along


class Doubt(NamedTuple):
    """How wrong a model may be: the more, the farther a posture is from some of the movements.

    Attributes:
        embedding: where postures stand.
        part: embedded postures of some movements.
        root: inverse of the Cholesky factor of their covariance.
        scatter: covariance of the error where the law says 1 [m^2].
        law: factor's logarithm and power that lead from the variance given the part to that of the error.
    """

    embedding: Embedding
    part: Float[np.ndarray, "part parts"]
    root: Float[np.ndarray, "part part"]
    scatter: Float[np.ndarray, "space space"]
    law: tuple[float, float]

    def open(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, " batch"]:
        """Variance that the part leaves open at postures, of 1 (equation 2.26)."""
        shown = [
            np.sum((covariance(self.embedding.of(some), self.part) @ self.root.T) ** 2, axis=1) for some in rows(q)
        ]
        return np.maximum(1.0 - np.concatenate(shown), 1e-9)

    def at(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch space space"]:
        """Covariance of the error at postures [m^2]."""
        return (np.exp(self.law[0]) * self.open(q) ** self.law[1])[:, None, None] * self.scatter


def doubt_from(embedding: Embedding, noise: float, q: Float[np.ndarray, "part joints"], space: int) -> Doubt:
    """Doubt by distance from some movements, not yet scaled to any model's errors."""
    part = embedding.of(q)
    factor = cholesky(covariance(part, part) + max(noise, 1e-8) * np.eye(len(part)), lower=True)
    root = solve_triangular(factor, np.eye(len(part)), lower=True)
    return Doubt(embedding, part, root, np.eye(space), (0.0, 1.0))


def covariance(z: Embedded, known: Float[np.ndarray, "known parts"]) -> Float[np.ndarray, "batch known"]:
    """Covariances of embedded postures, 1 for equal ones."""
    half = z @ known.T
    half -= 0.5 * np.sum(z * z, axis=1)[:, None]
    half -= 0.5 * np.sum(known * known, axis=1)
    return np.exp(np.minimum(half, 0.0, out=half), out=half)


def rows(q: Float[np.ndarray, "batch joints"]) -> list[np.ndarray]:
    """A batch in parts whose covariances stay in the cache."""
    return np.array_split(q, max(1, -(-len(q) // _ROWS)))


class Evidence(NamedTuple):
    """What the movements say of the covariance.

    Attributes:
        embedding: of greatest evidence.
        noise: of the variance.
        surprise: negative log evidence, up to a constant.
    """

    embedding: Embedding
    noise: float
    surprise: float


def learn_covariance(
    q: Float[np.ndarray, "movements joints"],
    x: Float[np.ndarray, "movements space"],
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    turns: Bool[np.ndarray, " joints"] | None,
    *,
    mend: bool = True,
) -> Evidence:
    """The covariance of greatest evidence.

    Args:
        q, x: movements in random order [rad or m, m]; the first ones are used.
        lower, upper: the joints' limits [rad or m].
        turns: joints whose value is an angle; None: all or none, whichever has more evidence.
        mend: whether more movements are asked once the weights are near.
    """
    y, span = x - x.mean(0), np.where(upper > lower, upper - lower, 1.0)
    sides = [np.full(len(lower), side) for side in (True, False)] if turns is None else [turns]
    firsts = [Evidence(Embedding(side, np.where(side, 0.7, 1.5 / span)), 1e-4, np.inf) for side in sides]
    first = min((_improved(first, q[:_FIRST], y[:_FIRST], 25) for first in firsts), key=lambda each: each.surprise)
    found = _improved(first, q[:_FEW], y[:_FEW], 40)
    return _improved(found, q[:_MORE], y[:_MORE], 15) if mend and len(q) > _FEW else found


def _improved(
    guess: Evidence, q: Float[np.ndarray, "movements joints"], y: Float[np.ndarray, "movements space"], iterations: int
) -> Evidence:
    turns = guess.embedding.turns
    apart = q.T[:, :, None] - q.T[:, None, :]
    apart = np.where(turns[:, None, None], np.cos(apart) - 1, -0.5 * apart**2)
    first = np.append(2 * np.log(guess.embedding.weight), np.log(guess.noise))
    bounds = [*((log - 9, log + 9) for log in first[:-1]), (np.log(_LEAST_NOISE), 0.0)]
    options = {"maxiter": iterations}
    found = minimize(_surprise, first, (apart, y), jac=True, method="L-BFGS-B", bounds=bounds, options=options)
    return Evidence(Embedding(turns, np.exp(found.x[:-1] / 2)), float(np.exp(found.x[-1])), float(found.fun))


def _surprise(
    logs: Float[np.ndarray, " numbers"],
    apart: Float[np.ndarray, "joints movements movements"],
    y: Float[np.ndarray, "movements space"],
) -> tuple[float, Float[np.ndarray, " numbers"]]:
    """Negative log evidence of squared weights and noise, the scale profiled out, and its gradient (equation 5.9)."""
    squares, noise, count = np.exp(logs[:-1]), np.exp(logs[-1]), len(y)
    kernel = np.exp(np.tensordot(squares, apart, 1))
    factor = cholesky(kernel + noise * np.eye(count), lower=True, check_finite=False)
    inverse = cho_solve((factor, True), np.eye(count), check_finite=False)
    alpha = inverse @ y
    scale = max(float(np.sum(y * alpha)) / y.size, 1e-30)
    value = y.shape[1] * np.sum(np.log(np.diag(factor))) + 0.5 * y.size * np.log(scale)
    slope = 0.5 * (y.shape[1] * inverse - alpha @ alpha.T / scale)
    gradient = squares * (apart.reshape(len(squares), -1) @ (slope * kernel).ravel())
    return float(value), np.append(gradient, noise * np.trace(slope))
