"""Collecting experience: N actors act for T steps by the policy as it is (algorithm 1 of Huber 2019).

An episode that ends is followed by a new one in the same actor. The observation after each step is kept as well, since
the value of what would have followed counts where an episode was only cut off.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray, Shaped

from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.distribution import bounded
from toddle.navigate.ppo.moments import Moments
from toddle.navigate.ppo.network import ActorCritic, forgotten
from toddle.navigate.task import Task


class Actors(NamedTuple):
    """Where the actors are.

    Attributes:
        state: of the task.
        observation: last seen, as the task gave it.
        started: an episode has just begun.
        memory: of their networks.
        total: sum of the episode's rewards so far.
        length: of the episode so far, in steps.
        discounted: sum of rewards, older ones discounted, over the ends of episodes.
    """

    state: Any
    observation: Float[Array, "actors numbers"]
    started: Bool[Array, " actors"]
    memory: Float[Array, "actors 2 2 units"]
    total: Float[Array, " actors"]
    length: Int[Array, " actors"]
    discounted: Float[Array, " actors"]


class Row(NamedTuple):
    """What the actors saw and did in one step; with a leading axis, in many.

    Attributes:
        seen: observations before it, as the task gave them.
        observation: the same, normalised.
        after: normalised observations after it, of the same episode.
        action: as it was drawn.
        log_prob: of the action.
        reward: as the task gave it.
        terminated: the episode ended.
        truncated: it was cut off.
        outcome: how, see `toddle.navigate.task.Outcome`.
        started: an episode began with the observation before.
        memory: before the step.
        remembered: after it.
        total: sum of the episode's rewards up to here.
        length: of the episode up to here, in steps.
        discounted: sum of rewards, older ones discounted.
    """

    seen: Float[Array, "*steps actors numbers"]
    observation: Float[Array, "*steps actors numbers"]
    after: Float[Array, "*steps actors numbers"]
    action: Shaped[Array, "..."]
    log_prob: Float[Array, "*steps actors"]
    reward: Float[Array, "*steps actors"]
    terminated: Bool[Array, "*steps actors"]
    truncated: Bool[Array, "*steps actors"]
    outcome: Int[Array, "*steps actors"]
    started: Bool[Array, "*steps actors"]
    memory: Float[Array, "*steps actors 2 2 units"]
    remembered: Float[Array, "*steps actors 2 2 units"]
    total: Float[Array, "*steps actors"]
    length: Int[Array, "*steps actors"]
    discounted: Float[Array, "*steps actors"]


class Rollout(NamedTuple):
    """What an update learns from: the rows of all steps, and what the critic says of them.

    Attributes:
        rows: as they were collected.
        value: of the observations before each step.
        value_after: of those after it.
    """

    rows: Row
    value: Float[Array, "steps actors"]
    value_after: Float[Array, "steps actors"]


def begin(task: Task[Any], config: PpoConfig, key: PRNGKeyArray) -> Actors:
    """Each actor at the start of an episode of its own."""
    state, observation = jax.vmap(task.start)(jax.random.split(key, config.actors))
    none, count = jnp.zeros(config.actors, jnp.float32), jnp.zeros(config.actors, jnp.int32)
    memory = jnp.broadcast_to(forgotten(config), (config.actors, 2, 2, config.memory))
    return Actors(state, observation, jnp.ones(config.actors, bool), memory, none, count, none)


def collect(
    task: Task[Any],
    config: PpoConfig,
    network: ActorCritic,
    moments: Moments,
    actors: Actors,
    key: PRNGKeyArray,
) -> tuple[Actors, Rollout]:
    """T steps of all actors."""

    def step(actors: Actors, key: PRNGKeyArray) -> tuple[Actors, Row]:
        drawing, stepping, starting = jax.random.split(key, 3)
        memory = jnp.where(actors.started[:, None, None, None], 0.0, actors.memory)
        observation = normalised(config, moments, actors.observation)
        given, _, remembered = jax.vmap(network)(observation, memory)
        action = given.sample(drawing)
        state, found = jax.vmap(task.step)(
            actors.state, bounded(action, config.bound), jax.random.split(stepping, config.actors)
        )
        after = normalised(config, moments, found.observation)
        total, length = actors.total + found.reward, actors.length + 1
        discounted = config.gamma * actors.discounted + found.reward
        row = Row(
            actors.observation, observation, after, action, given.log_prob(action), found.reward, found.terminated,
            found.truncated, found.outcome, actors.started, memory, remembered, total, length, discounted,
        )  # fmt: skip
        ended = found.terminated | found.truncated
        fresh, first = jax.vmap(task.start)(jax.random.split(starting, config.actors))
        state, seen = _chosen(ended, (fresh, first), (state, found.observation))
        none = jnp.zeros_like(total)
        going = (jnp.where(ended, none, total), jnp.where(ended, 0, length), jnp.where(ended, none, discounted))
        return Actors(state, seen, ended, remembered, *going), row

    actors, rows = jax.lax.scan(step, actors, jax.random.split(key, config.horizon))
    return actors, valued(network, rows)


def valued(network: ActorCritic, rows: Row) -> Rollout:
    """With the critic's values, in one go."""
    values = jax.vmap(jax.vmap(lambda seen, memory: network(seen, memory)[1]))
    return Rollout(rows, values(rows.observation, rows.memory), values(rows.after, rows.remembered))


def normalised(
    config: PpoConfig, moments: Moments, observation: Float[Array, "*batch numbers"]
) -> Float[Array, "*batch numbers"]:
    """Observations as the networks get them."""
    return moments.normalised(observation) if config.normalise_observations else observation


def _chosen(which: Bool[Array, " actors"], one: Any, other: Any) -> Any:
    """For each actor one record or the other."""

    def choose(a: Array, b: Array) -> Array:
        return jnp.where(which.reshape(which.shape + (1,) * (a.ndim - 1)), a, b)

    return jax.tree.map(choose, one, other)
