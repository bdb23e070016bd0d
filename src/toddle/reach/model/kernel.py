"""A body learned with nothing assumed but smoothness, from hundreds to ten thousand movements: a Gaussian process.

The covariance of two postures is learned first (`toddle.reach.model.covariance`). The prediction is exact, over all
movements (Rasmussen and Williams 2006, equation 2.25). How wrong it may be is the posterior variance (equation 2.26)
from a part of the movements, led to that of all, and to the size of the errors, by leaving movements out (equation
5.12).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float
from scipy.linalg import cho_solve, cholesky, solve_triangular

from toddle.failures import BadInput
from toddle.reach.model.covariance import Doubt, Embedding, covariance, doubt_from, learn_covariance, rows
from toddle.reach.model.model import Fit
from toddle.signals import Experience

MOST = 10_000  # movements that the exact prediction takes in: its cost grows with their cube
PART, _LEFT_OUT = 1000, 300


@dataclass(frozen=True)
class Kernel:
    """A Gaussian process for the tip; a `toddle.reach.model.model.Model`.

    Attributes:
        embedding: where postures stand.
        known: the embedded postures of the movements.
        weights: what each of them adds to the prediction [m].
        mean: the tip's mean [m].
        doubt: how wrong it may be.
    """

    embedding: Embedding
    known: Float[np.ndarray, "movements parts"]
    weights: Float[np.ndarray, "movements space"]
    mean: Float[np.ndarray, " space"]
    doubt: Doubt

    @property
    def space(self) -> int:
        """How many coordinates the tip's position has."""
        return len(self.mean)

    def forward(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch space"]:
        """Tip positions [m] for joint values [rad or m]."""
        tips = [covariance(self.embedding.of(some), self.known) @ self.weights for some in rows(q)]
        return self.mean + np.concatenate(tips)

    def slope(
        self, q: Float[np.ndarray, "batch joints"]
    ) -> tuple[Float[np.ndarray, "batch space"], Float[np.ndarray, "batch space joints"]]:
        """Tip positions [m], and how they change with the joint values."""
        # d k / d z = k (z' - z): the sums over movements of k w and of k w z' give the slope of every part at once
        tips, slopes = [], []
        for some in rows(q):
            z = self.embedding.of(some)
            sums = covariance(z, self.known) @ self._moments
            tip, moment = sums[:, : self.space], sums[:, self.space :].reshape(len(z), self.space, -1)
            tips.append(self.mean + tip)
            slopes.append(self.embedding.chain(some, moment - tip[:, :, None] * z[:, None, :]))
        return np.concatenate(tips), np.concatenate(slopes)

    def spread(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch space space"]:
        """Covariance of what the model may be wrong by at each posture [m^2]."""
        return self.doubt.at(q)

    @cached_property
    def _moments(self) -> Float[np.ndarray, "movements _"]:
        moments = (self.weights[:, :, None] * self.known[:, None, :]).reshape(len(self.known), -1)
        return np.concatenate([self.weights, moments], axis=1)


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
    start, tell = time.perf_counter(), tell or (lambda _: None)
    check_count(experience, len(lower))
    chosen = np.random.default_rng(seed).permutation(len(experience.q))[:most]
    q, x = experience.q[chosen], experience.x[chosen]
    evidence = learn_covariance(q, x, lower, upper, turns)
    tell(0.4)
    model, sensor = _exact(evidence.embedding, evidence.noise, q, x)
    miss = np.linalg.norm(experience.x - model.forward(experience.q), axis=1)
    tell(1.0)
    taken = "as angles" if evidence.embedding.turns.any() else "as no angles"
    notes = (f"nothing was assumed but smoothness (joint values taken {taken}); {len(q)} movements are remembered",)
    return Fit(model, "kernel", miss, sensor, np.zeros(len(miss), bool), time.perf_counter() - start, notes)


def check_count(experience: Experience, joints: int) -> None:
    """Refuse movements that are too few to learn anything from."""
    if len(experience.q) < 4 * joints:
        raise BadInput(f"{len(experience.q)} movements of {joints} joints", remedy=f"give {4 * joints} or more")


def _exact(
    embedding: Embedding,
    noise: float,
    q: Float[np.ndarray, "movements joints"],
    x: Float[np.ndarray, "movements space"],
) -> tuple[Kernel, float]:
    """The prediction from movements in random order (equation 2.25), and the noise's standard deviation [m]."""
    known, mean = embedding.of(q), x.mean(0)
    matrix = covariance(known, known)
    matrix[np.diag_indices_from(matrix)] += noise
    factor = cholesky(matrix, lower=True, overwrite_a=True, check_finite=False)
    weights = cho_solve((factor, True), x - mean, check_finite=False)
    scale = float(np.sum((x - mean) * weights) / x.size)
    left = len(q) - min(_LEFT_OUT, len(q) // 2)
    unit = np.eye(len(q))[:, left:]
    precision = np.sum(solve_triangular(factor, unit, lower=True, check_finite=False) ** 2, axis=0)
    # what movements left out miss, against what the variances say: its true size, and its directions
    missed = weights[left:] / precision[:, None]
    scatter = (missed * precision[:, None]).T @ missed / len(missed)
    doubt = doubt_from(embedding, noise, q[: min(PART, left)], x.shape[1])
    law = _law(doubt.open(q[left:]), np.maximum(1 / precision - noise, 1e-3 * noise))
    return Kernel(embedding, known, weights, mean, doubt._replace(scatter=scatter, law=law)), float(
        np.sqrt(noise * scale)
    )


def _law(parts: Float[np.ndarray, " left"], whole: Float[np.ndarray, " left"]) -> tuple[float, float]:
    """The power law that leads from the variance given a part of the movements to that given all, right on average."""
    power = np.polyfit(np.log(parts), np.log(whole), 1)[0] if np.ptp(np.log(parts)) > 0.1 else 1.0
    power = float(np.clip(power, 0.2, 4.0))
    return float(np.log(np.mean(whole) / np.mean(parts**power))), power
