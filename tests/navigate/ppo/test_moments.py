"""Running moments against NumPy over all rows at once."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from toddle.navigate.ppo.moments import unseen


@given(seed=st.integers(0, 2**31), sizes=st.lists(st.sampled_from([1, 7, 40]), min_size=1, max_size=6))
def test_moments_of_chunks_are_those_of_all(seed: int, sizes: list[int]):
    drawn = np.random.default_rng(seed)
    chunks = [drawn.normal(drawn.normal(0, 3), 2, (size, 3)).astype(np.float32) for size in sizes]
    moments = unseen(3)
    for chunk in chunks:
        moments = moments.seen(jnp.asarray(chunk))
    rows = np.concatenate(chunks).astype(float)
    # what they start from counts as a ten-thousandth of a row
    np.testing.assert_allclose(moments.mean, rows.mean(axis=0), rtol=1e-3, atol=2e-3)
    np.testing.assert_allclose(moments.variance, rows.var(axis=0), rtol=1e-2, atol=2e-2)


def test_normalised_rows_have_mean_0_and_deviation_1():
    rows = jnp.asarray(np.random.default_rng(0).normal(50, 7, (500, 2)), jnp.float32)
    found = np.asarray(unseen(2).seen(rows).normalised(rows))
    np.testing.assert_allclose(found.mean(axis=0), 0, atol=1e-2)
    np.testing.assert_allclose(found.std(axis=0), 1, atol=1e-2)


def test_far_away_is_cut():
    assert float(unseen(1).normalised(jnp.array([1e6]))[0]) == 10


def test_unseen_changes_nothing():
    np.testing.assert_allclose(unseen(2).normalised(jnp.array([0.25, -3.0])), [0.25, -3.0])
