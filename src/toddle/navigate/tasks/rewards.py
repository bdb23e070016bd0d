"""What the walker's task rewards: the document's three terms, and the ends.

After Huber, Autonomous Navigation (2019), section 4.3.2: r_t = 6e3 r_goal + 2e3 r_frontal - 1e-1 r_time, and 100 for a
goal reached. r_goal is the distance to the goal that a step gained [m]. r_frontal is printed as
(g_{a,t-1} - g_{a,t-1})[0], which is zero; it "enforces the robot coordinate system's x-axis to point towards the goal",
and is taken here as the gain of the cosine of the goal's bearing, which is the first number of the goal's direction in
the robot's frame. r_time = t is taken as the time since the episode began [s].
"""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from toddle.navigate.task import Outcome

_SCALE = 1 / 600


@dataclass(frozen=True)
class Rewards:
    """Weights of the terms.

    As they stand, the document's divided by 600, but a tenth of the frontal term and a greater reward for the goal; and
    failures are punished, which the document does not say. Its own proportions: `DOCUMENT`.

    Attributes:
        goal: for each metre nearer to the goal [1/m].
        frontal: for the cosine of the bearing, 1 more of it.
        late: taken away in each step, for each second since the start [1/s].
        won: for the goal.
        failed: for a collision, a fall, or having gone too far away; below 0.
    """

    goal: float = 6e3 * _SCALE
    frontal: float = 2e2 * _SCALE
    late: float = 1e-1 * _SCALE
    won: float = 10.0
    failed: float = -10.0

    def __call__(
        self,
        nearer: Float[Array, ""],
        turned: Float[Array, ""],
        time: Float[Array, ""],
        outcome: Int[Array, ""],
    ) -> Float[Array, ""]:
        """The reward of a step.

        Args:
            nearer: distance to the goal gained [m].
            turned: cosine of the bearing gained.
            time: since the start [s].
            outcome: an `Outcome`.
        """
        end = jnp.where(outcome == Outcome.WON, self.won, 0.0)
        failures = (Outcome.LOST, Outcome.COLLIDED, Outcome.FELL)
        failed = jnp.stack([outcome == failure for failure in failures]).any()
        end = end + jnp.where(failed, self.failed, 0.0)
        return self.goal * nearer + self.frontal * turned - self.late * time + end


DOCUMENT = Rewards(frontal=2e3 * _SCALE, won=100 * _SCALE)
"""The document's proportions. Arriving is worth 17 mm of the way: who learns may stop short of the goal."""
