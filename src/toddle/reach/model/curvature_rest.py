"""A soft arm that isn't quite arcs of constant curvature: what is to be added to them, if it pays on unseen movements.

First bends and lengths may be of second or third order in a segment's own actuators (actuators that are not linear).
What is still missed (gravity, curvature that varies along a segment) is taken for a polynomial of third order in all
actuators, its coefficients' sizes, one for each order, and the noise those of greatest evidence (MacKay 1992). Both
are kept only where they miss movements that were held out by less.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.reach.model.curvature_chain import Rows, degrees, feature_slopes, features, places, tips
from toddle.reach.model.curvature_search import Found, Postures, Tips, raised, settled
from toddle.reach.model.model import Model

_ORDERS = 2, 3
_HELD_OUT, _MOST_HELD_OUT, _MOST_TRIED = 0.2, 400, 1000
_PAYS = 0.97  # of the held-out miss: what an addition must bring it to
_ROUNDS = 20


class Rest(NamedTuple):
    """A polynomial in all actuators, scaled to [-1, 1] over their ranges.

    Attributes:
        order: its order.
        middle: actuator values where they are 0 [m].
        half: what 1 adds to them [m].
        weights: of the products of the actuators [m].
        covariance: of the weights, the same for each coordinate [m^2].
    """

    order: int
    middle: Float[np.ndarray, " joints"]
    half: Float[np.ndarray, " joints"]
    weights: Float[np.ndarray, "features space"]
    covariance: Float[np.ndarray, "features features"]

    def features(self, q: Rows) -> Float[np.ndarray, "batch features"]:
        """Products of the scaled actuators."""
        return features((q - self.middle) / self.half, self.order)

    def slopes(self, q: Rows) -> Float[np.ndarray, "batch space joints"]:
        """How the polynomial changes with the actuators [m/m]."""
        slopes = feature_slopes((q - self.middle) / self.half, self.order)
        return np.tensordot(self.weights.T, slopes, (1, 1)).transpose(1, 0, 2) / self.half


@dataclass(frozen=True)
class Mended:
    """A structure that isn't quite the body's, and what it misses; a `toddle.reach.model.model.Model`.

    Attributes:
        structure: what explains most.
        rest: what is added to it; None: nothing.
        floor: variance on each axis of what both miss systematically [m^2].
    """

    structure: Model
    rest: Rest | None
    floor: float

    @property
    def space(self) -> int:
        """How many coordinates the tip's position has."""
        return self.structure.space

    def forward(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch space"]:
        """Tip positions [m] for actuator values [m]."""
        tip = self.structure.forward(q)
        return tip if self.rest is None else tip + self.rest.features(q) @ self.rest.weights

    def slope(
        self, q: Float[np.ndarray, "batch joints"]
    ) -> tuple[Float[np.ndarray, "batch space"], Float[np.ndarray, "batch space joints"]]:
        """Tip positions [m], and how they change with the actuator values [m/m]."""
        tip, slope = self.structure.slope(q)
        if self.rest is None:
            return tip, slope
        return tip + self.rest.features(q) @ self.rest.weights, slope + self.rest.slopes(q)

    def spread(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch space space"]:
        """Covariance of what the model may be wrong by at each posture [m^2]."""
        variance = np.full(len(q), self.floor)
        if self.rest is not None:
            f = self.rest.features(q)
            variance += ((f @ self.rest.covariance) * f).sum(1)
        return self.structure.spread(q) + variance[:, None, None] * np.eye(self.space)


def best_order(found: Found, q: Postures, x: Tips, rng: np.random.Generator) -> Found:
    """The arm with the order that misses held-out movements least, fitted to all movements."""
    train, test = _split(np.arange(len(q)), rng)
    train = train[:_MOST_TRIED]
    plain = settled(found.shape, found.numbers, found.sigma, q[train], x[train])
    best, least = 1, _typical(x[test] - tips(plain.shape, plain.numbers, q[test]))
    for order in _ORDERS:
        if x[train].size < 2 * places(found.shape._replace(order=order)).total:
            break
        tried = raised(plain, order, q[train], x[train])
        missed = _typical(x[test] - tips(tried.shape, tried.numbers, q[test]))
        if missed < _PAYS * least:
            best, least = order, missed
    return found if best == 1 else raised(found, best, q, x)


def rest_of(found: Found, q: Postures, x: Tips, rng: np.random.Generator) -> tuple[Rest, float] | None:
    """The polynomial that an arm misses, and the noise beside it on each axis [m]; None: it doesn't pay."""
    missed = x - tips(found.shape, found.numbers, q)
    train, test = _split(np.flatnonzero(found.good), rng)
    for order in reversed(_ORDERS):
        tried, _ = _learned(found, order, q[train], missed[train])
        left = missed[test] - tried.features(q[test]) @ tried.weights
        if _typical(left) < _PAYS * _typical(missed[test]):
            good = np.flatnonzero(found.good)
            return _learned(found, order, q[good], missed[good])
    return None


def _learned(found: Found, order: int, q: Postures, missed: Tips) -> tuple[Rest, float]:
    """The polynomial of greatest evidence, by MacKay's fixed point for the sizes of its coefficients and the noise."""
    shape, degree = found.shape, degrees(q.shape[1], order)
    f = features((q - shape.middle) / shape.half, order)
    square, across = f.T @ f, f.T @ missed
    noise, size = float(np.mean(missed**2)) / 2, np.full(order + 1, float(np.mean(missed**2)) / f.shape[1])
    weights, covariance = across, square
    for _ in range(_ROUNDS):
        covariance = np.linalg.inv(square / noise + np.diag(1 / size[degree]))
        weights = covariance @ across / noise
        known = 1 - np.diag(covariance) / size[degree]
        share = np.bincount(degree, known)
        size = np.bincount(degree, (weights**2).mean(1)) / np.maximum(share, 1e-3)
        size = np.maximum(size, 1e-9 * noise)
        noise = float(np.sum((missed - f @ weights) ** 2) / missed.shape[1] / max(len(q) - share.sum(), 1.0))
    return Rest(order, shape.middle, shape.half, weights, covariance), float(np.sqrt(noise))


def _split(rows: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Movements to learn from, and movements to judge by."""
    order = rng.permutation(rows)
    held = min(int(_HELD_OUT * len(rows)), _MOST_HELD_OUT)
    return order[held:], order[:held]


def _typical(missed: Tips) -> float:
    """Root of the median squared distance [m]; wild movements don't touch it."""
    return float(np.sqrt(np.median((missed**2).sum(1))))
