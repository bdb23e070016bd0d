"""Motor babbling: joint values at random, at once (random) or as a walk (continuous)."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from toddle.reach.explore.explorer import Explorer, Home, Predict, Proposal


class MotorBabbling(Explorer):
    """Every movement goes to joint values drawn uniformly over their ranges (Moulin-Frier 2013, random motor)."""

    def init(self, home: Home) -> tuple[()]:
        """Nothing to remember."""
        return ()

    def draw(self, key: jax.Array, count: int, home: Home) -> Float[Array, "count joints"]:
        """The joint values themselves."""
        return jax.random.uniform(key, (count, len(home.q)))

    def propose(
        self, state: tuple[()], noise: Float[Array, " joints"], predict: Predict, home: Home
    ) -> tuple[tuple[()], Proposal]:
        """A random posture; its goal is no better known than home."""
        return state, Proposal(noise, home.x)

    def observe(
        self, state: tuple[()], proposal: Proposal, x: Float[Array, " space"], home: Home
    ) -> tuple[tuple[()], Float[Array, ""]]:
        """Every sample counts alike."""
        return state, jnp.float32(1.0)


class ContinuousMotorBabbling(Explorer):
    """A walk through joint space, each joint at most `step` of its range a movement, reflected at the limits.

    Attributes:
        step: the largest change of a joint in one movement, as a fraction of its range.
    """

    step: Float[Array, ""]

    def init(self, home: Home) -> Float[Array, " joints"]:
        """The walk starts at home."""
        return home.q

    def draw(self, key: jax.Array, count: int, home: Home) -> Float[Array, "count joints"]:
        """The steps, as fractions of the largest one."""
        return jax.random.uniform(key, (count, len(home.q)), minval=-1.0, maxval=1.0)

    def propose(
        self, state: Float[Array, " joints"], noise: Float[Array, " joints"], predict: Predict, home: Home
    ) -> tuple[Float[Array, " joints"], Proposal]:
        """One step on, reflected into [0, 1]."""
        q = 1.0 - jnp.abs(1.0 - jnp.abs(state + self.step * noise))
        return q, Proposal(q, home.x)

    def observe(
        self, state: Float[Array, " joints"], proposal: Proposal, x: Float[Array, " space"], home: Home
    ) -> tuple[Float[Array, " joints"], Float[Array, ""]]:
        """Every sample counts alike."""
        return state, jnp.float32(1.0)
