"""The error to expect of an answer, calibrated on the movements that the model was learned from.

With the model's covariance C(q) (for a rigid arm J S J' with S = s^2 (J'J)^+), a floor f for what its structure can't
follow, and a distance d that the solver leaves, the squared error has the moments

    E = tr K + d^2,   V = 2 tr K^2 + 4 d^2 tr K / dim,   K = scale^2 (C(q) + f I)

and is taken as gamma-distributed with them. The scale is conformal (Papadopoulos et al. 2002): the 90 % quantile of
what movements missed by over what they were said to, each movement judged as if it had been left out of the fit: with
its leverage H = C / s^2 the miss r becomes (I - H)^-1 r and its covariance s^2 (I - H)^-1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.special import gammaincinv, gammaln

from toddle.failures import BadInput
from toddle.reach.model.model import Fit, Model
from toddle.signals import Experience

SHARE = 0.9
_LEAST = 10  # held-out movements, for a 90 % quantile that is one of them
_LEVERAGE = 0.95  # of one movement at most; beyond, what it would have been without it can't be told


@dataclass(frozen=True)
class Expectation:
    """How far from a target an answer ends.

    Attributes:
        model: the learned body.
        floor: variance on each axis of what the model's structure can't follow [m^2].
        noise: variance on each axis of looking at the tip [m^2]; 0: not known, and then part of the floor.
        scale: what calibration multiplies the model's deviations by.
    """

    model: Model
    floor: float
    noise: float
    scale: float

    @classmethod
    def of(cls, fit: Fit, experience: Experience, *, sensor: float | None = None) -> Expectation:
        """What a fit lets expect whose model's spread comes from the noise in the very movements of the fit.

        That holds for rigid arms, and for whatever else is fitted by least squares with far fewer numbers than
        movements. For others, such as networks, see `held_out`.

        Args:
            fit: the model and how it sits in its movements.
            experience: those movements.
            sensor: standard deviation of a seen tip on each axis [m]; None: not known. Then all that the fit misses
                is counted as the body's error, and the true error is smaller than what is said.
        """
        tame = ~fit.wild
        q, x = experience.q[tame], experience.x[tame]
        space, variance = x.shape[1], fit.sensor**2
        leverage = _capped(fit.model.spread(q) / variance)
        without = np.linalg.inv(np.eye(space) - leverage)
        miss = (without @ (x - fit.model.forward(q))[..., None])[..., 0]
        free = max(x.size - float(np.trace(leverage, axis1=1, axis2=2).sum()), 1.0)
        floor = variance if sensor is None else _excess(variance, sensor**2, free)
        return cls(fit.model, floor, variance - floor, _scale(miss, variance * without))

    @classmethod
    def held_out(cls, model: Model, experience: Experience, *, sensor: float | None = None) -> Expectation:
        """What movements that the model was not fitted to let expect; for any model.

        Args:
            model: the learned body.
            experience: movements that it has never seen.
            sensor: standard deviation of a seen tip on each axis [m]; None: not known, as in `of`.

        Raises:
            BadInput: too few movements.
        """
        if len(experience.q) < _LEAST:
            what = f"{len(experience.q)} movements are too few to calibrate with"
            raise BadInput(what, remedy=f"hold out {_LEAST} or more")
        miss = experience.x - model.forward(experience.q)
        spread = model.spread(experience.q)
        space = miss.shape[1]
        unexplained = float((miss**2).sum(1).mean() - np.trace(spread, axis1=1, axis2=2).mean()) / space
        known = 0.0 if sensor is None else sensor**2
        floor = max(unexplained - known, 0.0)
        return cls(model, floor, known, _scale(miss, spread + (floor + known) * np.eye(space)))

    def at(
        self, q: Float[np.ndarray, "batch joints"], distance: Float[np.ndarray, " batch"] | float = 0.0
    ) -> tuple[Float[np.ndarray, " batch"], Float[np.ndarray, " batch"]]:
        """Expected distance between tip and target [m], and the distance that nine of ten stay within [m].

        Args:
            q: the answers' joint values [rad or m].
            distance: from each target to where the model puts the tip [m].
        """
        return self._about(q, distance, self.floor)

    def seen_at(
        self, q: Float[np.ndarray, "batch joints"], distance: Float[np.ndarray, " batch"] | float = 0.0
    ) -> tuple[Float[np.ndarray, " batch"], Float[np.ndarray, " batch"]]:
        """Like `at`, of the tip as it will be seen: the noise of looking is in it."""
        return self._about(q, distance, self.floor + self.noise)

    def _about(
        self, q: Float[np.ndarray, "batch joints"], distance: Float[np.ndarray, " batch"] | float, extra: float
    ) -> tuple[Float[np.ndarray, " batch"], Float[np.ndarray, " batch"]]:
        spread = self.model.spread(q)
        return _radius(self.scale**2 * (spread + extra * np.eye(spread.shape[1])), np.asarray(distance, float))


def _radius(
    covariance: Float[np.ndarray, "batch space space"], distance: Float[np.ndarray, "*batch"]
) -> tuple[Float[np.ndarray, " batch"], Float[np.ndarray, " batch"]]:
    """Mean and 90 % quantile of the length of a Gaussian vector that is off by a distance, by gamma's moments."""
    size = np.trace(covariance, axis1=1, axis2=2)
    mean = size + distance**2 + 1e-30
    variance = 2 * (covariance**2).sum((1, 2)) + 4 * distance**2 * size / covariance.shape[1] + 1e-60
    shape = np.minimum(mean**2 / variance, 1e6)
    unit = mean / shape
    root = np.sqrt(unit)
    return root * np.exp(gammaln(shape + 0.5) - gammaln(shape)), root * np.sqrt(gammaincinv(shape, SHARE))


def _scale(miss: Float[np.ndarray, "movements space"], covariance: Float[np.ndarray, "movements space space"]) -> float:
    """The 90 % quantile of what was missed over what nine of ten were to stay within, one movement to spare."""
    said = _radius(covariance, np.zeros(len(miss)))[1]
    ratio = np.sort(np.linalg.norm(miss, axis=1) / said)
    return float(ratio[min(int(np.ceil(SHARE * (len(ratio) + 1))), len(ratio)) - 1])


def _excess(variance: float, known: float, free: float) -> float:
    """Variance beyond the known one [m^2]; what is within half a standard deviation of chance isn't counted."""
    return variance - known if variance > known * (1 + 0.5 * np.sqrt(2 / free)) else 0.0


def _capped(leverage: Float[np.ndarray, "movements space space"]) -> Float[np.ndarray, "movements space space"]:
    """No movement decides alone."""
    values, vectors = np.linalg.eigh(leverage)
    return (vectors * np.clip(values, 0.0, _LEVERAGE)[:, None]) @ np.swapaxes(vectors, 1, 2)
