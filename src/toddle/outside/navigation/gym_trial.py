"""Trying a policy out on a Gymnasium environment: whole episodes, by the likeliest action or by drawn ones."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Float32, Int, PRNGKeyArray, Shaped

from toddle.navigate.policy import Policy
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.distribution import bounded
from toddle.navigate.ppo.moments import Moments
from toddle.navigate.ppo.network import ActorCritic
from toddle.outside.navigation.gym_copies import Copies


class Episodes(NamedTuple):
    """How each went.

    Attributes:
        total: sum of its rewards.
        length: in steps.
        truncated: it was cut off.
    """

    total: Float32[np.ndarray, " episodes"]
    length: Int[np.ndarray, " episodes"]
    truncated: Bool[np.ndarray, " episodes"]


def gym_episodes(
    name: str, policy: Policy, seed: int, count: int, *, noisy: bool = False, longest: int = 10_000
) -> Episodes:
    """So many episodes, one of each copy, so that short ones are no more often among them than long ones.

    Args:
        name: id of the environment.
        policy: to try.
        seed: of the first copy; the others follow.
        count: how many.
        noisy: draw the actions, as in training.
        longest: steps after which an episode is left as it is.

    Raises:
        BadInput: the environment is of no use, or the policy doesn't fit it.
    """
    copies = Copies(name, count)
    try:
        copies.spaces.check(policy.observations, policy.actions)
        return _tried(copies, policy, seed, noisy, longest)
    finally:
        copies.close()


def _tried(copies: Copies, policy: Policy, seed: int, noisy: bool, longest: int) -> Episodes:
    seen, key = copies.begin(seed), jax.random.key(seed)
    memory = jnp.broadcast_to(policy.start(), (copies.actors, *policy.start().shape))
    total, length = np.zeros(copies.actors, np.float32), np.zeros(copies.actors, int)
    going, cut = np.ones(copies.actors, bool), np.zeros(copies.actors, bool)
    for call in range(longest):
        action, memory = _act(policy.config, noisy, policy.network, policy.moments, seen, memory, key, np.int32(call))
        found = copies.step(np.asarray(action))
        total[going] += found.reward[going]
        length[going] += 1
        cut |= going & found.truncated
        going &= ~(found.terminated | found.truncated)
        seen = found.following
        if not going.any():
            break
    return Episodes(total, length, cut | going)


@partial(jax.jit, static_argnums=(0, 1))
def _act(
    config: PpoConfig,
    noisy: bool,
    network: ActorCritic,
    moments: Moments,
    seen: Float[Array | np.ndarray, "actors numbers"],
    memory: Float[Array, "actors 2 units"],
    key: PRNGKeyArray,
    call: Int[Array, ""] | np.int32,
) -> tuple[Shaped[Array, "..."], Float[Array, "actors 2 units"]]:
    observation = jnp.asarray(seen)
    if config.normalise_observations:
        observation = moments.normalised(observation)
    given, memory = jax.vmap(network.policy)(observation, memory)
    action = given.sample(jax.random.fold_in(key, call)) if noisy else given.mode()
    return bounded(action, config.bound), memory
