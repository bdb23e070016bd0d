"""Learning sees what collecting saw: the same probabilities and values, over ends of episodes inside a sequence."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from toddle.navigate.ppo.collect import collect
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.learn import _sequences
from toddle.navigate.ppo.objective import _along, objective
from toddle.navigate.ppo.training import init
from toddle.navigate.task import Continuous
from toddle.navigate.tasks.probes import Remembered

TASK = Remembered(length=3, actions=Continuous(1))
CONFIG = PpoConfig(
    actors=4, horizon=16, minibatch=16, hidden=(8,), memory=5, sequence=8, deviation=0.5, normalise_observations=True
)


@pytest.fixture(scope="module")
def collected():
    """The second rollout, with memories from the first, and observations normalised."""

    @jax.jit
    def both(key):
        training = init(TASK, CONFIG, key)
        # weights that matter: the actor's answers begin near zero
        network = jax.tree.map(lambda weight: weight * 2.0, training.network)
        moments = training.observations.seen(jnp.array([[0.5], [-1.0], [2.0]], jnp.float32))
        actors, first = collect(TASK, CONFIG, network, moments, training.actors, jax.random.key(1))
        _, second = collect(TASK, CONFIG, network, moments, actors, jax.random.key(2))
        return network, moments, first, second

    return both(jax.random.key(0))


def test_ratios_are_1_before_the_first_step(collected):
    network, _, _, rollout = collected
    assert np.asarray(rollout.rows.started)[1:].any()
    batch = _sequences(CONFIG, rollout.rows, rollout.value, rollout.value)
    given, value = jax.vmap(_along, in_axes=(None, 0))(network, batch)
    np.testing.assert_allclose(given.log_prob(batch.action), batch.log_prob, atol=1e-5)
    np.testing.assert_allclose(value, batch.target, atol=1e-5)
    _, losses = objective(network, batch, CONFIG, jnp.float32(0))
    assert float(losses.clipped) == 0
    assert float(losses.kl) == pytest.approx(0, abs=1e-6)
    assert float(losses.value) == pytest.approx(0, abs=1e-6)


def test_memory_matters(collected):
    """Without it the probabilities differ, so the test above can fail."""
    network, _, _, rollout = collected
    batch = _sequences(CONFIG, rollout.rows, rollout.value, rollout.value)
    forgetful = batch._replace(memory=jnp.zeros_like(batch.memory))
    _, value = jax.vmap(_along, in_axes=(None, 0))(network, forgetful)
    assert np.abs(np.asarray(value - batch.target)).max() > 1e-3
    never = batch._replace(started=jnp.zeros_like(batch.started))
    _, value = jax.vmap(_along, in_axes=(None, 0))(network, never)
    assert np.abs(np.asarray(value - batch.target)).max() > 1e-3


def test_memory_is_empty_where_an_episode_starts(collected):
    _, _, _, rollout = collected
    rows = rollout.rows
    began = np.asarray(rows.started)
    assert (np.asarray(rows.memory)[began] == 0).all()
    assert (np.asarray(rows.memory)[~began] != 0).any()


def test_sequences_are_of_one_actor_in_order(collected):
    _, _, _, rollout = collected
    marks = jnp.arange(64.0).reshape(16, 4)
    cut = _sequences(CONFIG, rollout.rows, marks, marks)
    known = [[float((chunk * 8 + step) * 4 + actor) for step in range(8)] for chunk in range(2) for actor in range(4)]
    np.testing.assert_array_equal(cut.advantage, known)


def test_a_rollout_is_normalised_by_what_was_known_before_it(collected):
    _, moments, _, rollout = collected
    seen = np.asarray(rollout.rows.seen)
    known = (seen - float(moments.mean[0])) / np.sqrt(float(moments.variance[0]))
    np.testing.assert_allclose(rollout.rows.observation, known, rtol=1e-4, atol=1e-5)


def test_what_follows_an_end_is_a_new_episode(collected):
    _, _, _, rollout = collected
    rows = rollout.rows
    ended = np.asarray(rows.terminated | rows.truncated)
    np.testing.assert_array_equal(np.asarray(rows.started)[1:], ended[:-1])
    assert (np.asarray(rows.length)[ended] == 3).all()
    first = np.asarray(rows.seen)[1:][ended[:-1]]
    assert (np.abs(first) == 1).all()
    goes_on = ~ended[:-1]
    after, seen = np.asarray(rows.after)[:-1][goes_on], np.asarray(rows.observation)[1:][goes_on]
    np.testing.assert_allclose(after, seen, rtol=1e-6)
