"""A policy whose every step is known, a plain walk towards the goal, counted as the trial counts it."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from toddle.navigate.policy import Policy
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.moments import unseen
from toddle.navigate.ppo.network import ActorCritic, actor_critic
from toddle.navigate.task import Outcome
from toddle.navigate.tasks.point import PRIZE, PointTask
from toddle.navigate.trial import episodes, tally

TASK = PointTask(near=0.57)  # no place on the way is as near as that to the last bit
CONFIG = PpoConfig(hidden=(4,), activation="relu", bound="clip", normalise_observations=False)


def walker(way: float) -> Policy:
    """Goes towards the goal, or away from it, along each axis by itself."""
    apart = np.array([[-1.0, 0], [0, -1.0], [1.0, 0], [0, 1.0]])  # the goal less the point
    weights = (np.hstack([apart, -apart]), way * 10 * np.array([[1.0, 0], [0, 1.0], [-1.0, 0], [0, -1.0]]))

    def actors(network: ActorCritic) -> tuple:
        return network.actor.weights

    network = actor_critic(CONFIG, 4, TASK.actions, jax.random.key(0))
    given = tuple(jnp.asarray(weight, jnp.float32) for weight in weights)
    return Policy(eqx.tree_at(actors, network, given), unseen(4), CONFIG, 4, TASK.actions)


def known(goal: tuple[int, int]) -> tuple[int, float]:
    """Steps and sum of rewards of a walk to a goal."""
    place, steps = np.zeros(2), 0
    while steps == 0 or np.hypot(*(place - goal)) >= 0.57:
        place += 0.1 * np.clip(10 * (np.array(goal) - place), -1, 1)
        steps += 1
    return steps, np.hypot(*goal) - np.hypot(*(place - goal)) + PRIZE


def test_first_episodes_are_those_of_the_walk():
    found = episodes(TASK, walker(1.0), jax.random.key(1), 40, 60)
    assert (np.asarray(found.outcome) == Outcome.WON).all()
    walks = [known((x, y)) for x in range(-5, 6) for y in range(-5, 6)]
    for length, total in zip(found.length.tolist(), found.total.tolist(), strict=True):
        assert any(length == steps and total == pytest.approx(gained, abs=1e-3) for steps, gained in walks)
    assert len(set(found.length.tolist())) > 5


def test_episodes_that_did_not_end_say_so():
    found = episodes(TASK, walker(1.0), jax.random.key(1), 40, 20)
    ended = np.asarray(found.outcome) == Outcome.WON
    assert 0 < ended.sum() < 40
    assert (np.asarray(found.outcome)[~ended] == Outcome.GOES_ON).all()
    assert (np.asarray(found.length)[~ended] == 20).all()
    assert (np.asarray(found.length)[ended] <= 20).all()


def test_tally_counts_every_step_once():
    found = tally(TASK, walker(1.0), jax.random.key(2), 5, 500)
    counts = np.asarray(found.outcomes)
    np.testing.assert_array_equal(counts.sum(axis=1), 500)
    assert (counts[:, Outcome.LOST] == 0).all()
    # a goal is 4.2 away in the mean, and reached at up to 0.6 from it
    assert (counts[:, Outcome.WON] >= 500 // 50).all()
    np.testing.assert_allclose(found.total, counts[:, Outcome.WON] * (PRIZE + 3.3), rtol=0.1)


def test_who_walks_away_loses_all():
    counts = np.asarray(tally(TASK, walker(-1.0), jax.random.key(3), 5, 500).outcomes)
    assert (counts[:, Outcome.LOST] >= 5).all()
    # the point starts on some goals: that is a game won by any step
    assert (counts[:, Outcome.WON] <= counts[:, Outcome.LOST]).all()


def test_same_key_same_result():
    one, other = (tally(TASK, walker(1.0), jax.random.key(2), 5, 500) for _ in range(2))
    np.testing.assert_array_equal(one.total, other.total)
