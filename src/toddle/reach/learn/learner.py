"""What a learner is: an inverse estimate g(x) -> q that takes one sample at a time."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import equinox as eqx
import jax
from jaxtyping import Array, Float

State = Any


class Learner(eqx.Module):
    """``init / update / predict``; the state is a pytree of arrays, returned and never kept (unit box)."""

    @abstractmethod
    def init(self, key: jax.Array, home_x: Float[Array, " space"], home_q: Float[Array, " joints"]) -> State:
        """A state that answers the home posture at home."""

    @abstractmethod
    def predict(self, state: State, x: Float[Array, " space"]) -> Float[Array, " joints"]:
        """Joint values for a position; not clipped to the limits."""

    def answer(self, state: State, x: Float[Array, " space"]) -> Float[Array, " joints"]:
        """Joint values for a target, for who wants to reach it and not to explore."""
        return self.predict(state, x)

    @abstractmethod
    def update(
        self,
        state: State,
        x: Float[Array, " space"],
        q: Float[Array, " joints"],
        weight: Float[Array, ""],
    ) -> State:
        """The state after learning that joint values q bring the tip to x."""
