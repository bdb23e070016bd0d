"""Adam against its algorithm 1, written out in NumPy."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest

from toddle.navigate.ppo.adam import at_rest, moved, shortened


def test_steps_are_those_of_the_paper():
    drawn, rate = np.random.default_rng(0), 0.01
    point, state = {"a": jnp.ones(3), "b": jnp.zeros((2, 2))}, at_rest({"a": jnp.ones(3), "b": jnp.zeros((2, 2))})
    known, first, second = np.ones(3), np.zeros(3), np.zeros(3)
    for step in range(1, 6):
        slope = drawn.normal(size=3)
        point, state = moved(
            point, state, {"a": jnp.asarray(slope, jnp.float32), "b": jnp.zeros((2, 2))}, jnp.float32(rate)
        )
        first, second = 0.9 * first + 0.1 * slope, 0.999 * second + 0.001 * slope**2
        known -= rate * (first / (1 - 0.9**step)) / (np.sqrt(second / (1 - 0.999**step)) + 1e-5)
        np.testing.assert_allclose(point["a"], known, rtol=1e-5)
    np.testing.assert_array_equal(point["b"], np.zeros((2, 2)))


@pytest.mark.parametrize(("longest", "length"), [(1.0, 1.0), (100.0, 5.0)])
def test_long_gradients_are_shortened(longest: float, length: float):
    found, norm = shortened({"a": jnp.array([3.0]), "b": jnp.array([[0.0, 4.0]])}, longest)
    assert float(norm) == pytest.approx(5)
    assert np.hypot(float(found["a"][0]), float(found["b"][0, 1])) == pytest.approx(length, rel=1e-5)
    assert float(found["b"][0, 1]) / float(found["a"][0]) == pytest.approx(4 / 3)
