"""The steps by themselves: what a weight shift leads to, what was achieved and is corrected, when feet are together."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT, RIGHT
from toddle.signals import STILL, Velocity
from toddle.walk.config import WalkConfig
from toddle.walk.pattern.displacement import rotate
from toddle.walk.state import Landing, Pose
from toddle.walk.stepping import (
    achieved,
    begin,
    by_command,
    catching,
    chain,
    corrected,
    first_stance,
    moving,
    shift_zmp,
    side_by_side,
)

GAIT = Gait(com_height=0.465, foot_distance=0.14, foot_length=0.2, foot_width=0.1)
PLACE = st.floats(-0.2, 0.2)
PAIR = st.tuples(PLACE, PLACE)
SLOW = st.builds(Velocity, st.floats(-0.2, 0.2), st.floats(-0.08, 0.08), st.floats(-0.3, 0.3))
POSE = st.tuples(PLACE, PLACE, st.floats(-3, 3))


def divergent(xi: np.ndarray, start: np.ndarray, end: np.ndarray, seconds: float) -> np.ndarray:
    """The DCM later, xi' = omega (xi - p), while the ZMP p goes from start to end."""
    found = solve_ivp(
        lambda t, x: GAIT.omega * (x - start - (end - start) * t / seconds), (0, seconds), xi, rtol=1e-12, atol=1e-13
    )
    return found.y[:, -1]


@given(PAIR, PAIR, SLOW, st.floats(0.05, 0.4), st.sampled_from((LEFT, RIGHT)))
def test_after_the_weight_shift_the_steps_end_at_rest(
    xi: tuple[float, float], foot: tuple[float, float], velocity: Velocity, left: float, stance: int
) -> None:
    ahead = chain(GAIT, by_command(GAIT, velocity, stance, 0.0)[:2], final=False)
    at = np.array(shift_zmp(GAIT, xi, foot, ahead, left))
    dcm = divergent(np.array(xi), at, at, left)
    for step in (np.array(foot) - at, *map(np.array, ahead.displacements)):
        dcm = divergent(dcm, at, at + step, GAIT.double_support)
        at = at + step
        dcm = divergent(dcm, at, at, GAIT.step_time - GAIT.double_support)
    np.testing.assert_allclose(dcm, at, atol=1e-5)


@given(PAIR, SLOW, st.sampled_from((LEFT, RIGHT)))
def test_a_final_step_leaves_the_dcm_between_the_feet(
    foot: tuple[float, float], velocity: Velocity, stance: int
) -> None:
    landing = by_command(GAIT, velocity, stance, 0.0)[:1]
    ahead = chain(GAIT, landing, final=True)
    dcm = np.array(foot) + (ahead.kappa * np.array(landing[0]) + ahead.rest) / ahead.growth
    middle = np.array(foot) + np.array(landing[0]) / 2
    dcm = divergent(dcm, np.array(foot), middle, GAIT.double_support)
    dcm = divergent(dcm, middle, middle, GAIT.step_time - GAIT.double_support)
    np.testing.assert_allclose(dcm, middle, atol=1e-6)


@given(SLOW, st.sampled_from((LEFT, RIGHT)), POSE)
def test_steps_by_the_command_achieve_it(velocity: Velocity, stance: int, start: Pose) -> None:
    x, y, yaw = start
    landings = [Landing(0.0, stance, start, velocity)]
    for number, (dx, dy) in enumerate(by_command(GAIT, velocity, stance, yaw), start=1):
        x, y, t = x + dx, y + dy, number * GAIT.step_time
        landings.append(Landing(t, (stance + number) % 2, (x, y, yaw + velocity.omega * t), velocity))
    # in a turn the inner foot goes slower and the outer one faster: over a pair of each, the robot's middle
    one, other = achieved(tuple(landings[:3])), achieved(tuple(landings[1:4]))
    np.testing.assert_allclose((np.array(one) + other) / 2, velocity, atol=2e-3)


def trace(velocity: Velocity, start: Pose, times: tuple[float, ...] = (1.0, 1.6, 2.2)) -> tuple[Landing, ...]:
    """Landings of a robot that moves evenly without turning; sides in turn."""
    x, y, yaw = start
    found = []
    for number, t in enumerate(times):
        side = (LEFT, RIGHT)[number % 2]
        aside = 0.07 if side == LEFT else -0.07
        dx, dy = rotate(yaw, (velocity.vx * t, velocity.vy * t + aside))
        found.append(Landing(t, side, (x + dx, y + dy, yaw), velocity))
    return tuple(found)


@given(st.floats(-0.3, 0.3), st.floats(-0.1, 0.1), POSE, st.floats(0.3, 0.9), st.floats(0.3, 0.9))
def test_what_was_achieved_is_how_it_moved(vx: float, vy: float, start: Pose, first: float, second: float) -> None:
    found = achieved(trace(Velocity(vx, vy, 0.0), start, (1.0, 1 + first, 1 + first + second)))
    np.testing.assert_allclose(found, (vx, vy, 0.0), atol=1e-9)


@given(st.floats(-1, 1), st.floats(-3.1, 3.1))
def test_a_turn_is_told_across_the_half_circle(omega: float, yaw: float) -> None:
    landings = [
        Landing(t, LEFT, (0.0, 0.0, math.remainder(yaw + omega * t, 2 * math.pi)), STILL) for t in (0, 0.6, 1.2)
    ]
    assert achieved(tuple(landings)).omega == pytest.approx(omega, abs=1e-9)


@given(SLOW, SLOW, st.integers(1, 60))
def test_the_correction_grows_against_the_error_up_to_its_limit(asked: Velocity, moved: Velocity, times: int) -> None:
    config, start = WalkConfig(), STILL
    straight = moved._replace(omega=0.0)
    landings = tuple(one._replace(asked=asked) for one in trace(straight, (0.0, 0.0, 0.0)))
    for _ in range(times):
        start = corrected(start, landings, config)
    most = (config.velocity_most[0], config.velocity_most[0], config.velocity_most[1])
    for got, want, have, limit in zip(start, asked, straight, most, strict=True):
        summed = times * config.velocity_gain * (want - have)
        assert got == pytest.approx(min(max(summed, -limit), limit), abs=1e-9)


def test_without_three_landings_or_switched_off_the_correction_stays() -> None:
    before, landings = Velocity(0.01, 0.02, 0.03), trace(Velocity(0.1, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert corrected(before, landings[1:], WalkConfig()) is before
    assert corrected(before, landings, WalkConfig(correct_velocity=False)) is before


@given(POSE, st.sampled_from((-1, 1)), st.floats(-0.03, 0.03), st.floats(-0.03, 0.03), st.floats(-0.06, 0.06))
def test_feet_are_together_where_they_stand_as_the_robot_does(
    stance: Pose, side: int, ahead: float, aside: float, turned: float
) -> None:
    dx, dy = rotate(stance[2], (ahead, side * (GAIT.foot_distance + aside)))
    other = (stance[0] + dx, stance[1] + dy, stance[2] + turned + 2 * math.pi)
    near = abs(ahead) < 0.0149 and abs(aside) < 0.0149 and abs(turned) < 0.0299
    far = abs(ahead) > 0.0151 or abs(aside) > 0.0151 or abs(turned) > 0.0301
    if near or far:
        assert side_by_side(GAIT, stance, other) == near


def test_the_foot_on_the_far_side_carries_first() -> None:
    assert first_stance(Velocity(0.0, 0.1, 0.0)) == RIGHT
    assert first_stance(Velocity(0.0, -0.1, 0.0)) == LEFT
    assert first_stance(Velocity(0.0, 0.0, 0.3)) == RIGHT
    assert moving(Velocity(0.0, 0.0, 1e-3))
    assert not moving(STILL)


@given(POSE, st.sampled_from((LEFT, RIGHT)))
def test_a_step_that_catches_lands_beside_and_soon(foot: Pose, stance: int) -> None:
    step, later = catching(GAIT, stance, foot, (0.0, 0.0))
    assert step.double_support < GAIT.double_support
    assert not step.final
    assert step.planned == pytest.approx((0.0, -0.14 if stance == LEFT else 0.14), abs=1e-9)
    ahead = chain(GAIT, by_command(GAIT, STILL, stance, foot[2]), final=False)
    assert later == ahead.displacements[1:]
    whole = begin(GAIT, stance, foot, (0.0, 0.0), ahead, 0.0, final=False)
    assert whole.phase == 0
    assert whole.end == GAIT.step_time
    assert whole.landing == whole.nominal == whole.planned == step.planned
