"""A body learned with nothing assumed but smoothness: Gaussian process regression of the tip on the joint values.

The covariance of two postures is the squared exponential of their distance in an embedding z(q), where a turning joint
stands as (cos, sin) and any other as itself, each with its own weight w (MacKay 1998, "Introduction to Gaussian
processes", periodic covariance):

    k(q, q') = exp(-|z - z'|^2 / 2) = exp(sum_i w_i^2 (cos(q_i - q_i') - 1))        for turning joints.

The weights and the noise are those of greatest evidence (Rasmussen and Williams 2006, equation 5.8) on a part of the
movements, the scale profiled out; the prediction is exact, over all of them (equation 2.25). How wrong it may be is
the posterior variance (equation 2.26), from a part of the movements, tied to the whole by leave-one-out variances
(equation 5.12).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.linalg import cho_solve, cholesky, solve_triangular
from scipy.optimize import minimize

from toddle.failures import BadInput
from toddle.reach.model.model import Fit
from toddle.signals import Experience

MOST = 10_000  # movements that the exact prediction takes in: its cost grows with their cube
_EVIDENCE = (500, 1500)  # movements that the weights are first sought with, and then mended with
_PART, _LEFT_OUT = 1000, 300
_ROWS = 512  # postures at a time, so that the covariances stay in the cache
_LEAST_NOISE = 1e-10  # of the variance: what keeps the covariance positive in float64

Embed = Float[np.ndarray, "batch parts"]


class Embedding(NamedTuple):
    """Where postures stand for the covariance.

    Attributes:
        turns: joints whose value is an angle.
        weight: of each joint, the inverse of its length scale [1/rad or 1/m].
    """

    turns: Bool[np.ndarray, " joints"]
    weight: Float[np.ndarray, " joints"]

    def of(self, q: Float[np.ndarray, "batch joints"]) -> Embed:
        """The embedded postures: cosines and sines of the turning joints, then the others."""
        angle, w = q[:, self.turns], self.weight[self.turns]
        others = (q * self.weight)[:, ~self.turns]
        return np.concatenate([w * np.cos(angle), w * np.sin(angle), others], axis=1)

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


@dataclass(frozen=True)
class Kernel:
    """A Gaussian process for the tip; a `toddle.reach.model.model.Model`.

    Attributes:
        embedding: where postures stand.
        known: the embedded postures of the movements.
        weights: what each of them adds to the prediction [m].
        mean: the tip's mean [m].
        part: movements (rows of `known`) whose variance stands for that of all.
        root: inverse of the Cholesky factor of their covariance.
        scatter: covariance of the error for a unit of variance [m^2].
        law: the variance of all is ``exp(law[0]) * part's ** law[1]``.
    """

    embedding: Embedding
    known: Float[np.ndarray, "movements parts"]
    weights: Float[np.ndarray, "movements space"]
    mean: Float[np.ndarray, " space"]
    part: Float[np.ndarray, "part parts"]
    root: Float[np.ndarray, "part part"]
    scatter: Float[np.ndarray, "space space"]
    law: tuple[float, float]

    @property
    def space(self) -> int:
        """How many coordinates the tip's position has."""
        return len(self.mean)

    def forward(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch space"]:
        """Tip positions [m] for joint values [rad or m]."""
        rows = [covariance(self.embedding.of(some), self.known) @ self.weights for some in _split(q)]
        return self.mean + np.concatenate(rows)

    def slope(
        self, q: Float[np.ndarray, "batch joints"]
    ) -> tuple[Float[np.ndarray, "batch space"], Float[np.ndarray, "batch space joints"]]:
        """Tip positions [m], and how they change with the joint values."""
        # d k / d z = k (z' - z): the sums over movements of k w and of k w z' give the slope of every part at once
        tips, slopes = [], []
        for some in _split(q):
            z = self.embedding.of(some)
            sums = covariance(z, self.known) @ self._moments
            tip, moment = sums[:, : self.space], sums[:, self.space :].reshape(len(z), self.space, -1)
            tips.append(self.mean + tip)
            slopes.append(self.embedding.chain(some, moment - tip[:, :, None] * z[:, None, :]))
        return np.concatenate(tips), np.concatenate(slopes)

    @cached_property
    def _moments(self) -> Float[np.ndarray, "movements _"]:
        moments = (self.weights[:, :, None] * self.known[:, None, :]).reshape(len(self.known), -1)
        return np.concatenate([self.weights, moments], axis=1)

    def spread(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch space space"]:
        """Covariance of what the model may be wrong by at each posture [m^2]."""
        variance = np.concatenate([_variance(self.embedding.of(some), self.part, self.root) for some in _split(q)])
        return (np.exp(self.law[0]) * variance ** self.law[1])[:, None, None] * self.scatter


def fit_kernel(
    experience: Experience,
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    *,
    turns: Bool[np.ndarray, " joints"] | None = None,
    seed: int = 0,
    most: int = MOST,
    tell: Callable[[float], None] | None = None,
) -> Fit:
    """Learn any body from some hundred to ten thousand movements.

    Args:
        experience: the movements [rad or m, m].
        lower, upper: the joints' limits [rad or m].
        turns: joints whose value is an angle [rad]; None: all of them or none, whichever explains the movements better.
        seed: which movements stand for all where a part is enough.
        most: movements that the prediction takes in; from more, as many are drawn.
        tell: called with the fraction done.

    Raises:
        BadInput: there are fewer than four movements a joint.
    """
    start, rng = time.perf_counter(), np.random.default_rng(seed)
    if len(experience.q) < 4 * len(lower):
        raise BadInput(f"{len(experience.q)} movements of {len(lower)} joints", remedy=f"give {4 * len(lower)} or more")
    mean = experience.x.mean(0)
    order = rng.permutation(len(experience.q))
    q, y, few = experience.q[order], experience.x[order] - mean, _EVIDENCE[0]
    sides = [np.full(len(lower), side) for side in (True, False)] if turns is None else [turns]
    firsts = [_Guess(side, np.where(side, 0.7, 1.5 / (upper - lower)), 1e-4, np.inf) for side in sides]
    guess = min((_improved(first, q[:few], y[:few], 40) for first in firsts), key=lambda each: each.surprise)
    if len(q) > few:
        guess = _improved(guess, q[: _EVIDENCE[1]], y[: _EVIDENCE[1]], 15)
    embedding, noise = Embedding(guess.turns, guess.weight), guess.noise
    if tell is not None:
        tell(0.3)
    chosen = rng.permutation(len(experience.q))[:most]
    model, scale = _exact(embedding, noise, experience.q[chosen], experience.x[chosen], rng)
    miss = np.linalg.norm(experience.x - model.forward(experience.q), axis=1)
    if tell is not None:
        tell(1.0)
    kind = "angles" if embedding.turns.any() else "no angles"
    notes = (f"nothing was assumed but smoothness (joints taken as {kind}); {len(chosen)} movements are remembered",)
    sensor = float(np.sqrt(noise * scale))
    return Fit(model, "kernel", miss, sensor, np.zeros(len(miss), bool), time.perf_counter() - start, notes)


def covariance(z: Embed, known: Float[np.ndarray, "known parts"]) -> Float[np.ndarray, "batch known"]:
    """Covariances of embedded postures, 1 for equal ones."""
    half = z @ known.T
    half -= 0.5 * np.sum(z * z, axis=1)[:, None]
    half -= 0.5 * np.sum(known * known, axis=1)
    return np.exp(np.minimum(half, 0.0, out=half), out=half)


def _split(q: Float[np.ndarray, "batch joints"]) -> list[np.ndarray]:
    return np.array_split(q, max(1, -(-len(q) // _ROWS)))


def _variance(z: Embed, part: Embed, root: Float[np.ndarray, "part part"]) -> Float[np.ndarray, " batch"]:
    """What the movements of a part leave open (equation 2.26), for a unit of variance."""
    return np.maximum(1.0 - np.sum((covariance(z, part) @ root.T) ** 2, axis=1), 1e-12)


def _exact(
    embedding: Embedding,
    noise: float,
    q: Float[np.ndarray, "movements joints"],
    x: Float[np.ndarray, "movements space"],
    rng: np.random.Generator,
) -> tuple[Kernel, float]:
    """The prediction from all movements (equation 2.25), and the variance's scale [m^2]."""
    known, mean = embedding.of(q), x.mean(0)
    matrix = covariance(known, known)
    matrix[np.diag_indices_from(matrix)] += noise
    factor = cholesky(matrix, lower=True, overwrite_a=True, check_finite=False)
    weights = cho_solve((factor, True), x - mean, check_finite=False)
    scale = float(np.sum((x - mean) * weights) / x.size)
    left = rng.permutation(len(q))[:_LEFT_OUT]
    unit = np.zeros((len(q), len(left)))
    unit[left, np.arange(len(left))] = 1.0
    precision = np.sum(solve_triangular(factor, unit, lower=True, check_finite=False) ** 2, axis=0)
    missed = weights[left] / precision[:, None]
    # what the variances say is right on average; the errors left out tell their true size and their directions
    scatter = (missed * precision[:, None]).T @ missed / len(left)
    part = embedding.of(q[rng.permutation(len(q))[:_PART]])
    root = cholesky(covariance(part, part) + max(noise, 1e-8) * np.eye(len(part)), lower=True)
    root = solve_triangular(root, np.eye(len(part)), lower=True)
    law = _law(_variance(known[left], part, root), np.maximum(1 / precision - noise, 1e-3 * noise))
    return Kernel(embedding, known, weights, mean, part, root, scatter, law), scale


def _law(parts: Float[np.ndarray, " left"], whole: Float[np.ndarray, " left"]) -> tuple[float, float]:
    """The power law that leads from the variance given a part of the movements to that given all."""
    use = parts > 1e-6  # a movement of the part itself is no measure
    if use.sum() < 20:
        return float(np.log(np.mean(whole) / np.mean(parts))), 1.0
    power, factor = np.polyfit(np.log(parts[use]), np.log(whole[use]), 1)
    return float(factor), float(np.clip(power, 0.2, 4.0))


class _Guess(NamedTuple):
    turns: np.ndarray
    weight: np.ndarray
    noise: float  # of the variance
    surprise: float  # negative log evidence, up to a constant


def _improved(
    guess: _Guess, q: Float[np.ndarray, "movements joints"], y: Float[np.ndarray, "movements space"], iterations: int
) -> _Guess:
    """The weights and the noise of greatest evidence."""
    apart = q.T[:, :, None] - q.T[:, None, :]
    apart = np.where(guess.turns[:, None, None], np.cos(apart) - 1, -0.5 * apart**2)
    first = np.append(2 * np.log(guess.weight), np.log(guess.noise))
    bounds = [*((log - 9, log + 9) for log in first[:-1]), (np.log(_LEAST_NOISE), 0.0)]
    options = {"maxiter": iterations}
    found = minimize(_surprise, first, (apart, y), jac=True, method="L-BFGS-B", bounds=bounds, options=options)
    return _Guess(guess.turns, np.exp(found.x[:-1] / 2), float(np.exp(found.x[-1])), float(found.fun))


def _surprise(
    logs: Float[np.ndarray, " numbers"],
    apart: Float[np.ndarray, "joints movements movements"],
    y: Float[np.ndarray, "movements space"],
) -> tuple[float, Float[np.ndarray, " numbers"]]:
    """Negative log evidence of squared weights and noise, the scale profiled out, and its gradient (equation 5.9)."""
    squares, noise, (count, space) = np.exp(logs[:-1]), np.exp(logs[-1]), y.shape
    kernel = np.exp(np.tensordot(squares, apart, 1))
    factor = cholesky(kernel + noise * np.eye(count), lower=True, check_finite=False)
    inverse = cho_solve((factor, True), np.eye(count), check_finite=False)
    alpha = inverse @ y
    scale = np.sum(y * alpha) / y.size
    value = space * np.sum(np.log(np.diag(factor))) + 0.5 * y.size * np.log(scale)
    slope = 0.5 * (space * inverse - alpha @ alpha.T / scale)
    weighted = (slope * kernel).ravel()
    gradient = squares * (apart.reshape(len(squares), -1) @ weighted)
    return float(value), np.append(gradient, noise * np.trace(slope))
