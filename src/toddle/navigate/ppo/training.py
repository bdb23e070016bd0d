"""A run of proximal policy optimization: what it is between two updates, and one update after the other.

    init --> Training --iterate--> Training, Report --iterate--> ...

`init` and `iterate` are pure; a run is a value: mapped over keys it is many seeds side by side, saved and loaded it
goes on bit for bit, and sharded along the actors it runs on many devices.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, PRNGKeyArray

from toddle.navigate.ppo.adam import Adam
from toddle.navigate.ppo.collect import Actors, Rollout, Row, begin, collect
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.learn import Learned, fresh_optimiser, learn
from toddle.navigate.ppo.moments import Moments, unseen
from toddle.navigate.ppo.network import ActorCritic, actor_critic
from toddle.navigate.task import Outcome, Task

_GREATEST = 10.0  # of a normalised reward


class Training(NamedTuple):
    """A run between two updates.

    Attributes:
        network: the networks.
        optimiser: Adam's state.
        observations: moments of the observations seen.
        returns: moments of the discounted sums of rewards.
        actors: where they are.
        key: of what is drawn next.
        updates: made so far.
    """

    network: ActorCritic
    optimiser: Adam
    observations: Moments
    returns: Moments
    actors: Actors
    key: PRNGKeyArray
    updates: Int[Array, ""]


class Report(NamedTuple):
    """How an update went.

    Attributes:
        steps: made so far, all actors together.
        reward: mean of a step.
        episodes: that ended.
        return_: mean sum of rewards of these; NaN without any.
        length: mean of these [steps]; NaN without any.
        outcomes: how many ended how, in the order of `toddle.navigate.task.Outcome`; the first goes on.
        policy_loss: the clipped objective's.
        value_loss: squared error of the value.
        entropy: of the policy [nats].
        kl: between the policies before and after [nats].
        clipped: share of ratios that were clipped.
        explained: share of the variance that the critic explained.
        deviation: mean standard deviation of continuous actions; 0 for discrete ones.
        rate: the learning rate.
        gradient: greatest norm of a gradient.
    """

    steps: Int[Array, ""]
    reward: Float[Array, ""]
    episodes: Int[Array, ""]
    return_: Float[Array, ""]
    length: Float[Array, ""]
    outcomes: Int[Array, " outcomes"]
    policy_loss: Float[Array, ""]
    value_loss: Float[Array, ""]
    entropy: Float[Array, ""]
    kl: Float[Array, ""]
    clipped: Float[Array, ""]
    explained: Float[Array, ""]
    deviation: Float[Array, ""]
    rate: Float[Array, ""]
    gradient: Float[Array, ""]


def init(task: Task[Any], config: PpoConfig, key: PRNGKeyArray) -> Training:
    """A run before its first update."""
    making, beginning, key = jax.random.split(key, 3)
    network = actor_critic(config, task.observations, task.actions, making)
    return Training(
        network, fresh_optimiser(network), unseen(task.observations), unseen(1), begin(task, config, beginning), key,
        jnp.zeros((), jnp.int32),
    )  # fmt: skip


def iterate(task: Task[Any], config: PpoConfig, training: Training) -> tuple[Training, Report]:
    """Collect, then learn: one update."""
    acting, _ = jax.random.split(training.key)
    actors, rollout = collect(task, config, training.network, training.observations, training.actors, acting)
    return update(config, training._replace(actors=actors), rollout)


def update(config: PpoConfig, training: Training, rollout: Rollout) -> tuple[Training, Report]:
    """Learn from what was collected, wherever it was: the second half of `iterate`."""
    _, learning = jax.random.split(training.key)
    shuffling, key = jax.random.split(learning)
    rows = rollout.rows
    observations = training.observations.seen(rows.seen.reshape(-1, rows.seen.shape[-1]))
    returns = training.returns.seen(rows.discounted.reshape(-1, 1))
    rewards = rows.reward
    if config.normalise_rewards:
        # bounded, for returns that hardly vary would make rewards of any size
        rewards = jnp.clip(rewards / jnp.sqrt(returns.variance[0] + 1e-8), -_GREATEST, _GREATEST)
    rate, c2 = learning_rate(config, training.updates), _entropy_weight(config, rows.reward)
    found = learn(config, training.network, training.optimiser, rollout, rewards, rate, c2, shuffling)
    after = Training(found.network, found.optimiser, observations, returns, training.actors, key, training.updates + 1)
    return after, _report(config, after, rows, found, rate)


@partial(jax.jit, static_argnums=(0, 1, 3))
def train(task: Task[Any], config: PpoConfig, training: Training, updates: int) -> tuple[Training, Report]:
    """So many updates in one call; the report's parts get a leading axis."""
    return jax.lax.scan(lambda now, _: iterate(task, config, now), training, length=updates)


@partial(jax.jit, static_argnums=(0, 1, 3))
def train_seeds(task: Task[Any], config: PpoConfig, trainings: Training, updates: int) -> tuple[Training, Report]:
    """Many runs side by side: as `train`, each part with a leading axis of seeds."""
    return jax.vmap(lambda one: train(task, config, one, updates))(trainings)


def learning_rate(config: PpoConfig, updates: Int[Array, ""]) -> Float[Array, ""]:
    """After so many updates."""
    done = jnp.minimum(updates.astype(jnp.float32) / config.updates, 1.0)
    return config.learning_rate * (1.0 - done if config.schedule == "linear" else jnp.ones_like(done))


def _entropy_weight(config: PpoConfig, rewards: Float[Array, "steps actors"]) -> Float[Array, ""]:
    """c2, or c2 over the mean reward: little reward, much exploration."""
    mean = jnp.maximum(rewards.mean(), config.least_reward) if config.c2_over_reward else 1.0
    return jnp.float32(config.c2) / mean


def _report(config: PpoConfig, training: Training, rows: Row, found: Learned, rate: Float[Array, ""]) -> Report:
    ended = rows.terminated | rows.truncated
    episodes = ended.sum()
    count = jnp.where(episodes > 0, episodes.astype(jnp.float32), jnp.nan)
    outcomes = jnp.stack([(rows.outcome == kind).sum() for kind in Outcome])
    deviations = jnp.exp(found.network.log_deviation)
    return Report(
        training.updates * config.batch,
        rows.reward.mean(),
        episodes,
        jnp.where(ended, rows.total, 0.0).sum() / count,
        jnp.where(ended, rows.length, 0).sum().astype(jnp.float32) / count,
        outcomes,
        found.losses.policy,
        found.losses.value,
        found.losses.entropy,
        found.losses.kl,
        found.losses.clipped,
        found.explained,
        deviations.mean() if deviations.size else jnp.zeros(()),
        rate,
        found.gradient,
    )
