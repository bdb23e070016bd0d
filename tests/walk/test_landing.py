"""The limits of a landing: never crossed, within what the swing foot can do, and off the obstacles."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT, RIGHT
from toddle.signals import STILL, Velocity
from toddle.walk.config import WalkConfig
from toddle.walk.landing import bounds, clear_of, dcm_of, within_reach
from toddle.walk.pattern.displacement import rotate
from toddle.walk.pattern.obstacles import clearance
from toddle.walk.state import Step
from toddle.walk.stepping import begin, by_command, chain

GAIT = Gait(com_height=0.465, foot_distance=0.14, foot_length=0.2, foot_width=0.1, foot_ahead=0.02)
CONFIG = WalkConfig()
PLACE = st.floats(-0.5, 0.5)
POSE = st.tuples(PLACE, PLACE, st.floats(-3, 3))
SIDE = st.sampled_from((LEFT, RIGHT))


def started(stance: int, foot: tuple[float, float, float], velocity: Velocity = STILL) -> Step:
    ahead = chain(GAIT, by_command(GAIT, velocity, stance, foot[2]), final=False)
    return begin(GAIT, stance, foot, foot[:2], ahead, velocity.omega * GAIT.step_time, final=False)


@given(SIDE, POSE)
def test_a_landing_as_planned_is_within_its_bounds(stance: int, foot: tuple[float, float, float]) -> None:
    step = started(stance, foot, Velocity(0.1, 0.0, 0.0))
    limits = bounds(step, GAIT, CONFIG)
    for low, planned, high in zip(limits.least, step.planned, limits.most, strict=True):
        assert low < planned < high
    assert limits.earliest < GAIT.step_time < limits.latest
    aside = {LEFT: limits.most[1], RIGHT: limits.least[1]}[stance]
    assert (aside < 0) == (stance == LEFT)


@given(SIDE, POSE, st.floats(0, 0.7), POSE, st.floats(-0.01, 0.03))
def test_what_the_swing_foot_cannot_do_is_taken_away_and_bounds_never_cross(
    stance: int, foot: tuple[float, float, float], phase: float, swinging: tuple[float, float, float], height: float
) -> None:
    step = started(stance, foot)._replace(phase=phase)
    limits = bounds(step, GAIT, CONFIG)
    found = within_reach(step, limits, np.array([*swinging[:2], height, swinging[2]]), CONFIG)
    assert found.latest >= found.earliest >= step.phase + max(height, 0.0) / CONFIG.fall_speed
    # the most that it moves until it lands, in the stance foot's frame
    time = max(step.end, found.earliest) - max(phase, step.double_support)
    at = rotate(-foot[2], (swinging[0] - foot[0], swinging[1] - foot[1]))
    for axis in (0, 1):
        assert limits.least[axis] <= found.least[axis] <= found.most[axis] <= limits.most[axis]
        far = max(abs(found.least[axis] - at[axis]), abs(found.most[axis] - at[axis]))
        alone = found.least[axis] == found.most[axis]
        assert alone or far <= CONFIG.swing_speed * time + 1e-9


@given(SIDE, POSE, st.floats(-math.pi, math.pi), st.floats(0.05, 0.3), st.floats(0.0, 0.3), st.floats(-0.1, 0.1))
def test_a_landing_that_keeps_a_row_keeps_its_sole_off(
    stance: int, foot: tuple[float, float, float], angle: float, size: float, between: float, along: float
) -> None:
    step = started(stance, foot, Velocity(0.1, 0.0, 0.2))
    middle = rotate(foot[2] + step.turn, (GAIT.foot_ahead, 0.0))
    planned = rotate(foot[2], step.planned)
    x, y = foot[0] + middle[0] + planned[0], foot[1] + middle[1] + planned[1]
    away = size + between
    circle = np.array([[x + away * math.cos(angle), y + away * math.sin(angle), size]])
    rows = clear_of(GAIT, step, circle)
    assume(len(rows) == 1)
    (nx, ny, least), beside = rows[0], (-rows[0][1], rows[0][0])
    assert math.hypot(nx, ny) == pytest.approx(1)
    landing = (least * nx + along * beside[0], least * ny + along * beside[1])
    kept = landing[0] * nx + landing[1] * ny
    assert kept == pytest.approx(least)
    dx, dy = rotate(foot[2], landing)
    pose = (foot[0] + dx, foot[1] + dy, foot[2] + step.turn)
    assert clearance(circle, pose, (GAIT.foot_length, GAIT.foot_width, GAIT.foot_ahead)) > 0


def test_obstacles_far_from_the_landing_have_no_row() -> None:
    step = started(LEFT, (0.0, 0.0, 0.0))
    assert clear_of(GAIT, step, np.array([[2.0, 0.0, 0.3]])).shape == (0, 3)
    assert clear_of(GAIT, step, np.zeros((0, 3))).shape == (0, 3)


@given(SIDE, POSE, st.floats(0, 0.55))
def test_the_dcm_that_is_asked_for_grows_as_a_pendulum_s(
    stance: int, foot: tuple[float, float, float], phase: float
) -> None:
    velocity, dt = Velocity(0.1, 0.0, 0.0), 1e-4
    ahead = chain(GAIT, by_command(GAIT, velocity, stance, foot[2]), final=False)
    origin = (foot[0] - 0.05, foot[1] + 0.14)
    step = begin(GAIT, stance, foot, origin, ahead, 0.0, final=False)
    now, later = (np.array(dcm_of(GAIT, step._replace(phase=t), ahead)) for t in (phase, phase + dt))
    share = min((phase + dt / 2) / GAIT.double_support, 1.0)
    zmp = np.array(origin) + share * (np.array(foot[:2]) - origin)
    np.testing.assert_allclose((later - now) / dt, GAIT.omega * ((now + later) / 2 - zmp), atol=1e-3)
