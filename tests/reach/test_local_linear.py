"""The local linear map against its formulas written out, and against what it promises."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.failures import BadInput
from toddle.reach.learn.local_linear import LocalLinearMap, LocalLinearState, local_linear_map

HOME_X, HOME_Q = jnp.array([0.5, 0.4]), jnp.array([0.3, 0.6, 0.5])
RADIUS = 0.2


def learned(learner: LocalLinearMap, count: int, seed: int = 0) -> LocalLinearState:
    """The state after so many samples of a smooth map."""
    x = jax.random.uniform(jax.random.key(seed), (count, 2))
    q = jax.vmap(posture)(x)
    first = learner.init(jax.random.key(0), HOME_X, HOME_Q)
    return _learn(learner, first, x, q)


@eqx.filter_jit
def _learn(learner: LocalLinearMap, state: LocalLinearState, x: jax.Array, q: jax.Array) -> LocalLinearState:
    step = lambda state, sample: (learner.update(state, sample[0], sample[1], jnp.float32(1.0)), None)  # noqa: E731
    return jax.lax.scan(step, state, (x, q))[0]


@eqx.filter_jit
def predict(learner: LocalLinearMap, state: LocalLinearState, x: jax.Array) -> jax.Array:
    return learner.predict(state, x)


def posture(x: jax.Array) -> jax.Array:
    """A smooth inverse, to learn from."""
    return 0.5 + 0.4 * jnp.stack([jnp.sin(3 * x[0]), jnp.cos(3 * x[1]), jnp.sin(2 * x[0] - 2 * x[1])])


def plain(state: LocalLinearState, x: np.ndarray) -> tuple[Any, Any]:
    """g(x) and the normalised responsibilities, by Rolf's formulas and a loop over all prototypes."""
    p = np.array(state.prototypes, float)[: int(state.used)]
    pieces = np.array(state.pieces, float)[: int(state.used)]
    b = np.array([np.exp(-np.sum((x - p_k) ** 2) / RADIUS**2) for p_k in p])
    g = sum(b_k * (m[:-1].T @ (x - p_k) / RADIUS + m[-1]) for b_k, p_k, m in zip(b, p, pieces, strict=True)) / sum(b)
    return g, b / sum(b)


LEARNER = local_linear_map(2, radius=RADIUS, neighbours=64)
STATE = learned(LEARNER, 300)
point = st.tuples(st.floats(0, 1, width=32), st.floats(0, 1, width=32))


@given(point)
def test_it_answers_as_the_formula_says(x: tuple[float, float]) -> None:
    np.testing.assert_allclose(predict(LEARNER, STATE, jnp.array(x)), plain(STATE, np.array(x))[0], atol=1e-4)


@given(point)
def test_the_nearest_prototypes_are_enough(x: tuple[float, float]) -> None:
    few = local_linear_map(2, radius=RADIUS)
    np.testing.assert_allclose(predict(few, STATE, jnp.array(x)), plain(STATE, np.array(x))[0], atol=5e-3)


def test_a_step_follows_the_gradient() -> None:
    """dE/dW of E = w |q - g(x)|^2 / 2, by finite differences on the plain formula."""
    x, q, weight = np.array([0.31, 0.62]), np.array([0.9, 0.1, 0.2]), 0.7
    after = LEARNER.update(STATE, jnp.asarray(x, jnp.float32), jnp.asarray(q, jnp.float32), jnp.float32(weight))
    assert int(after.used) == int(STATE.used)

    def cost(pieces: np.ndarray) -> float:
        return weight / 2 * np.sum((q - plain(STATE._replace(pieces=pieces), x)[0]) ** 2)  # pyright: ignore

    pieces, moved = np.array(STATE.pieces, float), np.array(after.pieces - STATE.pieces, float)
    for k in np.argsort(-np.abs(moved).sum(axis=(1, 2)))[:3]:
        for feature in range(3):
            high, low = pieces.copy(), pieces.copy()
            high[k, feature, 1] += 1e-3
            low[k, feature, 1] -= 1e-3
            slope = (cost(high) - cost(low)) / 2e-3
            np.testing.assert_allclose(moved[k, feature, 1], -0.1 * slope, atol=1e-5)


def test_a_new_prototype_leaves_the_estimate_as_it_is() -> None:
    state = learned(LEARNER, 6)
    points = jax.random.uniform(jax.random.key(1), (200, 2))
    nearest = jnp.min(jnp.sum((points[:, None] - state.prototypes[None]) ** 2, axis=-1), axis=1)
    x = points[jnp.argmax(nearest)]
    before = predict(LEARNER, state, x)
    after = LEARNER.update(state, x, before, jnp.float32(1.0))
    assert int(after.used) == int(state.used) + 1
    np.testing.assert_allclose(after.prototypes[state.used], x)
    np.testing.assert_allclose(predict(LEARNER, after, x), before, atol=1e-5)
    aside = x + jnp.array([0.01, -0.005])
    np.testing.assert_allclose(predict(LEARNER, after, aside), predict(LEARNER, state, aside), atol=1e-3)


def test_it_starts_by_answering_home_everywhere() -> None:
    state = LEARNER.init(jax.random.key(0), HOME_X, HOME_Q)
    for x in ([0.0, 0.0], [0.5, 0.4], [1.0, 0.3]):
        np.testing.assert_allclose(predict(LEARNER, state, jnp.array(x)), HOME_Q, atol=1e-6)


def test_prototypes_keep_their_distance_and_fit_the_box() -> None:
    state = learned(LEARNER, 3000)
    p = np.array(state.prototypes)[: int(state.used)]
    apart = np.linalg.norm(p[:, None] - p[None], axis=-1) + 9 * np.eye(len(p))
    assert apart.min() >= RADIUS - 1e-6
    assert 15 < len(p) < LEARNER.capacity
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, 15)] * 2), axis=-1).reshape(-1, 2)
    assert np.linalg.norm(grid[:, None] - p[None], axis=-1).min(axis=1).max() < 1.1 * RADIUS


def test_it_learns_a_smooth_map() -> None:
    x = jax.random.uniform(jax.random.key(9), (200, 2), minval=0.05, maxval=0.95)
    missed = jax.vmap(lambda x: predict(LEARNER, learned_long, x) - posture(x))
    learned_long = learned(LEARNER, 6000)
    assert float(jnp.max(jnp.abs(missed(x)))) < 0.02


def test_with_no_room_left_it_goes_on_learning_and_stays_finite() -> None:
    learner = LocalLinearMap(jnp.float32(0.02), jnp.float32(1.0), capacity=4, neighbours=16)
    state = learned(learner, 2000)
    assert int(state.used) == 4
    assert np.all(np.isfinite(state.pieces))


@pytest.mark.parametrize(("radius", "rate"), [(0.0, 0.1), (-1.0, 0.1), (float("nan"), 0.1), (0.1, 0.0), (0.1, 2.0)])
def test_parameters_that_cannot_be_are_refused(radius: float, rate: float) -> None:
    with pytest.raises(BadInput, match="give a number above 0, at most 1"):
        local_linear_map(2, radius=radius, learning_rate=rate)
