"""What an explorer is: it proposes what to try next.

All randomness of a chunk is drawn at once (`draw`), outside the loop over movements: drawing inside it would cost more
than learning does. State is returned, never kept; every number is in the unit box.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
from jaxtyping import Array, Float

State = Any
Noise = Any
Predict = Callable[[Float[Array, " space"]], Float[Array, " joints"]]


class Home(NamedTuple):
    """Where exploration starts: the home posture and the tip's position there (unit box)."""

    q: Float[Array, " joints"]
    x: Float[Array, " space"]


class Proposal(NamedTuple):
    """What to try: joint values within the limits, and the goal they were meant for (unit box)."""

    q: Float[Array, " joints"]
    goal: Float[Array, " space"]


class Explorer(eqx.Module):
    """Proposes movements, watches their outcome, and weights what the learner makes of them."""

    @abstractmethod
    def init(self, home: Home) -> State:
        """The state before the first movement."""

    @abstractmethod
    def draw(self, key: jax.Array, count: int, home: Home) -> Noise:
        """The randomness of `count` movements: a pytree whose leaves have a leading axis of that length."""

    @abstractmethod
    def propose(self, state: State, noise: Noise, predict: Predict, home: Home) -> tuple[State, Proposal]:
        """The next movement, given one movement's share of the noise and the learner's present inverse estimate."""

    @abstractmethod
    def observe(
        self, state: State, proposal: Proposal, x: Float[Array, " space"], home: Home
    ) -> tuple[State, Float[Array, ""]]:
        """The state after the tip was seen at x, and the weight of this sample for the learner (0 to 1)."""
