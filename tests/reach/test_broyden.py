"""Looking and correcting: against arithmetic, and against its twin that runs under JAX."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from toddle.reach.solve.broyden import looked_for, mended
from toddle.reach.solve.correction import correct


@given(st.integers(0, 1000))
def test_a_mended_slope_explains_the_movement(seed: int):
    drawn = np.random.default_rng(seed)
    slope, dq, dx = drawn.normal(size=(4, 5, 3)), drawn.normal(size=(4, 5)), drawn.normal(size=(4, 3))
    after = mended(slope, dq, dx)
    size = np.einsum("pj,pjs,ps->p", dq, slope, dx)
    along = np.linalg.norm(np.einsum("pj,pjs->ps", dq, slope), axis=1) * np.linalg.norm(dx, axis=1)
    for k in range(4):
        if size[k] > 0.01 * along[k]:
            np.testing.assert_allclose(after[k] @ dx[k], dq[k], atol=1e-8)
        elif size[k] <= 0:
            np.testing.assert_array_equal(after[k], slope[k])


def test_a_straight_body_is_reached_with_one_look():
    drawn = np.random.default_rng(0)
    matrix = drawn.normal(size=(2, 4))
    inverse = np.tile(np.linalg.pinv(matrix), (3, 1, 1))
    q = np.full((3, 4), 0.5)
    targets = q @ matrix.T + 0.01 * drawn.normal(size=(3, 2))
    best, errors = looked_for(lambda q: q @ matrix.T, targets, q, inverse, 1)
    np.testing.assert_allclose(best @ matrix.T, targets, atol=1e-12)
    assert errors.shape == (2, 3)
    assert np.all(errors[0] > 1e-4)


def test_it_is_the_twin_of_the_correction_under_jax():
    drawn = np.random.default_rng(1)
    answers = jnp.asarray(drawn.normal(size=(3, 2)) * 0.3, jnp.float32)
    predict = lambda x: 0.5 + jnp.tanh(answers @ x)  # noqa: E731
    see = lambda q: np.stack([np.sin(q[:, 0]) + q[:, 1], q[:, 2] - q[:, 0] * q[:, 1]], axis=1)  # noqa: E731
    targets = drawn.uniform(-0.2, 0.6, (8, 2))
    expected = correct(
        predict, lambda q: jnp.asarray(see(np.asarray(q)), jnp.float32), jnp.asarray(targets, jnp.float32), 4
    )
    flat = np.asarray(answers, float)
    inner = np.tanh(targets @ flat.T)
    begin = np.clip(0.5 + inner, 0, 1)
    best, errors = looked_for(see, targets, begin, (1 - inner**2)[:, :, None] * flat, 4)
    np.testing.assert_allclose(errors, np.asarray(expected.errors), atol=2e-4)
    assert np.all(np.diff(errors, axis=0) <= 0)
    assert np.all((best >= 0) & (best <= 1))
    assert np.all(np.linalg.norm(see(best) - targets, axis=1) == errors[-1])
