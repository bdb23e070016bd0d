"""The robot without legs obeys the walker's own safety gate and moves on arcs."""

from __future__ import annotations

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.failures import BadInput
from toddle.navigate.tasks.unicycle import Rolling, unicycle
from toddle.signals import Velocity
from toddle.walk.gate import ACCELERATION, BACKWARDS, TURNING, gate

NOTHING = jnp.zeros((0, 3))
some = st.floats(-1.0, 1.0, width=32)
WALKS = unicycle((0.3, 0.1, 0.3), backwards=BACKWARDS, acceleration=ACCELERATION, turning=TURNING)
ADVANCE = jax.jit(WALKS.advance)


@given(last=st.tuples(some, some, some), asked=st.tuples(some, some, some), odd=st.booleans())
def test_it_lets_through_what_the_walkers_gate_does(
    last: tuple[float, float, float], asked: tuple[float, float, float], odd: bool
) -> None:
    asked = (math.nan, *asked[1:]) if odd else asked
    state = Rolling(jnp.zeros(3), jnp.array(last, jnp.float32), jnp.zeros(3))
    velocity = WALKS.velocity(ADVANCE(state, jnp.array(asked, jnp.float32), NOTHING))
    expected = gate(Velocity(*last), Velocity(*asked), Velocity(*WALKS.fastest), WALKS.seconds)
    np.testing.assert_allclose(velocity, expected, atol=1e-6)


def test_a_constant_velocity_leads_around_a_circle() -> None:
    walks = unicycle((0.3, 0.1, 0.3), lag=0.0, acceleration=100.0, turning=100.0)
    state, places = walks.start(), []
    advance = jax.jit(walks.advance)
    for _ in range(round(2 * math.pi / 0.3 / 0.1)):
        state = advance(state, jnp.array([0.3, 0.0, 0.3]), NOTHING)
        places.append(np.asarray(walks.place(state)))
    away = np.hypot(np.array(places)[:, 0], np.array(places)[:, 1] - 1.0)
    np.testing.assert_allclose(away, 1.0, atol=2e-4)
    np.testing.assert_allclose(places[-1][:2], 0.0, atol=0.03)


def test_its_own_velocity_follows_with_the_lag() -> None:
    walks = unicycle(acceleration=100.0, lag=0.4)
    state = walks.start()
    for _ in range(4):
        state = walks.advance(state, jnp.array([0.3, 0.0, 0.0]), NOTHING)
    np.testing.assert_allclose(state.moving[0], 0.3 * (1 - math.exp(-1)), rtol=1e-5)
    np.testing.assert_allclose(walks.velocity(state), [0.3, 0.0, 0.0], rtol=1e-6)


def test_aside_is_to_the_left() -> None:
    state = WALKS.start()._replace(place=jnp.array([0.0, 0.0, math.pi / 2]))
    for _ in range(20):
        state = ADVANCE(state, jnp.array([0.0, 0.1, 0.0]), NOTHING)
    x, y, yaw = WALKS.place(state).tolist()
    assert x < -0.1
    assert abs(y) < 1e-5
    assert yaw == pytest.approx(math.pi / 2)


@pytest.mark.parametrize(
    "wrong", [{"seconds": 0.0}, {"fastest": (0.3, 0.0, 0.3)}, {"lag": -1.0}, {"turning": math.nan}]
)
def test_numbers_that_are_no_use_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(BadInput, match="unicycle, " + next(iter(wrong))):
        unicycle(**wrong)  # type: ignore[arg-type]
