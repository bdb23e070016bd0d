"""The objective (Huber 2019, equations 2.129 and 2.130; Schulman et al. 2017, equations 7 and 9).

L = E[ min(rho A, clip(rho, 1 - epsilon, 1 + epsilon) A)  -  c1 (V - V_target)^2  +  c2 S ]
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Shaped

from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.distribution import entropy_of
from toddle.navigate.ppo.network import ActorCritic


class Minibatch(NamedTuple):
    """Transitions to learn from, in sequences that a memory can follow; without one, each of a single step.

    Attributes:
        observation: normalised.
        action: as it was drawn.
        log_prob: of the action, under the policy that drew it.
        advantage: of the action.
        target: of the value.
        started: an episode begins with the step: what is remembered is forgotten.
        memory: before the first step of each sequence.
    """

    observation: Float[Array, "sequences length numbers"]
    action: Shaped[Array, "sequences length ..."]
    log_prob: Float[Array, "sequences length"]
    advantage: Float[Array, "sequences length"]
    target: Float[Array, "sequences length"]
    started: Shaped[Array, "sequences length"]
    memory: Float[Array, "sequences 2 2 units"]


class Losses(NamedTuple):
    """Parts of the objective and what tells how an update went, means over a minibatch.

    Attributes:
        policy: the clipped objective's, to be made small.
        value: squared error of the value.
        entropy: of the policy [nats].
        kl: between the old policy and this one [nats] (Schulman 2020: (rho - 1) - log rho).
        clipped: share of ratios beyond epsilon.
    """

    policy: Float[Array, ""]
    value: Float[Array, ""]
    entropy: Float[Array, ""]
    kl: Float[Array, ""]
    clipped: Float[Array, ""]


def objective(
    network: ActorCritic, batch: Minibatch, config: PpoConfig, c2: Float[Array, ""]
) -> tuple[Float[Array, ""], Losses]:
    """What gradient descent makes small, and its parts."""
    given, value = jax.vmap(_along, in_axes=(None, 0))(network, batch)
    ratio_log = given.log_prob(batch.action) - batch.log_prob
    ratio = jnp.exp(ratio_log)
    advantage = batch.advantage
    if config.normalise_advantages:
        advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
    clipped = jnp.clip(ratio, 1 - config.epsilon, 1 + config.epsilon)
    losses = Losses(
        policy=-jnp.minimum(ratio * advantage, clipped * advantage).mean(),
        value=((value - batch.target) ** 2).mean(),
        entropy=entropy_of(given, batch.action, config.bound).mean(),
        kl=(ratio - 1 - ratio_log).mean(),
        clipped=(jnp.abs(ratio - 1) > config.epsilon).astype(jnp.float32).mean(),
    )
    return losses.policy + config.c1 * losses.value - c2 * losses.entropy, losses


def _along(network: ActorCritic, batch: Minibatch) -> tuple:
    """Policy and value at each step of one sequence."""
    if batch.memory.shape[-1] == 0:
        given, value, _ = jax.vmap(network, in_axes=(0, None))(batch.observation, batch.memory)
        return given, value

    def step(memory: Array, seen: tuple[Array, Array]) -> tuple:
        observation, started = seen
        given, value, memory = network(observation, jnp.where(started, 0.0, memory))
        return memory, (given, value)

    _, (given, value) = jax.lax.scan(step, batch.memory, (batch.observation, batch.started))
    return given, value
