"""A policy takes the likeliest action, within its range, of observations normalised as they were in learning."""

from __future__ import annotations

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from toddle.navigate.policy import Policy, policy_of
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.training import init
from toddle.navigate.task import Actions, Continuous, Discrete
from toddle.navigate.tasks.probes import Observed

CONFIG = PpoConfig(actors=2, minibatch=2, hidden=(4,))
SEEN = jnp.array([3.0], jnp.float32)


def learned(config: PpoConfig, actions: Actions) -> Policy:
    """Nothing yet, but with answers that are far from zero."""
    training = jax.jit(init, static_argnums=(0, 1))(Observed(actions), config, jax.random.key(0))
    network = jax.tree.map(lambda weight: weight + 1.0, training.network)
    moments = training.observations.seen(jnp.array([[1.0], [5.0]], jnp.float32))
    return policy_of(training._replace(network=network, observations=moments), config, actions, {"task": "observed"})


@pytest.mark.parametrize("bound", ["clip", "tanh", "mean"])
def test_actions_are_in_range(bound: Any):
    policy = learned(dataclasses.replace(CONFIG, bound=bound), Continuous(3))
    action, _ = policy(SEEN * 50, policy.start())
    assert action.shape == (3,)
    assert 0.5 < float(action.max()) <= 1


def test_the_likeliest_choice_is_taken():
    policy = learned(CONFIG, Discrete(4))
    action, _ = policy(SEEN, policy.start())
    given, _ = policy.network.policy(policy.moments.normalised(SEEN), policy.start())
    chances = [float(given.log_prob(jnp.int32(choice))) for choice in range(4)]
    assert int(action) == int(np.argmax(chances))
    assert action.dtype == jnp.int32


def test_observations_are_normalised_by_what_was_seen():
    policy = learned(CONFIG, Continuous(1))
    plain = learned(dataclasses.replace(CONFIG, normalise_observations=False), Continuous(1))
    # 7 is (7 - 3) / 2 deviations from the mean of 1 and 5
    one, _ = policy(jnp.array([7.0]), policy.start())
    other, _ = plain(jnp.array([2.0]), plain.start())
    np.testing.assert_allclose(one, other, rtol=1e-3)


def test_memory_goes_on_and_starts_empty():
    policy = learned(dataclasses.replace(CONFIG, memory=3, horizon=32, minibatch=16), Continuous(1))
    assert policy.start().shape == (2, 3)
    assert not policy.start().any()
    first, memory = policy(SEEN, policy.start())
    second, _ = policy(SEEN, memory)
    assert float(first[0]) != float(second[0]) or bool((memory != 0).all())
    assert learned(CONFIG, Continuous(1)).start().shape == (2, 0)


def test_source_goes_with_it():
    policy = learned(CONFIG, Continuous(1))
    assert (policy.observations, policy.source, policy.figures) == (1, {"task": "observed"}, {})
