"""The networks: what they see, what they forget, and that steering step by step is what was learned."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from small_networks import DOCUMENT, LIGHT, NETWORKS, episodes

from toddle.failures import BadInput
from toddle.navigate.cloning.batches import Batch
from toddle.navigate.cloning.config import CloningConfig, document
from toddle.navigate.cloning.driver import Clone
from toddle.navigate.cloning.network import network, unrolled, velocity
from toddle.navigate.cloning.policy import Cloned
from toddle.navigate.cloning.training import _given, begin, felt_shares
from toddle.navigate.driver import Driver, Situation
from toddle.navigate.sight import Sight
from toddle.signals import Velocity


def _policy(config: CloningConfig) -> Cloned:
    """Untrained, but with large answers, so that differences show."""
    training = begin(config, episodes(), 0)
    net = training.learner.network
    key = jax.random.key(1)
    steer = jax.random.normal(key, net.steer.shape, jnp.float32)
    return Cloned(replace(net, steer=steer), training.scale, config)


def _steered(policy: Cloned, number: int = 0, looks: int = 5) -> list[list[float]]:
    """What it says to the looks of an episode, one after the other."""
    one, memory, said = episodes()[number], policy.start(), []
    for look in range(looks):
        depth = jnp.asarray(one.depth[look] / 1000.0, jnp.float32)
        found, memory = policy(jnp.asarray(one.picture[look]), depth, jnp.asarray(one.felt[look]), memory)
        said.append(found.tolist())
    return said


@pytest.mark.parametrize("config", NETWORKS.values(), ids=NETWORKS.keys())
def test_steering_is_what_was_learned(config: CloningConfig) -> None:
    """Look by look with a memory, against all looks at once as in training."""
    policy, one = _policy(config), episodes()[0]
    picture, depth, felt, taught, labels = (part[None, :5] for part in one[1:])
    fresh, weight = np.arange(5)[None] == 0, np.ones((1, 5), np.float32)
    batch = Batch(picture, depth, felt, taught, labels, fresh, weight)
    given = _given(config, policy.scale, batch, None)
    features = policy.network.features(given.frames[0], given.felt[0])[None]
    remembered, _ = unrolled(policy.network, features, given.fresh, jnp.zeros((1, 2, config.units), jnp.float32))
    said = velocity(config, policy.network.answer(remembered).said)[0]
    np.testing.assert_allclose(_steered(policy), said, atol=1e-5)


@pytest.mark.parametrize("config", NETWORKS.values(), ids=NETWORKS.keys())
def test_memory_matters_unless_it_is_left_out(config: CloningConfig) -> None:
    for memory in (True, False):
        policy = _policy(replace(config, memory=memory))
        one, _ = episodes()[0], None
        depth, felt = jnp.asarray(one.depth[2] / 1000.0, jnp.float32), jnp.asarray(one.felt[2])
        alone, _ = policy(jnp.asarray(one.picture[2]), depth, felt, policy.start())
        assert np.allclose(_steered(policy)[2], alone, atol=1e-6) != memory


@pytest.mark.parametrize("config", NETWORKS.values(), ids=NETWORKS.keys())
def test_depth_matters_unless_it_is_left_out(config: CloningConfig) -> None:
    one = episodes()[1]
    for depth in (True, False):
        policy = _policy(replace(config, depth=depth))
        given = jnp.asarray(one.picture[0]), jnp.asarray(one.felt[0]), policy.start()
        near, far = (policy(given[0], jnp.full((60, 80), d, jnp.float32), *given[1:])[0] for d in (0.5, 0.0))
        assert np.allclose(near, far, atol=1e-7) != depth


def test_the_document_sees_the_last_five_looks_alone() -> None:
    """After five looks it makes no difference what came before."""
    policy, one = _policy(DOCUMENT), episodes()[3]
    said = []
    for first in (0, 2):
        memory, found = policy.start(), jnp.zeros(2)
        for look in range(first, 8):
            depth = jnp.asarray(one.depth[look] / 1000.0, jnp.float32)
            found, memory = policy(jnp.asarray(one.picture[look]), depth, jnp.asarray(one.felt[look]), memory)
        said.append(found)
    np.testing.assert_allclose(*said, atol=1e-6)


def test_the_documents_answer_stays_within_its_velocities() -> None:
    policy = _policy(DOCUMENT)
    policy = replace(policy, network=replace(policy.network, steer=1e4 * policy.network.steer))
    assert np.abs(_steered(policy)).max() <= DOCUMENT.ahead[1] + 1e-6


def test_the_sizes_are_as_documented() -> None:
    shapes = jax.eval_shape(
        lambda: (network(CloningConfig(), jax.random.key(0)), network(document(), jax.random.key(0)))
    )
    light, unet = (sum(leaf.size for leaf in jax.tree.leaves(one)) for one in shapes)
    assert 200_000 < light < 280_000
    assert 1_500_000 < unet < 3_000_000


def test_a_clone_is_a_driver_that_needs_eyes() -> None:
    clone = Clone(_policy(LIGHT))
    assert isinstance(clone, Driver)
    blind = Situation(0.0, np.zeros(3), (1.0, 0.0), Velocity(0.0, 0.0, 0.0))
    with pytest.raises(BadInput, match="nobody looks"):
        clone.decide(clone.start(), blind)
    one = episodes()[0]
    depth = np.where(one.depth[0] == 0, np.nan, one.depth[0] / 1000).astype(np.float32)
    felt = Velocity(float(one.felt[0, 0]), 0.0, float(one.felt[0, 1]))
    said, _ = clone.decide(clone.start(), blind._replace(sight=Sight(one.picture[0], depth), velocity=felt))
    np.testing.assert_allclose([said.vx, said.omega], _steered(clone.policy)[0], atol=1e-5)
    assert said.vy == 0.0


def test_velocities_are_felt_as_shares_of_the_greatest() -> None:
    felt = felt_shares(jnp.array([LIGHT.ahead[1], -LIGHT.turning], jnp.float32), LIGHT)
    np.testing.assert_allclose(felt, [1.0, -1.0])
