"""A learned body whose actuators no longer do what they are told: some stand still, some move too little or slip.

Actuator j goes to ``place_j + share_j (q_j - about_j)``: whole it has share 1 and its place where it is told to be,
stuck it has share 0. Solvers work on it as on any model; an actuator without slope is left where it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from toddle.reach.model.model import Model


@dataclass(frozen=True)
class Crippled:
    """A body after damage to its actuators; a `toddle.reach.model.model.Model`.

    Attributes:
        model: the body as it was learned, before.
        about: a posture that was commanded [rad or m].
        place: where each actuator goes when it is told that [rad or m].
        share: what remains of each one's motion.
        covariance: of places, then shares.
    """

    model: Model
    about: Float[np.ndarray, " joints"]
    place: Float[np.ndarray, " joints"]
    share: Float[np.ndarray, " joints"]
    covariance: Float[np.ndarray, "numbers numbers"]

    @property
    def space(self) -> int:
        """How many coordinates the tip's position has."""
        return self.model.space

    def actual(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch joints"]:
        """Where the actuators go when they are told to go to q [rad or m]."""
        return self.place + self.share * (q - self.about)

    def forward(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch space"]:
        """Tip positions [m] for commanded joint values [rad or m]."""
        return self.model.forward(self.actual(q))

    def slope(
        self, q: Float[np.ndarray, "batch joints"]
    ) -> tuple[Float[np.ndarray, "batch space"], Float[np.ndarray, "batch space joints"]]:
        """Tip positions [m], and how they change with the commanded joint values."""
        tip, slope = self.model.slope(self.actual(q))
        return tip, slope * self.share

    def spread(self, q: Float[np.ndarray, "batch joints"]) -> Float[np.ndarray, "batch space space"]:
        """Covariance of what the model may be wrong by at each posture [m^2]."""
        actual = self.actual(q)
        slope = number_slope(self.model.slope(actual)[1], q - self.about)
        return self.model.spread(actual) + slope @ self.covariance @ slope.transpose(0, 2, 1)


def number_slope(
    slope: Float[np.ndarray, "batch space joints"], away: Float[np.ndarray, "batch joints"]
) -> Float[np.ndarray, "batch space numbers"]:
    """How the tip moves with the places, then the shares, from how it moves with the actuators."""
    return np.concatenate([slope, slope * away[:, None]], axis=2)
