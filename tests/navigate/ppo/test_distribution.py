"""Densities and entropies against SciPy, and against integrals where there is no formula."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import integrate, special, stats

from toddle.navigate.ppo.distribution import Categorical, Gaussian, bounded, entropy_of

NUMBER = st.floats(-3, 3, width=32)


@given(mean=NUMBER, log=st.floats(-2, 1, width=32), action=NUMBER)
def test_normal_is_scipys(mean: float, log: float, action: float):
    ours = Gaussian(jnp.array([mean, 0.5], jnp.float32), jnp.array([log, -1.0], jnp.float32))
    known = stats.norm.logpdf(action, mean, np.exp(log)) + stats.norm.logpdf(0.25, 0.5, np.exp(-1))
    spread = stats.norm.entropy(mean, np.exp(log)) + stats.norm.entropy(0.5, np.exp(-1))
    assert float(ours.log_prob(jnp.array([action, 0.25], jnp.float32))) == pytest.approx(known, rel=1e-4, abs=1e-4)
    assert float(ours.entropy()) == pytest.approx(float(spread), rel=1e-5, abs=1e-5)
    np.testing.assert_allclose(ours.mode(), [mean, 0.5])


@given(logits=st.lists(st.floats(-8, 8, width=32), min_size=2, max_size=5))
def test_categorical_is_scipys(logits: list[float]):
    ours, chances = Categorical(jnp.array(logits, jnp.float32)), special.softmax(np.array(logits))
    for choice, chance in enumerate(chances):
        assert float(ours.log_prob(jnp.int32(choice))) == pytest.approx(np.log(chance), rel=1e-4, abs=1e-5)
    assert float(ours.entropy()) == pytest.approx(stats.entropy(chances), rel=1e-4, abs=1e-5)
    assert logits[int(ours.mode())] == max(logits)


def test_samples_are_of_the_distribution():
    key = jax.random.key(0)
    normal = Gaussian(jnp.full((4000, 1), 0.3), jnp.full((4000, 1), -0.5)).sample(key)[:, 0]
    assert stats.kstest(np.asarray(normal), stats.norm(0.3, np.exp(-0.5)).cdf).pvalue > 0.001
    chances = np.array([0.2, 0.5, 0.3])
    chosen = Categorical(jnp.broadcast_to(jnp.log(jnp.array(chances, jnp.float32)), (4000, 3))).sample(key)
    assert stats.chisquare(np.bincount(np.asarray(chosen)), 4000 * chances).pvalue > 0.001


def squashed_entropy(mean: float, log: float) -> float:
    """Of tanh(u), u normal: minus the integral of p log p, over u, where p(a) = p(u) / (1 - tanh(u)^2)."""
    width = np.exp(log)

    def surprise(u: float) -> float:
        likely = stats.norm.logpdf(u, mean, width)
        return -np.exp(likely) * (likely - np.log(1 - np.tanh(u) ** 2))

    return integrate.quad(surprise, mean - 8 * width, mean + 8 * width)[0]


@pytest.mark.parametrize(("mean", "log"), [(0.0, 0.0), (0.8, -1.0), (-0.5, 0.5)])
def test_squashed_entropy_and_its_gradient_are_the_integrals(mean: float, log: float):
    count = 100_000
    noise = jax.random.normal(jax.random.key(1), (count, 1))
    drawn = mean + np.float32(np.exp(log)) * noise

    def estimate(parts: jax.Array) -> jax.Array:
        given = Gaussian(jnp.full((count, 1), 1.0) * parts[0], jnp.full((count, 1), 1.0) * parts[1])
        return entropy_of(given, drawn, "tanh").mean()

    value, slope = jax.value_and_grad(estimate)(jnp.array([mean, log], jnp.float32))
    assert float(value) == pytest.approx(squashed_entropy(mean, log), abs=0.02)
    step = 1e-3
    known = [
        squashed_entropy(mean + step, log) - squashed_entropy(mean - step, log),
        squashed_entropy(mean, log + step) - squashed_entropy(mean, log - step),
    ]
    np.testing.assert_allclose(slope, np.array(known) / (2 * step), atol=0.03)


def test_squashed_entropy_stays_finite_far_out():
    far = Gaussian(jnp.array([30.0, -30.0]), jnp.zeros(2))
    assert np.isfinite(float(entropy_of(far, jnp.array([90.0, -90.0]), "tanh")))


def test_actions_are_kept_in_range():
    drawn = jnp.array([-3.0, 0.5, 2.0])
    np.testing.assert_allclose(bounded(drawn, "clip"), [-1, 0.5, 1])
    np.testing.assert_allclose(bounded(drawn, "tanh"), np.tanh([-3, 0.5, 2]), rtol=1e-6)
    np.testing.assert_allclose(bounded(drawn, "mean"), drawn)
    assert int(bounded(jnp.int32(7), "clip")) == 7
