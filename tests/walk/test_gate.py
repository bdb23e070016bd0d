"""The safety gate: whatever is asked, what comes out is finite, within the range, and never jumps."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.signals import STILL, Velocity
from toddle.walk.gate import ACCELERATION, SILENCE, TURNING, gate

FASTEST = Velocity(0.3, 0.1, 0.3)
DT = 0.01

anything = st.builds(Velocity, *[st.floats(allow_nan=True, allow_infinity=True)] * 3)
within = st.builds(Velocity, *(st.floats(-most, most) for most in FASTEST))


@given(last=within, asked=anything, silence=st.floats(0, 2), limited=st.booleans())
def test_what_comes_out_is_safe(last: Velocity, asked: Velocity, silence: float, limited: bool) -> None:
    out = gate(last, asked, FASTEST, DT, silence=silence, limited=limited)
    assert all(math.isfinite(part) and abs(part) <= most + 1e-12 for part, most in zip(out, FASTEST, strict=True))
    if limited:
        for part, before, rate in zip(out, last, (ACCELERATION, ACCELERATION, TURNING), strict=True):
            assert abs(part - before) <= rate * DT + 1e-12


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(3))
def test_a_number_that_is_not_finite_asks_to_stand(bad: float, place: int) -> None:
    asked = [0.1, 0.05, 0.1]
    asked[place] = bad
    assert gate(STILL, Velocity(*asked), FASTEST, DT, limited=False) == STILL


def test_a_steady_command_is_reached_in_the_time_that_the_limits_give() -> None:
    velocity, ticks = STILL, 0
    while velocity != Velocity(0.3, 0.0, 0.3):
        velocity, ticks = gate(velocity, Velocity(0.3, 0.0, 0.3), FASTEST, DT), ticks + 1
        assert ticks < 1000
    assert ticks * DT == pytest.approx(0.3 / ACCELERATION, abs=1.5 * DT)


def test_ahead_and_aside_share_an_ellipse_and_backwards_is_slower() -> None:
    both = gate(STILL, Velocity(0.3, 0.1, 0.3), FASTEST, DT, limited=False)
    assert both == pytest.approx((0.3 / 2**0.5, 0.1 / 2**0.5, 0.3))
    assert gate(STILL, Velocity(-1.0, 0.0, 0.0), FASTEST, DT, limited=False).vx == pytest.approx(-0.4 * FASTEST.vx)


def test_what_is_within_passes_unchanged() -> None:
    asked = Velocity(0.2, -0.05, 0.1)
    assert gate(STILL, asked, FASTEST, DT, limited=False) == asked
    assert gate(asked, asked, FASTEST, DT) == asked


def test_silence_stops_the_robot() -> None:
    asked = Velocity(0.3, 0.0, 0.0)
    assert gate(asked, asked, FASTEST, DT, silence=SILENCE) == asked
    assert gate(asked, asked, FASTEST, DT, silence=SILENCE + 0.01).vx < asked.vx
