"""The named walks: their velocities over time, and that every one is within what a gait may be asked."""

from __future__ import annotations

import pytest

from toddle.failures import BadInput
from toddle.robots.gait import Gait
from toddle.signals import STILL, Velocity
from toddle.walk.scenarios import SCENARIOS, Leg, scenario_named, velocity_at

GAIT = Gait(com_height=0.45, foot_distance=0.14, foot_length=0.2, foot_width=0.1)


def test_the_seven_scenarios_are_there() -> None:
    assert list(SCENARIOS) == ["straight", "sideways", "curve", "turn", "diagonal", "obstacle", "stop-and-go"]


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_scenario_is_within_what_may_be_asked(name: str) -> None:
    scenario = scenario_named(name)
    assert scenario.name == name
    assert scenario.legs[0].t == 0
    assert [leg.t for leg in scenario.legs] == sorted({leg.t for leg in scenario.legs})
    assert scenario.legs[-1].t < scenario.seconds
    for leg in scenario.legs:
        assert all(abs(asked) <= most for asked, most in zip(leg.velocity, GAIT.fastest, strict=True))


def test_each_leg_holds_until_the_next() -> None:
    legs = (Leg(1.0, Velocity(0.1, 0.0, 0.0)), Leg(2.0, STILL), Leg(3.0, Velocity(0.0, 0.0, 0.2)))
    asked = [velocity_at(legs, t) for t in (0.0, 0.99, 1.0, 1.99, 2.0, 3.0, 99.0)]
    assert asked == [STILL, STILL, legs[0].velocity, legs[0].velocity, STILL, legs[2].velocity, legs[2].velocity]


def test_ticks_that_were_added_up_meet_their_leg() -> None:
    t = sum([0.01] * 100)
    assert t != 1.0
    assert velocity_at((Leg(0.0, STILL), Leg(1.0, Velocity(0.1, 0.0, 0.0))), t).vx == 0.1


def test_stop_and_go_stops_and_goes() -> None:
    legs = scenario_named("stop-and-go").legs
    moves = [velocity_at(legs, t).vx > 0 for t in (1.0, 6.0, 11.0, 16.0)]
    assert moves == [True, False, True, False]


def test_a_wrong_name_is_answered_with_the_right_one() -> None:
    with pytest.raises(BadInput, match=r"--scenario: no scenario named 'streight'; did you mean straight"):
        scenario_named("streight")
