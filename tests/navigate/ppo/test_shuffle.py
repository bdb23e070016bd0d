"""Shuffling: every number once, every order equally often, not twice the same."""

from __future__ import annotations

from math import factorial

import jax
import numpy as np
import pytest

from toddle.navigate.ppo.shuffle import shuffled


@pytest.mark.parametrize("count", [1, 2, 3, 500, 512, 513, 2**16, 2**16 + 1])
def test_every_number_is_there_once(count: int) -> None:
    order = np.asarray(shuffled(jax.random.key(count), count))
    assert order.dtype == np.int32
    np.testing.assert_array_equal(np.sort(order), np.arange(count))


def test_every_order_is_equally_likely() -> None:
    drawn = 12_000
    orders = np.asarray(jax.vmap(lambda key: shuffled(key, 5))(jax.random.split(jax.random.key(0), drawn)))
    _, counts = np.unique(orders, axis=0, return_counts=True)
    assert len(counts) == factorial(5)
    expected = drawn / factorial(5)
    # chi-square of 119 degrees of freedom: mean 119, deviation sqrt(2 x 119) = 15.4
    assert 119 - 5 * 15.4 < ((counts - expected) ** 2 / expected).sum() < 119 + 5 * 15.4


def test_far_and_near_are_torn_apart() -> None:
    order = np.asarray(shuffled(jax.random.key(1), 2**16))
    assert abs(np.corrcoef(order, np.arange(2**16))[0, 1]) < 5 / 2**8
    assert (np.diff(order) == 1).sum() < 10
    assert not np.array_equal(order, shuffled(jax.random.key(2), 2**16))
