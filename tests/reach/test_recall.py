"""Remembered movements: what is answered near them, and on arms whose answers are known."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from toddle.failures import BadInput
from toddle.reach.learn.recall import Movements, Recall

SLOPE = np.array([[0.5, 0.2, 0.3], [-0.1, 0.6, 0.4]], np.float32)


def linear_arm(q: jax.Array) -> jax.Array:
    """An arm whose tip follows its joints linearly."""
    return jnp.asarray(SLOPE) @ q


@eqx.filter_jit
def remembered(learner: Recall, q: jax.Array) -> Movements:
    """The state after these movements of the linear arm."""
    state = learner.init(jax.random.key(0), linear_arm(q[0]), q[0])
    step = lambda state, q: (learner.update(state, linear_arm(q), q, jnp.float32(0.0)), None)  # noqa: E731
    return jax.lax.scan(step, state, q[1:])[0]


LEARNER = Recall(capacity=200, neighbours=30)
POSTURES = jax.random.uniform(jax.random.key(1), (150, 3))
STATE = remembered(LEARNER, POSTURES)
predict = jax.jit(lambda state, x: LEARNER.predict(state, x))


def test_a_remembered_position_is_answered_with_its_posture() -> None:
    for q in POSTURES[::30]:
        np.testing.assert_allclose(predict(STATE, linear_arm(q)), q, atol=1e-5)


def test_between_movements_the_slope_leads_on_by_the_smallest_step() -> None:
    """On a linear arm the pseudoinverse is the answer, but for ridge and damping."""
    for k in range(20):
        q = POSTURES[k] * 0.5 + 0.25
        x = linear_arm(q)
        reached = jax.vmap(linear_arm)(POSTURES)
        near = int(jnp.argmin(jnp.sum((reached - x[None]) ** 2, axis=1)))
        expected = np.array(POSTURES[near]) + np.linalg.pinv(SLOPE) @ np.array(x - reached[near])
        if np.all((expected > 0) & (expected < 1)):
            np.testing.assert_allclose(predict(STATE, x), expected, atol=5e-3)
        before, after = jnp.linalg.norm(x - reached[near]), jnp.linalg.norm(x - linear_arm(predict(STATE, x)))
        assert float(after) < 0.1 * float(before) + 1e-4


def test_a_joint_at_its_limit_is_held_and_the_others_reach_on() -> None:
    q = POSTURES.at[:, 2].set(1.0).at[0].set(jnp.array([0.5, 0.5, 1.0]))
    spread = jnp.concatenate([q[:1], 0.4 + 0.2 * POSTURES[:60]])  # the slope of the third joint is known as well
    state = remembered(LEARNER, spread)
    x = linear_arm(q[0]) + jnp.array([0.02, 0.03])
    answer = predict(state, x)
    assert float(answer[2]) <= 1.0
    np.testing.assert_allclose(linear_arm(answer), x, atol=2e-3)


def test_answers_keep_the_limits_and_stay_near_what_was_tried() -> None:
    for x in ([5.0, 5.0], [-3.0, 0.2], [0.4, 0.4]):
        answer = np.array(predict(STATE, jnp.array(x)))
        assert np.all((answer >= -1e-6) & (answer <= 1 + 1e-6))
        assert np.abs(answer - np.array(POSTURES)).max(axis=1).min() <= LEARNER.largest + 1e-5


def test_the_oldest_movements_make_room() -> None:
    small = Recall(capacity=40, neighbours=10)
    state = remembered(small, POSTURES)
    assert int(state.seen) == 150
    kept = {tuple(row) for row in np.array(state.q).tolist()}
    assert kept == {tuple(row) for row in np.array(POSTURES[-40:]).tolist()}


def test_with_home_alone_it_answers_home() -> None:
    home = jnp.array([0.2, 0.4, 0.6])
    state = LEARNER.init(jax.random.key(0), linear_arm(home), home)
    np.testing.assert_allclose(predict(state, jnp.array([0.9, 0.9])), home, atol=1e-6)


@pytest.mark.parametrize(("capacity", "neighbours"), [(10, 10), (10, 1), (1, 0)])
def test_a_memory_that_is_too_small_is_refused(capacity: int, neighbours: int) -> None:
    with pytest.raises(BadInput, match="keep more movements than neighbours"):
        Recall(capacity, neighbours)
