"""Random goal babbling: try to reach goals drawn at random (Moulin-Frier and Oudeyer 2013, random goal).

Each goal is drawn uniformly over the workspace's box; the arm does what the learner answers for it, with a little noise
on the motors so that something new is seen even where the answer stays the same.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from toddle.reach.explore.explorer import Explorer, Home, Predict, Proposal


class GoalNoise(NamedTuple):
    """A goal for each movement (unit box), and standard normal noise for its motors."""

    goal: Float[Array, "*count space"]
    motor: Float[Array, "*count joints"]


class GoalBabbling(Explorer):
    """Every movement has a new goal, anywhere in the box.

    Attributes:
        perturbation: standard deviation of the noise on each joint, as a fraction of its range.
    """

    perturbation: Float[Array, ""]

    def init(self, home: Home) -> tuple[()]:
        """Nothing to remember."""
        return ()

    def draw(self, key: jax.Array, count: int, home: Home) -> GoalNoise:
        """The goals themselves, and the noise."""
        for_goal, for_motor = jax.random.split(key)
        return GoalNoise(
            jax.random.uniform(for_goal, (count, len(home.x))),
            jax.random.normal(for_motor, (count, len(home.q))),
        )

    def propose(self, state: tuple[()], noise: GoalNoise, predict: Predict, home: Home) -> tuple[tuple[()], Proposal]:
        """What the learner answers for the goal, perturbed, within the limits."""
        q = predict(noise.goal) + self.perturbation * noise.motor
        return state, Proposal(jnp.clip(q, 0.0, 1.0), noise.goal)

    def observe(
        self, state: tuple[()], proposal: Proposal, x: Float[Array, " space"], home: Home
    ) -> tuple[tuple[()], Float[Array, ""]]:
        """Every sample counts alike."""
        return state, jnp.float32(1.0)
