"""The perceptron against automatic differentiation, and against a plain loop over neurons."""

from __future__ import annotations

import math
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from toddle.reach.learn.perceptron import Layers, Perceptron

PLAIN = {"symmetric": False, "margin": 0.0, "average": 0}
REFINED = {"symmetric": True, "margin": 0.25, "average": 10}
X, Q = jnp.array([0.2, 0.9]), jnp.array([0.1, 0.6, 0.95])


def random_layers(learner: Perceptron, seed: int = 0) -> Layers:
    """Weights far from those that rehearsing home leaves."""
    random = np.random.default_rng(seed)
    state = jax.eval_shape(learner.init, jax.random.key(seed), X, Q)
    return jax.tree.map(lambda leaf: jnp.asarray(random.normal(size=leaf.shape), jnp.float32), state)


@pytest.mark.parametrize(("kind", "hidden"), [(PLAIN, ()), (PLAIN, (5, 3)), (REFINED, (4,)), (REFINED, (2, 3, 2))])
def test_an_update_goes_down_the_gradient_of_the_squared_error(kind: dict[str, Any], hidden: tuple[int, ...]) -> None:
    learner = Perceptron(jnp.float32(0.7), hidden, **kind)
    state, weight = random_layers(learner), 0.3
    span = 1 - 2 * learner.margin  # the error is measured at the outputs, which the margin squeezes

    def half_squared_error(now: tuple) -> jax.Array:
        return 0.5 * jnp.sum((span * (learner.predict(state._replace(now=now), X) - Q)) ** 2)

    slope = jax.jit(jax.grad(half_squared_error))(state.now)
    wanted = jax.tree.map(lambda leaf, down: leaf - 0.7 * weight * down, state.now, slope)
    found = eqx.filter_jit(learner.update)(state, X, Q, jnp.float32(weight)).now
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-5, atol=1e-6), found, wanted)


def test_it_is_the_back_propagation_of_the_textbook() -> None:
    """Equations 1.2 to 1.6, one neuron at a time."""
    learner = Perceptron(jnp.float32(0.5), (3,))
    state = random_layers(learner, 4)
    (w, b), (v, c) = [(np.array(layer.weights, float), np.array(layer.bias, float)) for layer in state.now]
    samples = np.random.default_rng(2).random((20, 5))
    for sample in samples:
        x, q = sample[:2], sample[2:]
        hidden = [1 / (1 + math.exp(-sum(w[j][i] * x[i] for i in range(2)) - b[j])) for j in range(3)]
        out = [1 / (1 + math.exp(-sum(v[k][j] * hidden[j] for j in range(3)) - c[k])) for k in range(3)]
        top = [(q[k] - out[k]) * out[k] * (1 - out[k]) for k in range(3)]
        below = [sum(top[k] * v[k][j] for k in range(3)) * hidden[j] * (1 - hidden[j]) for j in range(3)]
        for k in range(3):
            c[k] += 0.5 * top[k]
            for j in range(3):
                v[k][j] += 0.5 * top[k] * hidden[j]
        for j in range(3):
            b[j] += 0.5 * below[j]
            for i in range(2):
                w[j][i] += 0.5 * below[j] * x[i]
    update = eqx.filter_jit(learner.update)
    for sample in samples.astype(np.float32):
        state = update(state, jnp.array(sample[:2]), jnp.array(sample[2:]), jnp.float32(1.0))
    for layer, weights, bias in zip(state.now, (w, v), (b, c), strict=True):
        np.testing.assert_allclose(layer.weights, weights, rtol=1e-4, atol=1e-5)
        np.testing.assert_allclose(layer.bias, bias, rtol=1e-4, atol=1e-5)


def test_a_sample_of_no_weight_teaches_nothing() -> None:
    learner = Perceptron(jnp.float32(0.7), (4,))
    state = random_layers(learner)
    jax.tree.map(np.testing.assert_array_equal, learner.update(state, X, Q, jnp.float32(0.0)), state)


@pytest.mark.parametrize(("kind", "hidden"), [(PLAIN, ()), (REFINED, (20, 20))])
def test_it_begins_at_home_whatever_the_seed(kind: dict[str, Any], hidden: tuple[int, ...]) -> None:
    learner, home_q = Perceptron(jnp.float32(0.717), hidden, **kind), jnp.array([0.5, 0.3, 0.7])
    init = jax.jit(jax.vmap(lambda key: learner.init(key, X, home_q)))
    states = init(jax.random.split(jax.random.key(1), 3))
    answers = jax.vmap(lambda state: learner.answer(state, X))(states)
    np.testing.assert_allclose(answers, np.broadcast_to(home_q, (3, 3)), atol=5e-3)
    first = states.now[0].weights
    assert float(jnp.abs(first[0] - first[1]).max()) > 0.01


def test_a_margin_lets_an_output_stand_at_a_joint_limit() -> None:
    """A sigmoid never gets to 0 or 1; with a margin, the limits lie inside what it can say."""
    plain, with_margin = Perceptron(jnp.float32(0.7), ()), Perceptron(jnp.float32(0.7), (), margin=0.25)
    state = jax.tree.map(lambda leaf: 10.0 * jnp.ones_like(leaf), random_layers(plain))
    assert float(plain.predict(state, X).max()) <= 1.0
    assert float(with_margin.predict(state, X).min()) == pytest.approx(1.5, abs=1e-3)


def test_answers_are_an_exponential_mean_of_the_weights() -> None:
    learner = Perceptron(jnp.float32(0.7), (), average=10)
    state = random_layers(learner)
    mean = np.array(jax.tree.leaves(state.mean)[0], float)
    update = eqx.filter_jit(learner.update)
    for step in range(5):
        state = update(state, X, Q * step / 4, jnp.float32(1.0))
        mean = 0.9 * mean + 0.1 * np.array(jax.tree.leaves(state.now)[0], float)
    assert state.mean is not None
    np.testing.assert_allclose(state.mean[0].weights, mean, rtol=1e-5)
    by_hand = 1 / (1 + np.exp(-(mean @ np.array(X) + np.array(state.mean[0].bias))))
    np.testing.assert_allclose(learner.answer(state, X), by_hand, rtol=1e-5)
    assert not np.allclose(learner.answer(state, X), learner.predict(state, X), atol=1e-4)


def test_symmetric_inputs_put_the_middle_of_the_box_at_zero() -> None:
    learner = Perceptron(jnp.float32(0.7), (), symmetric=True)
    state = random_layers(learner)
    middle = learner.predict(state, jnp.array([0.5, 0.5]))
    np.testing.assert_allclose(middle, 1 / (1 + np.exp(-np.array(state.now[0].bias))), rtol=1e-5)
