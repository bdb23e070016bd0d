"""The interior point against active sets (DAQP, quadprog) and the optimality conditions, in both precisions."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import quadprog
from hypothesis import given
from hypothesis import strategies as st

from toddle.walk.pattern.interior_point import interior_point, inverse_of_root
from toddle.walk.pattern.plan import Status
from toddle.walk.pattern.quadratic import least_distance

ROWS, UNKNOWNS = 24, 9
NOTHING = 1e30


def random_problem(seed: int, soft: int = 8):
    """Hard rows around a point that keeps them, soft rows anywhere; some of one side only, some without any."""
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(ROWS, UNKNOWNS)) * 10.0 ** rng.uniform(-2, 1, (ROWS, 1))
    size = np.linalg.norm(matrix, axis=1)
    kept = matrix @ rng.normal(size=UNKNOWNS) * 3
    low, high = kept - size * rng.uniform(0, 2, ROWS), kept + size * rng.uniform(0, 2, ROWS)
    low[-soft:] += size[-soft:] * rng.normal(size=soft) * 2
    high = np.maximum(high, low + 0.1 * size)
    low[rng.random(ROWS) < 0.3], high[rng.random(ROWS) < 0.3] = -NOTHING, NOTHING
    slack = np.where(np.arange(ROWS) < ROWS - soft, 0.0, 1e-6 * size**2)
    return matrix, low, high, slack


def solved(problem, dtype: type[np.floating] = np.float64, iterations: int = 12):
    with jax.enable_x64(dtype == np.float64):
        return jax.tree.map(np.asarray, interior_point(*(jnp.asarray(part, dtype) for part in problem), iterations))


def by_daqp(problem):
    matrix, low, high, slack = problem
    soft = slack > 0
    found = least_distance(
        matrix, low, high, np.where(soft, 8, 0).astype(np.int32), np.where(soft, slack, 1.0)
    )  # fmt: skip
    assert found.status == Status.SOLVED
    return found.u


@given(st.integers(0, 10_000))
def test_as_the_active_sets_find_it(seed):
    problem = random_problem(seed)
    wanted = by_daqp(problem)
    np.testing.assert_allclose(solved(problem, iterations=20).u, wanted, atol=1e-5 * (1 + np.abs(wanted).max()))
    np.testing.assert_allclose(solved(problem).u, wanted, atol=1e-3 * (1 + np.abs(wanted).max()))


@given(st.integers(0, 10_000))
def test_in_single_precision(seed):
    problem = random_problem(seed)
    wanted = by_daqp(problem)
    np.testing.assert_allclose(solved(problem, np.float32).u, wanted, atol=5e-3 * (1 + np.abs(wanted).max()))


@pytest.mark.parametrize("seed", range(5))
def test_a_quadratic_programme_in_general_comes_by_its_factor(seed):
    # min x'Hx/2 + g'x is |u|^2/2 for u = L'x + L^-1 g
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(UNKNOWNS, UNKNOWNS)) + 3 * np.eye(UNKNOWNS)
    hessian, gradient = root @ root.T, rng.normal(size=UNKNOWNS) * 5
    matrix, low, high, _ = random_problem(seed, soft=1)
    rows = np.vstack([matrix[low > -1e29], -matrix[high < 1e29]])
    bounds = np.concatenate([low[low > -1e29], -high[high < 1e29]])
    try:
        wanted = quadprog.solve_qp(hessian, -gradient, rows.T, bounds)[0]
    except ValueError:
        pytest.skip("the random rows exclude each other")
    lower = np.linalg.cholesky(hessian)
    moved = np.linalg.solve(lower, gradient)
    turned = np.linalg.solve(lower, matrix.T).T
    least = (turned, low + turned @ moved, high + turned @ moved, np.zeros(ROWS))
    found = np.linalg.solve(lower.T, solved(least, iterations=20).u - moved)
    np.testing.assert_allclose(found, wanted, atol=1e-5 * (1 + np.abs(wanted).max()))


def test_the_nearest_point_of_a_half_plane():
    # min |u| with 3 u0 + 4 u1 >= 10: along the normal (3, 4) / 5, 2 away
    found = solved((np.array([[3.0, 4.0]]), np.array([10.0]), np.array([NOTHING]), np.zeros(1)))
    np.testing.assert_allclose(found.u, [1.2, 1.6], atol=1e-6)


def test_a_soft_row_gives_way_by_its_multiplier():
    # min u^2 / 2 + e^2 / (2 s) with u + e = 1: u = 1 / (1 + s)
    found = solved((np.ones((1, 1)), np.ones(1), np.full(1, NOTHING), np.full(1, 0.25)))
    np.testing.assert_allclose(found.u, [0.8], atol=1e-7)


def test_rows_that_are_kept_at_zero_leave_it_there():
    found = solved((np.eye(3), -np.ones(3), np.ones(3), np.zeros(3)))
    np.testing.assert_allclose(found.u, 0.0, atol=1e-6)


def test_rows_of_zeros_and_rows_without_bounds_say_nothing():
    matrix, low, high, slack = random_problem(3)
    more = np.vstack([matrix, np.zeros((2, UNKNOWNS)), np.ones((2, UNKNOWNS))])
    nothing = np.array([1.0, -1.0, -NOTHING, -NOTHING])
    wider = (more, np.r_[low, nothing], np.r_[high, -1.0, 1.0, NOTHING, NOTHING], np.r_[slack, np.zeros(4)])
    np.testing.assert_allclose(
        solved(wider, iterations=20).u, solved((matrix, low, high, slack), iterations=20).u, atol=1e-7
    )


def test_hard_rows_that_exclude_each_other_end_in_finite_numbers():
    found = solved((np.array([[1.0], [1.0]]), np.array([1.0, -NOTHING]), np.array([NOTHING, -1.0]), np.zeros(2)))
    assert np.isfinite(found.u).all()
    assert found.residual > 1e-3 or abs(found.u[0]) < 0.5


@pytest.mark.parametrize("n", [1, 2, 3, 5, 8, 13, 41])
def test_the_inverse_of_the_root(n):
    a = np.random.default_rng(n).normal(size=(n, n + 2))
    h = a @ a.T
    with jax.enable_x64(True):
        inverse = np.asarray(inverse_of_root(jnp.asarray(h)))
    np.testing.assert_allclose(inverse @ h @ inverse.T, np.eye(n), atol=1e-8)
    np.testing.assert_array_equal(inverse, np.tril(inverse))
