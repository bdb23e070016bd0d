"""The loop: it learns, it goes on bit for bit, and leaves out what is to be left out."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from small_networks import LIGHT, NETWORKS, episodes

from toddle.navigate.cloning.commands import levels, shares
from toddle.navigate.cloning.config import CloningConfig
from toddle.navigate.cloning.heads import heads_loss
from toddle.navigate.cloning.labels import COS, LABELS, SEEN
from toddle.navigate.cloning.network import velocity
from toddle.navigate.cloning.objective import command_loss
from toddle.navigate.cloning.training import Training, begin, rate_at, step, validation, with_episodes


def _trained(config: CloningConfig, count: int, training: Training | None = None) -> tuple[Training, list[float]]:
    told, given = [], episodes()
    training = training or begin(config, given, 0)
    for _ in range(count):
        training, losses = step(training, config, given, 3e-3)
        told.append(float(losses.total))
    return training, told


def _leaves(training: Training) -> list[np.ndarray]:
    leaves = jax.tree.leaves(training)
    return [np.asarray(jax.random.key_data(x) if jnp.issubdtype(x.dtype, jax.dtypes.prng_key) else x) for x in leaves]


@pytest.mark.parametrize("config", NETWORKS.values(), ids=NETWORKS.keys())
def test_it_learns_what_it_is_shown(config: CloningConfig) -> None:
    """In bright rooms the teacher turns left, in dark ones right; rooms that it never saw are no different."""
    config = replace(config, channels=(4, 4, 4), hidden=16, units=8, shift=0, light=0.0, noise=0.0, dropped=0.0)
    given = []
    for number, one in enumerate(episodes(8)):
        bright = number % 2
        taught = np.broadcast_to(np.array([0.1, 0.25 if bright else -0.25], np.float32), one.taught.shape)
        given.append(one._replace(picture=one.picture // 4 + np.uint8(180 * bright), taught=taught.copy()))
    training = begin(config, given[:6], 0)
    untrained = training.learner.network
    for _ in range(120):
        training, _ = step(training, config, given[:6], 3e-3)
    before, after = (
        validation(net, training.scale, config, given[6:]) for net in (untrained, training.learner.network)
    )
    assert float(after.turning) < 0.5 * float(before.turning)


def test_the_same_seed_gives_the_same_run() -> None:
    one, other = _trained(LIGHT, 3)[0], _trained(LIGHT, 3)[0]
    assert all(np.array_equal(a, b) for a, b in zip(_leaves(one), _leaves(other), strict=True))


def test_other_episodes_keep_what_was_learned() -> None:
    training, _ = _trained(LIGHT, 2)
    after = with_episodes(training, LIGHT, episodes(6), 1)
    assert after.learner.network is training.learner.network
    assert after.learner.adam is training.learner.adam
    assert after.scale is training.scale
    assert float(jnp.abs(after.learner.memory).max()) == 0.0


def test_the_rate_falls() -> None:
    rates = [rate_at(LIGHT, done, 100) / LIGHT.rate for done in (0, 69, 70, 87, 88, 99)]
    assert rates == pytest.approx([1, 1, 0.3, 0.3, 0.1, 0.1])
    assert rate_at(replace(LIGHT, falls=False), 99, 100) == LIGHT.rate


def test_without_heads_they_are_not_learned() -> None:
    one, other = (_trained(replace(LIGHT, heads=heads), 2)[0].learner.network.tell for heads in (True, False))
    assert np.array_equal(other, begin(LIGHT, episodes(), 0).learner.network.tell)
    assert not np.array_equal(one, other)


def test_the_documents_loss_is_the_mean_square_of_shares() -> None:
    """Greatest velocities 0.3 and 0.3: off by 0.15 and 0.03 of what was said."""
    config = NETWORKS["document"]
    said, taught = jnp.array([0.5, 0.0], jnp.float32), jnp.array([0.0, 0.03], jnp.float32)
    assert float(command_loss(said, taught, config)) == pytest.approx((0.5**2 + 0.1**2) / 2, rel=1e-5)


def test_the_loss_of_levels_is_least_where_they_are_right() -> None:
    """At the logarithms of the right shares its gradient is zero, and says the right velocity; elsewhere it is not."""
    config, taught = LIGHT, jnp.array([0.17, -0.1], jnp.float32)
    parts = [shares(value, steps) for value, steps in zip(taught, levels(config), strict=True)]
    right = jnp.log(jnp.maximum(jnp.concatenate(parts), 1e-12))
    gradient = jax.grad(lambda said: command_loss(said, taught, config))
    np.testing.assert_allclose(gradient(right), 0.0, atol=1e-5)
    np.testing.assert_allclose(velocity(config, right), taught, atol=1e-4)
    assert float(jnp.abs(gradient(jnp.zeros_like(right))).max()) > 0.1


def test_a_target_that_was_never_seen_has_no_place() -> None:
    labels, told = jnp.zeros(LABELS), jnp.zeros(LABELS)
    unseen, wrong = heads_loss(told, labels), heads_loss(told.at[COS].set(1.0), labels)
    assert float(unseen) == float(wrong)
    seen = labels.at[SEEN].set(1.0)
    assert float(heads_loss(told, seen)) < float(heads_loss(told.at[COS].set(1.0), seen))
