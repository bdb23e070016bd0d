"""Least-distance problems: known answers, a second solver, and what must not be used."""

from __future__ import annotations

import numpy as np
import pytest
import quadprog

from toddle.walk.pattern.plan import Status
from toddle.walk.pattern.quadratic import least_distance

NOTHING = 1e30


def problem(rows, low, high, soft=(), slack=1e-6):
    marks = np.zeros(len(rows), np.int32)
    marks[list(soft)] = 8
    return np.array(rows, float), np.array(low, float), np.array(high, float), marks, np.full(len(rows), slack)


def test_the_nearest_point_of_a_half_plane():
    # min |u| with 3 u0 + 4 u1 >= 10: along the normal (3, 4) / 5, 2 away
    found = least_distance(*problem([[3.0, 4.0]], [10.0], [NOTHING]))
    assert found.status == Status.SOLVED
    np.testing.assert_allclose(found.u, [1.2, 1.6], atol=1e-9)


def test_a_soft_row_gives_way_by_its_own_weight():
    # min u^2 / 2 + (10 - 10 u)^2 / (2 * 0.5): u + 20 (10 u - 10) = 0
    found = least_distance(*problem([[10.0]], [10.0], [NOTHING], soft=[0], slack=0.5))
    np.testing.assert_allclose(found.u, [200 / 201], atol=1e-9)


def test_hard_rows_that_contradict_each_other_are_infeasible():
    assert least_distance(*problem([[1.0], [1.0]], [1.0, -NOTHING], [NOTHING, -1.0])).status == Status.INFEASIBLE


def test_bounds_the_wrong_way_round_are_infeasible():
    assert least_distance(*problem([[1.0, 0.0]], [1.0], [0.0])).status == Status.INFEASIBLE


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_not_finite_never_come_back_as_solved(bad):
    found = least_distance(*problem([[bad, 1.0], [1.0, 0.0]], [1.0, -1.0], [2.0, 1.0]))
    assert found.status != Status.SOLVED or np.isfinite(found.u).all()


def test_a_solve_that_takes_too_long_is_late():
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(400, 60))
    low = np.abs(rng.normal(size=400))
    assert least_distance(*problem(rows, low, np.full(400, NOTHING), soft=range(400)), 1e-6).status == Status.LATE


@pytest.mark.parametrize("seed", range(20))
def test_a_second_solver_agrees(seed):
    rng = np.random.default_rng(seed)
    rows, low = rng.normal(size=(12, 8)), rng.uniform(-1, 0.3, 12)
    soft = range(6, 12)
    given = problem(rows, low, np.full(12, NOTHING), soft, slack=1e-2)
    found = least_distance(*given)
    # the slacks as six more unknowns
    hessian = np.diag(np.concatenate([np.ones(8), np.full(6, 1e2)]))
    wide = np.hstack([rows, np.vstack([np.zeros((6, 6)), np.eye(6)])])
    wanted = quadprog.solve_qp(hessian, np.zeros(14), wide.T, low)[0][:8]
    np.testing.assert_allclose(found.u, wanted, atol=1e-7)


def test_an_answer_does_not_depend_on_the_programmes_before():
    rng = np.random.default_rng(0)
    given = [
        problem(rng.normal(size=(12, 8)), rng.uniform(-1, 0.3, 12), np.full(12, NOTHING), range(6, 12), 10.0**-k)
        for k in range(6)
    ]
    contradiction = problem([[1.0] * 8, [1.0] * 8] * 6, [1.0, -NOTHING] * 6, [NOTHING, -1.0] * 6)
    first = [least_distance(*one).u for one in given]
    assert least_distance(*contradiction).status == Status.INFEASIBLE
    for one, wanted in reversed(list(zip(given, first, strict=True))):
        np.testing.assert_allclose(least_distance(*one).u, wanted, atol=1e-12)
        least_distance(*contradiction)
