"""Probe environments: tasks so small that the right values and actions are known, each with one thing to get wrong.

The five that are usual (Jones 2021, "Debugging reinforcement learning systems without the agonizing pain"), one whose
values tell an episode that ended from one that was only cut off, and one that only a memory solves. A value that
differs from the known one names the part that is wrong:

    Constant      reward 1, one step                        value 1: the critic learns
    Observed      reward as seen, one step                  value as seen: it is asked for the right observation
    Delayed       reward 1 at the second of two steps       values gamma, 1: discounting
    Chosen        reward by the action, one step            the best action: the policy's gradient
    Answered      reward by observation and action          the best action for each observation
    Lasting       reward 1 a step, for so many steps        1 / (1 - gamma) where cut off, else the finite sum
    Remembered    reward by the last action and first cue   the cue's action: memory
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray, Shaped

from toddle.navigate.task import Actions, Continuous, Discrete, Outcome, Step

_NUMBER: Actions = Continuous(1)
_CHOICE: Actions = Discrete(2)


class ProbeState(NamedTuple):
    """Where a probe is.

    Attributes:
        cue: what was seen first.
        steps: of the episode.
    """

    cue: Float[Array, "1"]
    steps: Int[Array, ""]


@dataclass(frozen=True)
class Constant:
    """One step, nothing to see, reward 1."""

    actions: Actions = _NUMBER
    observations: int = 1

    def start(self, key: PRNGKeyArray) -> tuple[ProbeState, Float[Array, "1"]]:
        """Nothing is seen."""
        return _begun(jnp.zeros(1, jnp.float32))

    def step(self, state: ProbeState, action: Shaped[Array, "..."], key: PRNGKeyArray) -> tuple[ProbeState, Step]:
        """Over."""
        return _over(state, jnp.float32(1))


@dataclass(frozen=True)
class Observed:
    """One step, -1 or 1 is seen, and is the reward."""

    actions: Actions = _NUMBER
    observations: int = 1

    def start(self, key: PRNGKeyArray) -> tuple[ProbeState, Float[Array, "1"]]:
        """-1 or 1."""
        return _begun(_sign(key))

    def step(self, state: ProbeState, action: Shaped[Array, "..."], key: PRNGKeyArray) -> tuple[ProbeState, Step]:
        """Over."""
        return _over(state, state.cue[0])


@dataclass(frozen=True)
class Delayed:
    """Two steps, 0 and then 1 is seen; reward 1 for the second."""

    actions: Actions = _NUMBER
    observations: int = 1

    def start(self, key: PRNGKeyArray) -> tuple[ProbeState, Float[Array, "1"]]:
        """0 is seen."""
        return _begun(jnp.zeros(1, jnp.float32))

    def step(self, state: ProbeState, action: Shaped[Array, "..."], key: PRNGKeyArray) -> tuple[ProbeState, Step]:
        """1 is seen, then it is over."""
        over = state.steps >= 1
        return _moved(state, jnp.ones(1, jnp.float32), over.astype(jnp.float32), over, jnp.zeros((), bool))


@dataclass(frozen=True)
class Chosen:
    """One step, nothing to see. Reward 1 for choice 1, else -1; continuous: 1 less the squared distance to 0.5."""

    actions: Actions = _CHOICE
    observations: int = 1

    def start(self, key: PRNGKeyArray) -> tuple[ProbeState, Float[Array, "1"]]:
        """Nothing is seen."""
        return _begun(jnp.zeros(1, jnp.float32))

    def step(self, state: ProbeState, action: Shaped[Array, "..."], key: PRNGKeyArray) -> tuple[ProbeState, Step]:
        """Over."""
        return _over(state, _praise(action, jnp.float32(1)))


@dataclass(frozen=True)
class Answered:
    """One step, -1 or 1 is seen. Reward 1 for choice 0 or 1, likewise; continuous: best is half of what is seen."""

    actions: Actions = _CHOICE
    observations: int = 1

    def start(self, key: PRNGKeyArray) -> tuple[ProbeState, Float[Array, "1"]]:
        """-1 or 1."""
        return _begun(_sign(key))

    def step(self, state: ProbeState, action: Shaped[Array, "..."], key: PRNGKeyArray) -> tuple[ProbeState, Step]:
        """Over."""
        return _over(state, _praise(action, state.cue[0]))


@dataclass(frozen=True)
class Lasting:
    """Reward 1 a step.

    Attributes:
        length: of an episode, in steps.
        terminates: at its end nothing more can come, and what share of it is over is seen; else it is only cut off,
            and nothing is seen: who saw the end come near would ask for values of what it never sees before a step.
    """

    length: int = 10
    terminates: bool = False
    actions: Actions = _CHOICE
    observations: int = 1

    def start(self, key: PRNGKeyArray) -> tuple[ProbeState, Float[Array, "1"]]:
        """0 is seen."""
        return _begun(jnp.zeros(1, jnp.float32))

    def step(self, state: ProbeState, action: Shaped[Array, "..."], key: PRNGKeyArray) -> tuple[ProbeState, Step]:
        """One step nearer to the end."""
        steps = state.steps + 1
        over, never = steps >= self.length, jnp.zeros((), bool)
        seen = (steps.astype(jnp.float32) / self.length if self.terminates else jnp.float32(0))[None]
        ends = (over, never) if self.terminates else (never, over)
        return _moved(state, seen, jnp.float32(1), *ends)


@dataclass(frozen=True)
class Remembered:
    """The cue, -1 or 1, is seen at first only, then 0; the last choice must match it: reward 1, or -1.

    Attributes:
        length: of an episode, in steps.
    """

    length: int = 4
    actions: Actions = _CHOICE
    observations: int = 1

    def start(self, key: PRNGKeyArray) -> tuple[ProbeState, Float[Array, "1"]]:
        """The cue."""
        return _begun(_sign(key))

    def step(self, state: ProbeState, action: Shaped[Array, "..."], key: PRNGKeyArray) -> tuple[ProbeState, Step]:
        """Nothing more is seen."""
        over = state.steps + 1 >= self.length
        reward = jnp.where(over, _praise(action, state.cue[0]), 0.0)
        return _moved(state, jnp.zeros(1, jnp.float32), reward, over, jnp.zeros((), bool))


def _sign(key: PRNGKeyArray) -> Float[Array, "1"]:
    return jax.random.rademacher(key, (1,), jnp.float32)


def _praise(action: Shaped[Array, "..."], cue: Float[Array, ""]) -> Float[Array, ""]:
    """How good an action is where the best is half the cue, or the choice of its sign."""
    if jnp.issubdtype(action.dtype, jnp.floating):
        return 1 - (action[0] - cue / 2) ** 2
    return jnp.where(action == (cue > 0).astype(jnp.int32), 1.0, -1.0).astype(jnp.float32)


def _begun(cue: Float[Array, "1"]) -> tuple[ProbeState, Float[Array, "1"]]:
    return ProbeState(cue, jnp.zeros((), jnp.int32)), cue


def _over(state: ProbeState, reward: Float[Array, ""]) -> tuple[ProbeState, Step]:
    return _moved(state, state.cue, reward, jnp.ones((), bool), jnp.zeros((), bool))


def _moved(
    state: ProbeState, seen: Float[Array, "1"], reward: Float[Array, ""], over: Bool[Array, ""], cut: Bool[Array, ""]
) -> tuple[ProbeState, Step]:
    won = jnp.where(reward > 0, Outcome.WON, Outcome.LOST)
    outcome = jnp.select([over, cut], [won, jnp.full((), Outcome.LATE)], Outcome.GOES_ON).astype(jnp.int32)
    return ProbeState(state.cue, state.steps + 1), Step(seen, reward, over, cut, outcome)
