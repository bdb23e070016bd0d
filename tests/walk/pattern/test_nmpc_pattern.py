"""The default pattern closed over itself: it tracks, halts with both feet side by side, starts again, never raises."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from walk.gaits import HEICUB, HRP2
from walk.nmpc_cases import ICUB

from toddle.signals import Footstep, Velocity
from toddle.walk.pattern.feasible import cap
from toddle.walk.pattern.nmpc import NEVER
from toddle.walk.pattern.plan import Status
from toddle.walk.pattern.reduced import Reduced
from toddle.walk.pattern.trajectory import walk_pattern

STILL = Velocity(0.0, 0.0, 0.0)


def landings(pattern: Reduced, velocity: Velocity, count: int) -> list[Footstep]:
    state, found = pattern.start(), []
    while len(found) < count:
        side = state.at.support.side
        state, interval = pattern.step(state, velocity)
        assert interval.status == Status.SOLVED
        if state.at.support.side != side:
            found.append(state.at.support)
    return found


def achieved(gait, feet: list[Footstep]) -> np.ndarray:
    """Mean velocity over pairs of steps: where the body's middle would be by each foot, one foot two steps on."""
    rows = []
    for a, b in zip(feet[:-2], feet[2:], strict=True):
        half = gait.foot_distance / 2 * (1 if a.side == 0 else -1)
        dx = b.x - a.x + half * (math.sin(b.yaw) - math.sin(a.yaw))
        dy = b.y - a.y - half * (math.cos(b.yaw) - math.cos(a.yaw))
        turn = b.yaw - a.yaw
        arc = (turn / 2) / math.sin(turn / 2) if abs(turn) > 1e-9 else 1.0
        cos, sin = math.cos(a.yaw + turn / 2), math.sin(a.yaw + turn / 2)
        rows.append([arc * (cos * dx + sin * dy), arc * (cos * dy - sin * dx), turn])
    return np.mean(rows, axis=0) / (2 * gait.step_time)


@pytest.mark.parametrize("gait", [ICUB, HRP2, HEICUB], ids=["icub", "hrp2", "heicub"])
@pytest.mark.parametrize("seed", range(8))
def test_any_command_that_fits_is_tracked_within_three_percent(gait, seed):
    rng = np.random.default_rng(seed)
    wild = Velocity(*(rng.uniform(-1, 1, 3) * [0.5, 0.3, 1.0] * (rng.random(3) < 0.7)).tolist())
    asked = cap(wild, gait)
    got = achieved(gait, landings(Reduced(gait), asked, 26)[-10:])
    for number, wanted, most in zip(got, asked, cap_axes(gait), strict=True):
        assert number == pytest.approx(wanted, rel=0.03, abs=0.003 * most)


def cap_axes(gait):
    return [max(map(abs, cap(Velocity(*row), gait))) for row in (100 * np.eye(3)).tolist()]


def test_sideways_at_a_tenth_of_a_metre_per_second_is_no_longer_standing():
    # the printed weights gave 0.000
    got = achieved(ICUB, landings(Reduced(ICUB), Velocity(0.0, 0.1, 0.0), 20)[-8:])
    np.testing.assert_allclose(got, [0.0, 0.1, 0.0], atol=1e-3)


def test_it_halts_with_both_feet_side_by_side_and_starts_again():
    pattern, t = Reduced(ICUB), 0.0
    state, stood = pattern.start(), []
    while t < 22:
        velocity = Velocity(0.3, 0.05, 0.2) if 1 < t < 7 or 12 < t < 16 else STILL
        state, interval = pattern.step(state, velocity)
        t += interval.duration
        assert state.plan is not None
        assert state.plan.violation < 1e-5
        if interval.landing is None and velocity == STILL and abs(t % 1) < 0.05:
            stood.append((t, state.at))
    for after in (11.0, 21.0):
        at = next(at for t, at in stood if t > after)
        apart = np.array([at.lifted.x - at.support.x, at.lifted.y - at.support.y])
        yaw = at.support.yaw
        side = -1 if at.support.side == 0 else 1
        np.testing.assert_allclose(apart, side * 0.14 * np.array([-np.sin(yaw), np.cos(yaw)]), atol=1e-4)
        assert at.lifted.yaw == pytest.approx(yaw, abs=1e-4)
        middle = [(at.lifted.x + at.support.x) / 2, (at.lifted.y + at.support.y) / 2]
        np.testing.assert_allclose(at.com[:, 0], middle, atol=1e-3)
        np.testing.assert_allclose(at.com[:, 1:], 0.0, atol=1e-3)


def test_the_weight_is_over_before_the_first_foot_lifts():
    pattern = Reduced(ICUB)
    state, interval = pattern.step(pattern.start(), Velocity(0.2, 0.0, 0.0))
    assert interval.landing is None
    while interval.landing is None or interval.elapsed < ICUB.double_support:
        state, interval = pattern.step(state, Velocity(0.2, 0.0, 0.0))
    zmp = interval.com[:, 0] - ICUB.com_height / 9.81 * interval.com[:, 2]
    np.testing.assert_allclose(zmp, [interval.support.x, interval.support.y], atol=0.02)


def test_the_zmp_stays_under_the_soles_of_the_trajectory():
    walked = walk_pattern(Reduced(ICUB), ICUB, lambda t: Velocity(0.25, 0.0, 0.2) if t > 1 else STILL, 120)
    worst = 0.0
    for row in range(0, len(walked.t), 5):
        feet = walked.feet[row, 0]
        standing = [foot for foot in feet if foot[2] < 1e-9]
        if len(standing) == 1:
            x, y, _, yaw = standing[0]
            dx, dy = walked.zmp[row] - [x, y]
            ahead, aside = np.cos(yaw) * dx + np.sin(yaw) * dy, np.cos(yaw) * dy - np.sin(yaw) * dx
            worst = max(worst, abs(ahead - ICUB.foot_ahead) - ICUB.foot_length / 2, abs(aside) - ICUB.foot_width / 2)
    assert worst <= 0.0


def test_a_step_time_that_is_no_whole_number_of_samples_is_kept():
    gait = replace(ICUB, step_time=0.57)
    pattern, state, t, landed = Reduced(gait), Reduced(gait).start(), 0.0, []
    while len(landed) < 6:
        side = state.at.support.side
        state, interval = pattern.step(state, Velocity(0.1, 0.0, 0.0))
        t += interval.duration
        if state.at.support.side != side:
            landed.append(t)
    np.testing.assert_allclose(np.diff(landed), 0.57, atol=1e-9)


def test_every_second_iteration_late_and_the_plan_still_stands_up():
    pattern, slow = Reduced(ICUB), Reduced(ICUB, deadline_ms=1e-4)
    state = pattern.start()
    for k in range(300):
        state, interval = (slow if k % 2 else pattern).step(state, Velocity(0.05, 0.0, 0.0))
        assert interval.status == (Status.LATE if k % 2 else Status.SOLVED)
        off = np.abs(state.at.com[:, 0] - [state.at.support.x, state.at.support.y])
        assert off.max() < 0.2
    assert state.at.com[0, 0] > 0.8


def test_random_commands_at_every_iteration_are_walked():
    pattern, rng = Reduced(ICUB), np.random.default_rng(0)
    state = pattern.start()
    for _ in range(400):
        wild = Velocity(*(rng.uniform(-1, 1, 3) * [0.5, 0.3, 1.0]).tolist())
        state, interval = pattern.step(state, wild)
        assert interval.status == Status.SOLVED
        assert state.plan is not None
        assert state.plan.violation < 0.02
    assert state.at.halt == NEVER
