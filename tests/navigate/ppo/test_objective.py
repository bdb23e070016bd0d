"""The clipped objective: where its gradient is zero, where it is the plain policy gradient, and its parts."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.distribution import Gaussian
from toddle.navigate.ppo.network import ActorCritic, actor_critic
from toddle.navigate.ppo.objective import Minibatch, objective
from toddle.navigate.task import Continuous

CONFIG = PpoConfig(hidden=(8,), normalise_advantages=False, c1=0.5, epsilon=0.2, deviation=0.7)
ROWS = 64
NETWORK = actor_critic(CONFIG, 3, Continuous(2), jax.random.key(0))
SEEN = jax.random.normal(jax.random.key(1), (ROWS, 3))
GRADIENT = jax.jit(jax.grad(objective, has_aux=True), static_argnums=2)


def policy(network: ActorCritic) -> Gaussian:
    none = jnp.zeros((ROWS, 2, 2, 0))
    given, _, _ = jax.vmap(network)(SEEN, none)
    assert isinstance(given, Gaussian)
    return given


ACTION = policy(NETWORK).sample(jax.random.key(2))


def batch(advantage: jax.Array, log_ratio: float = 0.0) -> Minibatch:
    """Actions that are now so much likelier, in logarithms, than when they were drawn."""
    return Minibatch(
        observation=SEEN[:, None],
        action=ACTION[:, None],
        log_prob=(policy(NETWORK).log_prob(ACTION) - log_ratio)[:, None],
        advantage=advantage[:, None],
        target=jnp.zeros((ROWS, 1)),
        started=jnp.ones((ROWS, 1), bool),
        memory=jnp.zeros((ROWS, 2, 2, 0)),
    )


def actors_part(gradient: ActorCritic) -> np.ndarray:
    parts = jax.tree.leaves((gradient.actor, gradient.log_deviation))
    return np.concatenate([np.ravel(part) for part in parts])


@pytest.mark.parametrize(
    ("ratio", "sign", "held"),
    [(1.3, 1, True), (0.7, -1, True), (1.3, -1, False), (0.7, 1, False), (1.1, 1, False), (0.9, -1, False)],
)
def test_no_gradient_where_the_clip_holds(ratio: float, sign: int, held: bool):
    gradient, losses = GRADIENT(NETWORK, batch(jnp.full(ROWS, float(sign)), np.log(ratio)), CONFIG, jnp.float32(0))
    assert (np.abs(actors_part(gradient)).max() == 0) == held
    kept = np.clip(ratio, 0.8, 1.2) if held else ratio
    assert float(losses.policy) == pytest.approx(-sign * kept, rel=1e-4)
    assert float(losses.clipped) == (abs(ratio - 1) > 0.2)


def test_at_ratio_1_it_is_the_policy_gradient():
    advantage = jax.random.normal(jax.random.key(3), (ROWS,))
    gradient, losses = GRADIENT(NETWORK, batch(advantage), CONFIG, jnp.float32(0))
    known = jax.grad(lambda network: -(policy(network).log_prob(ACTION) * advantage).mean())(NETWORK)
    np.testing.assert_allclose(actors_part(gradient), actors_part(known), rtol=1e-3, atol=1e-5)
    assert float(losses.kl) == pytest.approx(0, abs=1e-6)


def test_value_and_entropy_are_weighed():
    """L = policy + c1 value - c2 entropy; the entropy of two numbers of deviation 0.7 is known (4.3)."""
    total, losses = objective(NETWORK, batch(jnp.ones(ROWS)), CONFIG, jnp.float32(0.3))
    assert float(losses.entropy) == pytest.approx(2 * (0.5 + 0.5 * np.log(2 * np.pi) + np.log(0.7)), rel=1e-5)
    values = jax.vmap(NETWORK)(SEEN, jnp.zeros((ROWS, 2, 2, 0)))[1]
    assert float(losses.value) == pytest.approx(float((values**2).mean()), rel=1e-5)
    parts = float(losses.policy) + 0.5 * float(losses.value) - 0.3 * float(losses.entropy)
    assert float(total) == pytest.approx(parts, rel=1e-5)


def test_kl_is_that_between_the_policies():
    """Old policy: the same means, deviation e^0.1 wider; KL(old | new) of normals in closed form, twice."""
    old = policy(NETWORK)._replace(log_deviation=policy(NETWORK).log_deviation + 0.1)
    keys = jax.random.split(jax.random.key(4), 400)
    drawn = jax.vmap(old.sample)(keys)
    ratio_log = jax.vmap(policy(NETWORK).log_prob)(drawn) - jax.vmap(old.log_prob)(drawn)
    estimates = jnp.exp(ratio_log) - 1 - ratio_log
    assert float(estimates.mean()) == pytest.approx(2 * (-0.1 + np.exp(0.2) / 2 - 0.5), rel=0.1)
    given = batch(jnp.ones(ROWS))._replace(action=drawn[0][:, None], log_prob=old.log_prob(drawn[0])[:, None])
    _, losses = objective(NETWORK, given, CONFIG, jnp.float32(0))
    assert float(losses.kl) == pytest.approx(float(estimates[0].mean()), rel=1e-3)


def test_advantages_are_normalised_in_the_minibatch():
    config = PpoConfig(hidden=(8,), epsilon=0.2, deviation=0.7)
    advantage = jax.random.normal(jax.random.key(5), (ROWS,))
    one, _ = GRADIENT(NETWORK, batch(advantage), config, jnp.float32(0))
    other, _ = GRADIENT(NETWORK, batch(advantage * 50 + 7), config, jnp.float32(0))
    np.testing.assert_allclose(actors_part(one), actors_part(other), rtol=1e-2, atol=1e-4)
