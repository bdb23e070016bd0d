"""The active set against a second solver, and by the conditions that an optimum fulfils."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from toddle.walk.posture.box_step import box_step


def problem(seed: int, n: int, shut: float, damping: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Damped rows and a box that is shut at zero for some, so that many bounds hold from the first."""
    rng = np.random.default_rng(seed)
    a = np.vstack((rng.normal(size=(n, n)), np.sqrt(damping) * np.eye(n)))
    b = np.concatenate((rng.normal(size=n), np.zeros(n)))
    lower, upper = -rng.uniform(0, 0.3, n), rng.uniform(0, 0.3, n)
    lower[rng.uniform(size=n) < shut] = 0.0
    upper[rng.uniform(size=n) < shut] = 0.0
    return a, b, lower, upper


@given(st.integers(0, 10**6), st.integers(1, 21), st.floats(0, 1), st.sampled_from([1e-6, 1e-3, 1.0]))
def test_no_bound_is_crossed_and_no_better_step_is_left(seed: int, n: int, shut: float, damping: float) -> None:
    a, b, lower, upper = problem(seed, n, shut, damping)
    hessian, gradient = a.T @ a, a.T @ b
    d, _ = box_step(hessian, gradient, lower, upper)
    assert np.all((d >= lower) & (d <= upper))
    slope = gradient - hessian @ d
    tolerance = 1e-8 * max(1.0, float(np.abs(gradient).max()))
    assert np.all((slope <= tolerance) | (d >= upper - 1e-12)), "a step up is left"
    assert np.all((slope >= -tolerance) | (d <= lower + 1e-12)), "a step down is left"


@pytest.mark.parametrize("seed", range(20))
def test_the_step_is_scipys(seed: int) -> None:
    a, b, lower, upper = problem(seed, 21, 0.2, 1e-2)
    upper = np.maximum(upper, lower + 1e-6)  # scipy wants a box with an inside
    d, held = box_step(a.T @ a, a.T @ b, lower, upper)
    expected = lsq_linear(a, b, (lower, upper), method="bvls", tol=1e-14).x
    np.testing.assert_allclose(d, expected, atol=1e-8)
    assert np.array_equal(held == 1, d == upper)
    assert np.array_equal(held == -1, d == lower)


def test_without_bounds_it_is_the_damped_least_squares_step() -> None:
    a, b, _, _ = problem(3, 21, 0.0, 1e-2)
    far = np.full(21, 1e3)
    d, held = box_step(a.T @ a, a.T @ b, -far, far)
    np.testing.assert_allclose(d, np.linalg.lstsq(a, b, rcond=None)[0], atol=1e-10)
    assert not held.any()
