"""The matrices of the preview against one sample after the other, and that against Taylor's series."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.walk.pattern.time_stepping import advance, time_stepping, zero_moment_point

number = st.floats(-3, 3)
span = st.floats(0, 1)


@given(st.lists(number, min_size=4, max_size=4), span)
def test_a_constant_jerk_is_a_cubic(motion: list[float], t: float) -> None:
    p, v, a, j = motion
    later = advance(np.array([p, v, a]), np.array(j), t)
    cubic = np.polynomial.Polynomial([p, v, a / 2, j / 6])
    assert later == pytest.approx([cubic(t), cubic.deriv()(t), cubic.deriv(2)(t)], abs=1e-12)


@given(st.lists(number, min_size=8, max_size=8), span, span)
def test_two_spans_are_their_sum(motion: list[float], first: float, second: float) -> None:
    state, jerk = np.array(motion[:6]).reshape(2, 3), np.array(motion[6:])
    halfway = advance(advance(state, jerk, first), jerk, second)
    np.testing.assert_allclose(halfway, advance(state, jerk, first + second), atol=1e-12)


@pytest.mark.parametrize(("samples", "sample"), [(16, 0.1), (15, 0.1), (2, 0.4)])
def test_the_preview_is_one_sample_after_the_other(samples: int, sample: float) -> None:
    rng = np.random.default_rng(0)
    m, start, jerks = time_stepping(samples, sample, 0.8), rng.normal(size=3), rng.normal(size=samples)
    state, seen = start, []
    for jerk in jerks:
        state = advance(state, np.array(jerk), sample)
        seen.append([state[0], state[1], zero_moment_point(state[None], 0.8)[0]])
    position, velocity, zmp = np.array(seen).T
    np.testing.assert_allclose(m.position_state @ start + m.position_jerk @ jerks, position, atol=1e-12)
    np.testing.assert_allclose(m.velocity_state @ start + m.velocity_jerk @ jerks, velocity, atol=1e-12)
    np.testing.assert_allclose(m.zmp_state @ start + m.zmp_jerk @ jerks, zmp, atol=1e-12)


def test_a_body_at_rest_presses_below_its_centre() -> None:
    assert zero_moment_point(np.array([[0.3, 0.7, 0.0]]), 0.8) == 0.3
    assert zero_moment_point(np.array([[0.0, 0.0, 9.81]]), 0.8) == pytest.approx([-0.8])
