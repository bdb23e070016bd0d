"""Advantages against the sum of equation 2.128, written out in plain Python."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from toddle.navigate.ppo.advantage import advantages

SHARE = st.floats(0, 1, width=32)
STEPS, ACTORS = 7, 3
estimated = jax.jit(advantages)


def one_by_one(rewards, values, after, terminated, truncated, gamma: float, lambda_: float) -> list[float]:
    """For one actor: at each step the errors ahead of it, summed up to the episode's end."""
    errors = [
        reward + (0.0 if end else gamma * later) - now
        for reward, now, later, end in zip(rewards, values, after, terminated, strict=True)
    ]
    found = []
    for first in range(len(errors)):
        total, weight = 0.0, 1.0
        for step in range(first, len(errors)):
            total += weight * errors[step]
            weight *= gamma * lambda_
            if terminated[step] or truncated[step]:
                break
        found.append(total)
    return found


@given(seed=st.integers(0, 2**31), ends=st.floats(0, 0.8), gamma=SHARE, lambda_=SHARE)
def test_same_as_the_sum_written_out(seed: int, ends: float, gamma: float, lambda_: float):
    drawn = np.random.default_rng(seed)
    numbers = drawn.normal(size=(3, STEPS, ACTORS)).astype(np.float32) * 10
    cuts = drawn.random((2, STEPS, ACTORS)) < ends
    rewards, values, after = map(jnp.asarray, numbers)
    terminated, truncated = map(jnp.asarray, cuts)
    found = estimated(rewards, values, after, terminated, truncated, jnp.float32(gamma), jnp.float32(lambda_))
    for actor in range(ACTORS):
        known = one_by_one(*numbers[:, :, actor].astype(float), *cuts[:, :, actor], gamma=gamma, lambda_=lambda_)
        np.testing.assert_allclose(found[:, actor], known, rtol=1e-4, atol=1e-4)


def test_value_target_with_lambda_1_is_the_discounted_return():
    """Targets are advantages and values: rewards 1, 2, 3, then cut off where 10 would follow, or ended."""
    rewards, values = jnp.array([[1.0], [2.0], [3.0]]), jnp.array([[5.0], [-7.0], [0.3]])
    after = jnp.array([[-7.0], [0.3], [10.0]])
    last, never = jnp.array([[False], [False], [True]]), jnp.zeros((3, 1), bool)
    cut = estimated(rewards, values, after, never, last, 0.5, 1.0) + values
    np.testing.assert_allclose(cut[:, 0], [1 + 0.5 * (2 + 0.5 * (3 + 5)), 2 + 0.5 * 8, 8], rtol=1e-6)
    ended = estimated(rewards, values, after, last, never, 0.5, 1.0) + values
    np.testing.assert_allclose(ended[:, 0], [1 + 0.5 * (2 + 0.5 * 3), 2 + 0.5 * 3, 3], rtol=1e-6)
