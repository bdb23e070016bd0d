"""What a task is to who learns it: pure functions from a state and an action to the next state and a reward.

A task is a frozen record; its state is a pytree of arrays. `Task.step` never starts anew by itself: who collects
experience does, since the observation after the last step of an episode is still worth something where time alone
ended it.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple, Protocol, TypeVar, runtime_checkable

from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray, Shaped


@dataclass(frozen=True)
class Continuous:
    """Actions are ``size`` numbers; -1 to 1 each is the range that the task means."""

    size: int


@dataclass(frozen=True)
class Discrete:
    """Actions are whole numbers from 0 up to, without, ``count``."""

    count: int


Actions = Continuous | Discrete


class Outcome(IntEnum):
    """How a step ended an episode, or that it did not."""

    GOES_ON = 0
    WON = 1
    LOST = 2
    """It went too far away."""
    COLLIDED = 3
    FELL = 4
    LATE = 5
    """The time was over."""


class Step(NamedTuple):
    """What one action led to.

    Attributes:
        observation: after it; of the episode that may have ended with it.
        reward: for it.
        terminated: nothing more can come: the value of what follows is 0.
        truncated: the episode was cut off, by time alone: the value of what would follow counts.
        outcome: an `Outcome`.
    """

    observation: Float[Array, "*batch numbers"]
    reward: Float[Array, "*batch"]
    terminated: Bool[Array, "*batch"]
    truncated: Bool[Array, "*batch"]
    outcome: Int[Array, "*batch"]


S = TypeVar("S")


@runtime_checkable
class Task(Protocol[S]):
    """Something to learn. Runs under ``jit``, ``vmap`` and ``scan``."""

    @property
    def observations(self) -> int:
        """How many numbers an observation has."""
        ...

    @property
    def actions(self) -> Actions:
        """What may be done."""
        ...

    def start(self, key: PRNGKeyArray) -> tuple[S, Float[Array, " numbers"]]:
        """A new episode: its state and first observation."""
        ...

    def step(self, state: S, action: Shaped[Array, "..."], key: PRNGKeyArray) -> tuple[S, Step]:
        """One action: `Continuous` ones as float32 of that size, `Discrete` ones as an int32."""
        ...
