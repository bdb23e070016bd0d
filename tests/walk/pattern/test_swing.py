"""The swing's polynomials: their ends, their derivatives, and the printed linear systems 2.98 and 2.108."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.walk.pattern.swing import evaluate, quartic, quintic

number = st.floats(-1, 1)
duration = st.floats(0.1, 2)


@given(st.lists(number, min_size=12, max_size=12), duration)
def test_a_quintic_meets_both_ends(numbers: list[float], d: float) -> None:
    start, goal = np.array(numbers[:9]).reshape(3, 3), np.array(numbers[9:])
    path = quintic(start, goal, d)
    np.testing.assert_allclose(evaluate(path, 0.0), start, atol=1e-12)
    np.testing.assert_allclose(evaluate(path, d), [goal, np.zeros(3), np.zeros(3)], atol=1e-9 / d**2)


@given(st.lists(number, min_size=4, max_size=4), duration)
def test_a_quartic_meets_start_apex_and_landing(numbers: list[float], d: float) -> None:
    height, rate, apex, landing = numbers
    path = quartic(height, rate, apex, landing, d)
    assert evaluate(path, 0.0)[:2, 0] == pytest.approx([height, rate], abs=1e-12)
    assert evaluate(path, d / 2)[0, 0] == pytest.approx(apex, abs=1e-10)
    assert evaluate(path, d)[:2, 0] == pytest.approx([landing, 0.0], abs=1e-9)


def test_the_printed_systems_have_the_same_coefficients() -> None:
    d, rng = 0.7, np.random.default_rng(1)
    powers = d ** np.arange(6)
    first, second = np.arange(6) * np.append(0, powers[:5]), np.array([0, 0, 2, 6 * d, 12 * d**2, 20 * d**3])
    system = np.stack([np.eye(6)[0], np.eye(6)[1], 2 * np.eye(6)[2], powers, first, second])
    ends = rng.normal(size=6) * [1, 1, 1, 1, 0, 0]
    path = quintic(ends[:3, None], ends[3:4], d)
    np.testing.assert_allclose(path[:, 0], np.linalg.solve(system, ends), rtol=1e-9)
    high = np.stack([np.eye(5)[0], np.eye(5)[1], (d / 2) ** np.arange(5), powers[:5], first[:5]])
    ends = np.append(rng.normal(size=4), 0.0)
    path = quartic(ends[0], ends[1], ends[2], ends[3], d)
    np.testing.assert_allclose(path[:, 0], np.linalg.solve(high, ends), rtol=1e-9)


@given(st.lists(number, min_size=12, max_size=12), st.floats(0.1, 0.9))
def test_velocity_and_acceleration_are_the_derivatives(numbers: list[float], t: float) -> None:
    path, step = np.array(numbers).reshape(6, 2), 1e-5
    before, after, now = evaluate(path, t - step), evaluate(path, t + step), evaluate(path, t)
    np.testing.assert_allclose((after[:2] - before[:2]) / (2 * step), now[1:], atol=1e-7)


@given(st.lists(number, min_size=12, max_size=12), st.floats(0.05, 0.9))
def test_fitting_anew_from_where_the_sole_is_changes_nothing(numbers: list[float], part: float) -> None:
    start, goal = np.array(numbers[:9]).reshape(3, 3), np.array(numbers[9:])
    path = quintic(start, goal, 1.0)
    again = quintic(evaluate(path, part), goal, 1.0 - part)
    halfway = (1.0 - part) / 2
    np.testing.assert_allclose(evaluate(again, halfway)[0], evaluate(path, part + halfway)[0], atol=1e-9)
