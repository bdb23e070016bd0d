"""Observed correction: on a linear arm the steps are known in closed form; on a bent one the errors must vanish."""

from __future__ import annotations

from itertools import pairwise
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.failures import BadInput
from toddle.reach.solve.correction import _broyden, correct
from toddle.reach.solve.memory import Memory

METHODS: list[Literal["newton", "shift"]] = ["newton", "shift"]
FORWARD = np.array([[0.6, 0.3, 0.1], [-0.2, 0.5, 0.4]], np.float32)
INVERSE = np.linalg.pinv(FORWARD)
MIDDLE = np.full(3, 0.5, np.float32)
TARGETS = jnp.array([[0.52, 0.45], [0.4, 0.38], [0.6, 0.3], [0.45, 0.33]])


def linear(q: jax.Array) -> jax.Array:
    """An arm whose tip follows its joints linearly."""
    return q @ jnp.asarray(FORWARD.T)


def bent(q: jax.Array) -> jax.Array:
    """An arm that bends: the same, and a little of everything squared."""
    return linear(q) + 0.08 * jnp.sin(5 * q[:, :2]) - 0.05 * q[:, 1:] ** 2


def rough(x: jax.Array) -> jax.Array:
    """An inverse of the linear arm that is off, in value and in slope."""
    return jnp.asarray(MIDDLE + 0.02) + 0.8 * jnp.asarray(INVERSE) @ (x - jnp.asarray(FORWARD @ MIDDLE))


def test_shifting_leaves_the_known_share_of_the_error_on_a_linear_arm() -> None:
    """With J g' = 0.8 I an error e becomes e - 0.8 e at every look."""
    errors = np.array(correct(rough, linear, TARGETS, 3, method="shift").errors)
    for look in range(3):
        np.testing.assert_allclose(errors[look + 1], 0.2 * errors[look], rtol=2e-2, atol=1e-6)


def test_newton_starts_with_the_slope_of_the_estimate_and_mends_it() -> None:
    """The first step leaves 0.2 of the error; Broyden's update then knows the slope along it exactly."""
    errors = np.array(correct(rough, linear, TARGETS, 2).errors)
    np.testing.assert_allclose(errors[1], 0.2 * errors[0], rtol=2e-2)
    np.testing.assert_allclose(errors[2], 0.0, atol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_the_answer_kept_is_the_best_movement_made(method: Literal["newton", "shift"]) -> None:
    made: list[np.ndarray] = []

    def observe(q: jax.Array) -> jax.Array:
        made.append(np.array(q))
        return bent(q)

    looks, edges = 5, np.array([2.0, 0.5], np.float32)
    found = correct(rough, observe, TARGETS, looks, method=method, scale=jnp.array(edges))
    assert len(made) == looks + 1
    all_q = np.stack(made)
    reached = np.stack([np.array(bent(jnp.array(q))) for q in all_q])
    distance = np.linalg.norm((reached - np.array(TARGETS)) * edges, axis=-1)
    np.testing.assert_allclose(found.errors, np.minimum.accumulate(distance), atol=1e-6)
    np.testing.assert_allclose(found.q, all_q[distance.argmin(axis=0), np.arange(len(TARGETS))], atol=1e-6)
    assert np.all(np.array(found.errors[-1]) < 0.15 * np.array(found.errors[0]))


def test_no_look_is_open_loop() -> None:
    found = correct(rough, bent, TARGETS, 0)
    np.testing.assert_allclose(found.q, jax.vmap(rough)(TARGETS), atol=1e-6)
    assert found.errors.shape == (1, len(TARGETS))


@pytest.mark.parametrize("method", METHODS)
def test_out_of_reach_targets_keep_the_limits_and_the_best_error(method: Literal["newton", "shift"]) -> None:
    targets = jnp.array([[3.0, 3.0], [-2.0, 0.4]])
    found = correct(rough, bent, targets, 6, method=method)
    assert np.all((np.array(found.q) >= 0) & (np.array(found.q) <= 1))
    assert np.all(np.diff(np.array(found.errors), axis=0) <= 0)


def test_a_step_of_the_joints_is_limited() -> None:
    made: list[np.ndarray] = []

    def observe(q: jax.Array) -> jax.Array:
        made.append(np.array(q))
        return linear(q)

    correct(rough, observe, TARGETS + 0.4, 3, largest=0.05)
    assert max(np.abs(b - a).max() for a, b in pairwise(made)) <= 0.05 + 1e-6


def test_a_memory_offers_a_closer_start() -> None:
    """A learner that knows nothing, and movements around the target: the first step is taken from them."""
    q = jax.random.uniform(jax.random.key(0), (300, 3), minval=0.3, maxval=0.7)
    ignorant = lambda x: jnp.asarray(MIDDLE) + 0.0 * x[0]  # noqa: E731
    targets = bent(jnp.array([[0.42, 0.6, 0.5], [0.6, 0.4, 0.45]]))
    alone = np.array(correct(ignorant, bent, targets, 2).errors)
    helped = np.array(correct(ignorant, bent, targets, 2, memory=Memory(q, bent(q))).errors)
    np.testing.assert_allclose(alone, np.broadcast_to(alone[0], alone.shape), atol=1e-6)
    np.testing.assert_allclose(helped[0], alone[0], atol=1e-6)
    assert np.all(helped[2] < 2e-3)


unit = st.floats(-1, 1, width=32)


@given(st.lists(unit, min_size=5, max_size=5))
def test_broyden_s_update_explains_the_last_movement(numbers: list[float]) -> None:
    """H dx = dq after the update, or, where the movement says nothing of use, H as it was."""
    dq, dx = jnp.array(numbers[:3]), jnp.array(numbers[3:])
    before = jnp.asarray(INVERSE)
    after = jax.jit(_broyden)(before, dq, dx)
    explained = bool(jnp.allclose(after @ dx, dq, atol=1e-3))
    assert explained or bool(jnp.all(after == before))
    along = float(dq @ before @ dx)
    if along > 0.01:
        assert explained


def test_a_negative_number_of_looks_is_refused() -> None:
    with pytest.raises(BadInput, match="give 0"):
        correct(rough, bent, TARGETS, -1)
