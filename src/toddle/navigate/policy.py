"""What learning leaves: a policy, from an observation to the action that it thinks best.

It is a value: saved, loaded, compared, exported. The observation's normaliser is a part of it. It draws nothing: of a
distribution it takes the likeliest action.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float, Shaped

from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.distribution import bounded
from toddle.navigate.ppo.moments import Moments
from toddle.navigate.ppo.network import ActorCritic
from toddle.navigate.ppo.training import Training
from toddle.navigate.task import Actions


@dataclass(frozen=True, eq=False)
class Policy:
    """A learned policy.

    Attributes:
        network: the networks; only the actor is asked.
        moments: of the observations that it learned from.
        config: how it was learned.
        observations: how many numbers it sees.
        actions: what it may do.
        source: what it was learned on, for who loads it: plain values.
        figures: how well it did.
    """

    network: ActorCritic
    moments: Moments
    config: PpoConfig
    observations: int
    actions: Actions
    source: Mapping[str, Any] = field(default_factory=dict)
    figures: Mapping[str, Any] = field(default_factory=dict)

    def start(self) -> Float[Array, "2 units"]:
        """The memory at the start of an episode; without units where it has none."""
        return jnp.zeros((2, self.config.memory), jnp.float32)

    def __call__(
        self, observation: Float[Array, " numbers"], memory: Float[Array, "2 units"]
    ) -> tuple[Shaped[Array, "..."], Float[Array, "2 units"]]:
        """The action that it thinks best, and its memory after it. Runs under ``jit`` and ``vmap``."""
        seen = self.moments.normalised(observation) if self.config.normalise_observations else observation
        given, memory = self.network.policy(seen, memory)
        return bounded(given.mode(), self.config.bound), memory


def policy_of(
    training: Training,
    config: PpoConfig,
    actions: Actions,
    source: Mapping[str, Any] | None = None,
    figures: Mapping[str, Any] | None = None,
) -> Policy:
    """What a run has learned so far."""
    observations = len(training.observations.mean)
    return Policy(training.network, training.observations, config, observations, actions, source or {}, figures or {})
