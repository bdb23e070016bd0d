"""The pendulum's closed forms, against its differential equation integrated step by step."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from toddle.walk.balance.pendulum import advance, offset, ramp, timing

OMEGA = st.floats(3.0, 6.0)
TIME = st.floats(0.3, 0.8)
PART = st.floats(0.05, 0.9)
PLACE = st.floats(-0.4, 0.4)
PAIR = st.tuples(PLACE, PLACE)


def divergent(omega: float, xi: np.ndarray, start: np.ndarray, end: np.ndarray, seconds: float) -> np.ndarray:
    """The DCM later, xi' = omega (xi - p), while the ZMP p goes from start to end in a straight line."""
    if seconds <= 0:
        return xi
    found = solve_ivp(
        lambda t, x: omega * (x - start - (end - start) * t / seconds), (0, seconds), xi, rtol=1e-10, atol=1e-12
    )
    return found.y[:, -1]


@given(OMEGA, TIME, PART, st.lists(PAIR, min_size=1, max_size=3))
def test_steps_that_start_with_the_offset_end_at_rest_over_the_last_foot(
    omega: float, step_time: float, part: float, displacements: list[tuple[float, float]]
) -> None:
    over = part * step_time
    foot = np.array([0.3, -0.2])
    xi = foot + offset(timing(omega, step_time, over), displacements)
    for moved in displacements:
        xi = divergent(omega, xi, foot, foot + moved, over)
        foot = foot + moved
        xi = divergent(omega, xi, foot, foot, step_time - over)
    np.testing.assert_allclose(xi, foot, atol=1e-5)


@given(OMEGA, PAIR, PAIR, st.floats(0.05, 0.4), st.floats(0, 1))
def test_the_ramp_stands_for_the_double_support_that_is_left(
    omega: float, xi: tuple[float, float], came: tuple[float, float], whole: float, share: float
) -> None:
    remaining, foot = share * whole, np.zeros(2)
    now = foot - np.array(came) * share
    with_it = divergent(omega, np.array(xi), now, foot, remaining)
    short = ramp(omega, came, remaining, whole)
    without = divergent(omega, np.array(xi) - short, foot, foot, remaining)
    np.testing.assert_allclose(with_it, without, atol=1e-7)


@given(OMEGA, PLACE, st.floats(-1, 1), PLACE, st.floats(0, 0.5))
def test_it_advances_as_its_equation_does(omega: float, x: float, v: float, zmp: float, dt: float) -> None:
    found = solve_ivp(lambda t, s: [s[1], omega**2 * (s[0] - zmp)], (0, dt), [x, v], rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(advance(omega, x, v, zmp, dt), found.y[:, -1], atol=1e-7)


@given(OMEGA, TIME)
def test_no_double_support_is_the_limit_of_a_short_one(omega: float, step_time: float) -> None:
    none, short = timing(omega, step_time, 0.0), timing(omega, step_time, 1e-6)
    assert none.growth == short.growth == math.exp(omega * step_time)
    assert none.k == pytest.approx(short.k, rel=1e-4)
    assert ramp(omega, (0.1, 0.1), 0.0, 0.1) == ramp(omega, (0.1, 0.1), 0.1, 0.0) == (0.0, 0.0)
