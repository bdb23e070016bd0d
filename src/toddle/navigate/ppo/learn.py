"""Learning from what was collected: K epochs of minibatches, each a step of Adam (algorithm 1 of Huber 2019)."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from toddle.navigate.ppo.adam import Adam, at_rest, moved, shortened
from toddle.navigate.ppo.advantage import advantages
from toddle.navigate.ppo.collect import Rollout, Row
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.network import ActorCritic
from toddle.navigate.ppo.objective import Losses, Minibatch, objective
from toddle.navigate.ppo.shuffle import shuffled


class Learned(NamedTuple):
    """After an update.

    Attributes:
        network: the networks.
        optimiser: Adam's state.
        losses: of the last epoch, means.
        explained: share of the targets' variance that the critic explained, before the update.
        gradient: greatest norm of a gradient, before it was shortened.
    """

    network: ActorCritic
    optimiser: Adam
    losses: Losses
    explained: Float[Array, ""]
    gradient: Float[Array, ""]


def fresh_optimiser(network: ActorCritic) -> Adam:
    """Before the first step."""
    return at_rest(network)


def learn(
    config: PpoConfig,
    network: ActorCritic,
    optimiser: Adam,
    rollout: Rollout,
    rewards: Float[Array, "steps actors"],
    rate: Float[Array, ""],
    c2: Float[Array, ""],
    key: PRNGKeyArray,
) -> Learned:
    """One update.

    Args:
        config: how.
        network: that collected.
        optimiser: Adam's state.
        rollout: what was collected.
        rewards: of its steps, as they are to be learned from.
        rate: learning rate.
        c2: weight of the entropy.
        key: for the order of the minibatches.
    """
    rows = rollout.rows
    advantage = advantages(
        rewards, rollout.value, rollout.value_after, rows.terminated, rows.truncated, config.gamma, config.lambda_
    )
    target = advantage + rollout.value
    everything = _sequences(config, rows, advantage, target)
    count = len(everything.target)
    each = config.minibatch // everything.target.shape[1]

    def step(carry: tuple, chosen: Array) -> tuple:
        network, optimiser, stopped = carry
        batch = jax.tree.map(lambda part: part[chosen], everything)
        gradient, losses = jax.grad(objective, has_aux=True)(network, batch, config, c2)
        gradient, norm = shortened(gradient, config.gradient_norm)
        now = moved(network, optimiser, gradient, rate)
        stopped = stopped | (losses.kl > config.kl_limit if config.kl_limit else jnp.zeros((), bool))
        return (*_unless(stopped, now, (network, optimiser)), stopped), (losses, norm)

    def epoch(carry: tuple, key: PRNGKeyArray) -> tuple:
        order = shuffled(key, count).reshape(-1, each)
        return jax.lax.scan(step, carry, order)

    begun = (network, optimiser, jnp.zeros((), bool))
    (network, optimiser, _), (losses, norms) = jax.lax.scan(epoch, begun, jax.random.split(key, config.epochs))
    explained = 1 - (target - rollout.value).var() / (target.var() + 1e-8)
    last = jax.tree.map(lambda part: part[-1].mean(), losses)
    return Learned(network, optimiser, last, explained, norms.max())


def _unless(stopped: Bool[Array, ""], one: Any, other: Any) -> Any:
    return jax.tree.map(lambda a, b: jnp.where(stopped, b, a), one, other)


def _sequences(
    config: PpoConfig, rows: Row, advantage: Float[Array, "steps actors"], target: Float[Array, "steps actors"]
) -> Minibatch:
    """All transitions, cut into sequences of one actor each."""
    length = config.sequence if config.memory else 1

    def cut(part: Array) -> Array:
        chunks, actors = config.horizon // length, config.actors
        along = part.reshape(chunks, length, actors, *part.shape[2:])
        return jnp.moveaxis(along, 2, 1).reshape(chunks * actors, length, *part.shape[2:])

    return Minibatch(
        observation=cut(rows.observation),
        action=cut(rows.action),
        log_prob=cut(rows.log_prob),
        advantage=cut(advantage),
        target=cut(target),
        started=cut(rows.started),
        memory=cut(rows.memory)[:, 0],
    )
