"""The document's benchmark: a point that walks to a goal (Huber 2019, section 4.3.1, figure 4.29).

What the text leaves out is taken from the author's published program (github.com/mhubii/ppo_libtorch): a step is 0.1
along each axis, goals lie at whole numbers from -5 to 5, one is reached within 0.6, and the point starts at the origin.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, PRNGKeyArray

from toddle.navigate.task import Continuous, Outcome, Step

PRIZE = 10.0
"""Reward for a goal reached; as much is taken for a game lost."""


class PointState(NamedTuple):
    """Where things are.

    Attributes:
        agent: the point.
        goal: where it is to go.
        steps: of the episode.
    """

    agent: Float[Array, "2"]
    goal: Float[Array, "2"]
    steps: Int[Array, ""]


@dataclass(frozen=True)
class PointTask:
    """A point that walks to a goal.

    Attributes:
        stride: along each axis in a step, for an action of 1.
        near: the goal is reached nearer than this.
        far: the game is lost farther than this from it.
        widest: goals lie at whole numbers up to this, each way.
        longest: an episode is cut off after so many steps; 0: never, as in the document.
    """

    stride: float = 0.1
    near: float = 0.6
    far: float = 10.0
    widest: int = 5
    longest: int = 0

    @property
    def observations(self) -> int:
        """The point's place and the goal's."""
        return 4

    @property
    def actions(self) -> Continuous:
        """How far to go along x and y, in strides."""
        return Continuous(2)

    def start(self, key: PRNGKeyArray) -> tuple[PointState, Float[Array, "4"]]:
        """At the origin, with a new goal."""
        goal = jax.random.randint(key, (2,), -self.widest, self.widest + 1).astype(jnp.float32)
        state = PointState(jnp.zeros(2, jnp.float32), goal, jnp.zeros((), jnp.int32))
        return state, _seen(state)

    def step(self, state: PointState, action: Float[Array, "2"], key: PRNGKeyArray) -> tuple[PointState, Step]:
        """Go; the reward is the distance gained, and the prize for an end."""
        moved = PointState(state.agent + self.stride * action, state.goal, state.steps + 1)
        before, after = (jnp.linalg.norm(one.goal - one.agent) for one in (state, moved))
        won, lost = after < self.near, after > self.far
        late = moved.steps >= self.longest if self.longest else jnp.zeros((), bool)
        reward = before - after + PRIZE * (won.astype(jnp.float32) - lost.astype(jnp.float32))
        outcome = jnp.select([won, lost, late], [Outcome.WON, Outcome.LOST, Outcome.LATE], Outcome.GOES_ON)
        step = Step(_seen(moved), reward, won | lost, late & ~(won | lost), outcome.astype(jnp.int32))
        return moved, step


def _seen(state: PointState) -> Float[Array, "4"]:
    return jnp.concatenate([state.agent, state.goal])
