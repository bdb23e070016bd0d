"""The numbers of proximal policy optimization, by the names that its papers give them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from toddle.failures import BadInput, unknown_name

_KNOWN = {"schedule": ("constant", "linear"), "activation": ("tanh", "relu"), "bound": ("clip", "tanh", "mean")}


@dataclass(frozen=True)
class PpoConfig:
    """How to learn.

    Attributes:
        steps: to train for, all actors together.
        actors: copies of the task side by side (N).
        horizon: steps of each actor between two updates (T).
        minibatch: transitions of one gradient step (M).
        epochs: passes over what was collected (K).
        gamma: discount of what comes later.
        lambda_: of generalised advantage estimation: 0 trusts the critic, 1 the returns.
        epsilon: of the clipped objective.
        c1: weight of the value loss.
        c2: weight of the entropy.
        c2_over_reward: divide ``c2`` by the mean reward of a step, which is taken to be at least ``least_reward``
            (Huber 2019, section 4.3.1).
        least_reward: see there.
        learning_rate: of Adam.
        schedule: constant, or falling linearly to 0 at ``steps``.
        gradient_norm: greatest norm of a gradient; longer ones are shortened.
        kl_limit: the rest of an update is left out once policies differ by more [nats]; 0: never.
        hidden: units of the hidden layers, of actor and critic each.
        activation: of the hidden layers.
        memory: units of a recurrent layer (LSTM) after the hidden ones; 0: none.
        sequence: steps that gradients go back through a memory; divides ``horizon``.
        bound: how continuous actions are kept in -1 to 1: the sample is clipped; it is squashed by tanh; or the mean
            is, and noise may go beyond (the document's).
        deviation: standard deviation of continuous actions at the start.
        normalise_observations: by their running mean and deviation.
        normalise_rewards: by the running deviation of their discounted sum; at most 10.
        normalise_advantages: in each minibatch.
    """

    steps: int = 500_000
    actors: int = 16
    horizon: int = 128
    minibatch: int = 512
    epochs: int = 8
    gamma: float = 0.99
    lambda_: float = 0.95
    epsilon: float = 0.2
    c1: float = 0.5
    c2: float = 0.0
    c2_over_reward: bool = False
    least_reward: float = 0.1
    learning_rate: float = 1e-3
    schedule: Literal["constant", "linear"] = "linear"
    gradient_norm: float = 0.5
    kl_limit: float = 0.0
    hidden: tuple[int, ...] = (64, 64)
    activation: Literal["tanh", "relu"] = "tanh"
    memory: int = 0
    sequence: int = 16
    bound: Literal["clip", "tanh", "mean"] = "clip"
    deviation: float = 1.0
    normalise_observations: bool = True
    normalise_rewards: bool = True
    normalise_advantages: bool = True

    def __post_init__(self) -> None:
        """Refuses numbers that don't fit each other.

        Raises:
            BadInput: which, and the remedy.
        """
        for name in ("steps", "actors", "horizon", "minibatch", "epochs", "sequence"):
            if getattr(self, name) < 1:
                raise _bad(name, getattr(self, name), "give 1 or more")
        for name in ("gamma", "lambda_"):
            if not 0 <= getattr(self, name) <= 1:
                raise _bad(name, getattr(self, name), "give 0 to 1")
        for name in ("epsilon", "learning_rate", "gradient_norm", "deviation", "least_reward"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise _bad(name, getattr(self, name), "give a number above 0")
        if not all(map(math.isfinite, (self.c1, self.c2))):
            raise _bad("c1, c2", (self.c1, self.c2), "give finite numbers")
        if not 0 <= self.kl_limit < math.inf:
            raise _bad("kl_limit", self.kl_limit, "give 0, for none, or a number above it")
        if self.normalise_advantages and self.minibatch < 2:
            raise _bad("minibatch", self.minibatch, "one advantage alone, normalised, is 0: give 2 or more")
        for name, known in _KNOWN.items():
            if getattr(self, name) not in known:
                raise unknown_name(name, str(getattr(self, name)), known, where="PPO")
        if not self.hidden or min(self.hidden) < 1 or self.memory < 0:
            raise _bad("hidden", self.hidden, "give units of at least one layer")
        if self.batch % self.minibatch:
            raise _bad("minibatch", self.minibatch, f"it must divide actors x horizon, {self.batch}")
        if self.memory and (self.horizon % self.sequence or self.minibatch % self.sequence):
            raise _bad("sequence", self.sequence, "it must divide horizon and minibatch")

    @property
    def batch(self) -> int:
        """Transitions of one update (N T)."""
        return self.actors * self.horizon

    @property
    def updates(self) -> int:
        """How often the networks are updated in all."""
        return math.ceil(self.steps / self.batch)


def _bad(name: str, value: object, remedy: str) -> BadInput:
    return BadInput(f"{value} is no use", where=f"PPO, {name.rstrip('_')}", remedy=remedy)
