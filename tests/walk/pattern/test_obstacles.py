"""Circles: the nearest few, the distance to a sole, and walks that keep clear of them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from walk.nmpc_cases import ICUB

from toddle.signals import Circle, Velocity
from toddle.walk.pattern.nmpc import NEVER
from toddle.walk.pattern.obstacles import MOST, circles, clearance, near
from toddle.walk.pattern.plan import Status
from toddle.walk.pattern.reduced import Reduced
from toddle.walk.pattern.trajectory import walk_pattern

SOLE = (ICUB.foot_length, ICUB.foot_width, ICUB.foot_ahead)


def test_no_obstacles_are_no_rows():
    assert circles([]).shape == (0, 3)
    assert near(circles([]), 0.0, 0.0, 1.0).shape == (0, 3)


def test_the_nearest_come_first_and_only_those_within_reach():
    field = circles(Circle(x, 0.0, 0.1) for x in (3.0, 1.0, 0.5, 0.7))
    found = near(field, 0.2, 0.0, 0.9)
    np.testing.assert_allclose(found, [[0.3, 0, 0.1], [0.5, 0, 0.1], [0.8, 0, 0.1]])
    many = circles(Circle(0.5 + 0.01 * i, 0.0, 0.01) for i in range(50))
    assert len(near(many, 0.0, 0.0, 10.0)) == MOST


@given(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(-3, 3), st.floats(0.01, 0.2))
def test_clearance_is_the_distance_to_the_nearest_point_of_the_sole(x, y, yaw, radius):
    length, width, ahead = SOLE
    grid = np.stack(np.meshgrid(np.linspace(-length / 2, length / 2, 61), np.linspace(-width / 2, width / 2, 41)))
    u, v = grid.reshape(2, -1)
    px = np.cos(yaw) * (u + ahead) - np.sin(yaw) * v
    py = np.sin(yaw) * (u + ahead) + np.cos(yaw) * v
    sampled = np.hypot(px - x, py - y).min() - radius
    found = clearance(np.array([[x, y, radius]]), (0.0, 0.0, yaw), SOLE)
    if found > -radius + 0.005:
        assert found == pytest.approx(sampled, abs=0.003)
    else:
        assert sampled < -radius + 0.01


@pytest.mark.parametrize("seed", range(5))
def test_a_walk_straight_at_obstacles_goes_around_them(seed):
    rng = np.random.default_rng(seed)
    field = [
        Circle(1.0, float(rng.uniform(-0.15, 0.15)), float(rng.uniform(0.05, 0.25))),
        Circle(2.2, float(rng.uniform(-0.4, 0.4)), float(rng.uniform(0.05, 0.25))),
    ]
    walked = walk_pattern(Reduced(ICUB), ICUB, lambda _: Velocity(0.2, 0.0, 0.0), 300, field)
    assert {interval.status for interval in walked.intervals} == {Status.SOLVED}
    gaps = [clearance(circles(field), (f[0], f[1], f[3]), SOLE) for row in walked.feet[::3, 0] for f in row]
    assert min(gaps) > 0.005
    body = min(np.hypot(*(walked.com[:, 0, :2] - [c.x, c.y]).T).min() - c.radius for c in field)
    assert body > ICUB.foot_distance / 2 + 0.11
    assert walked.com[-1, 0, 0] > 3.0


def test_eight_circles_all_round_are_a_prison_and_no_fall():
    ring = [Circle(0.8 * np.cos(a), 0.8 * np.sin(a), 0.25) for a in np.arange(8) * np.pi / 4]
    pattern = Reduced(ICUB)
    walked = walk_pattern(pattern, ICUB, lambda _: Velocity(0.2, 0.05, 0.0), 150, ring)
    assert np.abs(walked.com[:, 0, :2]).max() < 0.6
    assert {interval.status for interval in walked.intervals} == {Status.SOLVED}


def test_a_circle_out_of_reach_changes_nothing():
    pattern, state = Reduced(ICUB), Reduced(ICUB).start()
    for _ in range(12):
        state, _ = pattern.step(state, Velocity(0.2, 0.0, 0.0))
    assert state.at.halt == NEVER
    _, free = pattern.step(state, Velocity(0.2, 0.0, 0.0))
    _, far = pattern.step(state, Velocity(0.2, 0.0, 0.0), [Circle(30.0, 0.0, 1.0)])
    np.testing.assert_array_equal(free.jerk, far.jerk)
