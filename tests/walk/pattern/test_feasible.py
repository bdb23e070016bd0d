"""The range of commands: what it holds is tracked, what it doesn't is made slower on the same curve."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from walk.gaits import HEICUB, HRP2
from walk.nmpc_cases import ICUB

from toddle.failures import BadInput
from toddle.signals import Velocity
from toddle.walk.pattern.displacement import displacement
from toddle.walk.pattern.feasible import cap, fastest, fits, landing_hull, widening

GAITS = {"icub": ICUB, "hrp2": HRP2, "heicub": HEICUB}
SPEED = st.floats(-2.0, 2.0)


def test_a_box_of_icub_s_size_allows_what_its_edges_give():
    # 0.24 m ahead in 0.6 s; twice vy T wider than 0.14, at most 0.30; 0.4 rad a step
    assert fastest(ICUB) == pytest.approx((0.24 / 0.6, 0.16 / 1.2, 0.4 / 0.6), rel=1e-6)


@pytest.mark.parametrize("name", GAITS)
@given(SPEED, SPEED, SPEED)
def test_a_capped_command_fits_and_keeps_its_curve(name, vx, vy, omega):
    gait, asked = GAITS[name], Velocity(vx, vy, omega)
    found = cap(asked, gait)
    assert fits(found, gait)
    length = math.hypot(*asked)
    if length > 1e-9:
        share = math.hypot(*found) / length
        assert share <= 1.0
        np.testing.assert_allclose(found, [share * number for number in asked], atol=1e-9)
        if share < 1.0:
            assert not fits(Velocity(*(1.02 * number for number in found)), gait) or share > 0.98


@pytest.mark.parametrize("name", GAITS)
@given(SPEED, SPEED, SPEED)
def test_widened_steps_of_a_command_that_fits_lie_in_the_hull(name, vx, vy, omega):
    gait = GAITS[name]
    found = cap(Velocity(vx, vy, omega), gait)
    wider = widening(found, gait)
    assert wider is not None
    hull = landing_hull(gait)
    for stance, side in ((0, -1.0), (1, 1.0)):
        x, y = displacement(gait.foot_distance + wider, gait.step_time, found, stance, 0.0)
        assert (hull.rows[:, :2] @ [x, side * y] <= hull.rows[:, 2] + 1e-8).all()


def test_numbers_that_are_not_finite_ask_to_stand():
    assert cap(Velocity(math.nan, 0.1, 0.0), ICUB) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    "corners",
    [
        ((-0.1, 0.1), (0.1, 0.1), (0.1, 0.3), (-0.1, 0.3)),
        ((-0.1, 0.1), (0.1, 0.3)),
        ((-0.1, 0.1), (-0.1, 0.1), (0.1, 0.3), (0.1, 0.1)),
        ((-0.1, 0.2), (-0.1, 0.3), (0.1, 0.3), (0.1, 0.2)),
    ],
    ids=["counter-clockwise", "a line", "a corner twice", "without the foot distance"],
)
def test_a_hull_that_no_step_can_use_is_refused(corners):
    with pytest.raises(BadInput, match="gait, hull"):
        landing_hull(replace(ICUB, hull=corners))
