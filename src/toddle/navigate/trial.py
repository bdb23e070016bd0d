"""Trying a policy out on a task, in JAX and without noise: for so many steps, or one episode of each actor."""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from toddle.navigate.policy import Policy
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.moments import Moments
from toddle.navigate.ppo.network import ActorCritic
from toddle.navigate.task import Actions, Outcome, Task


class Tally(NamedTuple):
    """What happened to each actor.

    Attributes:
        outcomes: how many episodes ended how, in the order of `Outcome`; the first counts steps that went on.
        total: sum of all rewards.
    """

    outcomes: Int[Array, "actors outcomes"]
    total: Float[Array, " actors"]


class Episode(NamedTuple):
    """Each actor's first episode.

    Attributes:
        outcome: how it ended; goes on: it did not, in the steps that there were.
        length: in steps.
        total: sum of its rewards.
    """

    outcome: Int[Array, " actors"]
    length: Int[Array, " actors"]
    total: Float[Array, " actors"]


def tally(task: Task[Any], policy: Policy, key: PRNGKeyArray, actors: int, steps: int) -> Tally:
    """So many steps of each actor, episode after episode (the deterministic test of Huber 2019, section 4.3.1)."""
    begun, key = _begun(task, key, actors)
    outcome, reward, _ = _tried(task, (policy.config, policy.actions), _arrays(policy), begun, key, steps)
    counts = jnp.stack([(outcome == kind).sum(axis=0) for kind in Outcome], axis=1)
    return Tally(counts, reward.sum(axis=0))


def episodes(task: Task[Any], policy: Policy, key: PRNGKeyArray, actors: int, steps: int) -> Episode:
    """The first episode of each actor, of at most so many steps."""
    begun, key = _begun(task, key, actors)
    return episodes_from(task, policy, begun, key, steps)


def episodes_from(
    task: Task[Any], policy: Policy, begun: tuple[Any, Float[Array, "actors numbers"]], key: PRNGKeyArray, steps: int
) -> Episode:
    """The same from given starts: what ``task.start`` would have returned, with a leading axis of actors."""
    outcome, reward, ended = _tried(task, (policy.config, policy.actions), _arrays(policy), begun, key, steps)
    first = jnp.argmax(ended, axis=0)
    done = ended.any(axis=0)
    length = jnp.where(done, first + 1, steps).astype(jnp.int32)
    inside = jnp.arange(steps)[:, None] < length[None]
    last = jnp.take_along_axis(outcome, first[None], axis=0)[0]
    return Episode(
        jnp.where(done, last, jnp.int32(Outcome.GOES_ON)), length, jnp.where(inside, reward, 0.0).sum(axis=0)
    )


def _begun(task: Task[Any], key: PRNGKeyArray, actors: int) -> tuple[Any, PRNGKeyArray]:
    beginning, key = jax.random.split(key)
    return jax.vmap(task.start)(jax.random.split(beginning, actors)), key


def _arrays(policy: Policy) -> tuple[ActorCritic, Moments]:
    return policy.network, policy.moments


@partial(jax.jit, static_argnums=(0, 1, 5))
def _tried(
    task: Task[Any],
    known: tuple[PpoConfig, Actions],
    learned: tuple[ActorCritic, Moments],
    begun: tuple[Any, Float[Array, "actors numbers"]],
    key: PRNGKeyArray,
    steps: int,
) -> tuple[Int[Array, "steps actors"], Float[Array, "steps actors"], Bool[Array, "steps actors"]]:
    """Outcome, reward and whether an episode ended, of each step."""
    config, actions = known
    network, moments = learned
    policy = Policy(network, moments, config, task.observations, actions)

    def one(carry: tuple, key: PRNGKeyArray) -> tuple:
        state, observation, memory = carry
        stepping, starting = jax.random.split(key)
        action, memory = policy(observation, memory)
        state, step = task.step(state, action, stepping)
        ended = step.terminated | step.truncated
        fresh, first = task.start(starting)
        following = (fresh, first, policy.start())
        here = (state, step.observation, memory)
        return jax.tree.map(lambda a, b: jnp.where(ended, a, b), following, here), (step.outcome, step.reward, ended)

    state, observation = begun
    actors = len(observation)

    def each(carry: tuple, key: PRNGKeyArray) -> tuple:
        return jax.vmap(one)(carry, jax.random.split(key, actors))

    memory = jnp.broadcast_to(policy.start(), (actors, *policy.start().shape))
    return jax.lax.scan(each, (state, observation, memory), jax.random.split(key, steps))[1]
