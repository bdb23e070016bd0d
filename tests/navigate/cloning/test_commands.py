"""Velocities become levels and come back."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.navigate.cloning.commands import levels, likeliest, mean, shares
from toddle.navigate.cloning.config import CloningConfig

AHEAD, TURNING = levels(CloningConfig())


@given(st.floats(-0.12, 0.3), st.floats(-0.3, 0.3))
def test_a_velocity_comes_back(ahead: float, turning: float) -> None:
    for value, steps in ((ahead, AHEAD), (turning, TURNING)):
        parts = shares(jnp.float32(value), steps)
        assert float(parts.sum()) == pytest.approx(1.0, abs=1e-5)
        assert int((parts > 1e-6).sum()) <= 2
        logits = jnp.log(jnp.maximum(parts, 1e-12))
        assert float(mean(logits, steps)) == pytest.approx(value, abs=1e-5)
        assert float(likeliest(logits, steps)) == pytest.approx(value, abs=1e-5)


def test_standing_is_a_level() -> None:
    assert float(jnp.abs(AHEAD).min()) == 0.0
    assert float(jnp.abs(TURNING).min()) < 1e-7


def test_too_fast_is_the_fastest() -> None:
    assert float(mean(jnp.log(jnp.maximum(shares(jnp.float32(9.0), AHEAD), 1e-12)), AHEAD)) == pytest.approx(0.3)


def test_left_or_right_is_not_straight_on() -> None:
    """Two equal peaks: their mean lies between, the likeliest is one of them."""
    logits = jnp.zeros(len(TURNING)).at[jnp.array([1, 9])].set(jnp.array([10.0, 9.9]))
    assert abs(float(mean(logits, TURNING))) < 0.02
    assert float(likeliest(logits, TURNING)) == pytest.approx(float(TURNING[1]), abs=0.01)
    assert np.isfinite(float(likeliest(logits * 100, TURNING)))
