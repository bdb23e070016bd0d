"""The soles' reference: where a swing ends, how it gets there, and what a late one does."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.robots.humanoid import LEFT, RIGHT
from toddle.walk.balance.feet import Feet, rest, swing

DT, HEIGHT, SWING = 0.01, 0.02, 0.48
ON_FLOOR = 0.003  # a swing comes down to just over the floor [m]
PLACE = st.floats(-0.3, 0.3)
GOAL = st.tuples(PLACE, PLACE, st.floats(-0.4, 0.4))


def standing() -> Feet:
    pose = np.array([[0.0, 0.07, 0.0, 0.0], [0.05, -0.07, 0.0, 0.1]])
    return Feet(pose, np.zeros((2, 4)), np.zeros((2, 4)))


def swung(goals: list[tuple[float, float, float]], seconds: float, side: int = RIGHT) -> list[Feet]:
    """Tick by tick, the goals in turn for equal parts of the swing."""
    feet, seen, ticks = standing(), [], round(seconds / DT)
    for tick in range(ticks):
        goal = goals[tick * len(goals) // ticks]
        feet = swing(feet, side, goal, HEIGHT, tick * DT, seconds - tick * DT, DT)
        seen.append(feet)
    return seen


@given(GOAL, st.sampled_from((LEFT, RIGHT)), st.floats(0.2, 0.8))
def test_a_swing_ends_at_its_goal_at_rest(goal: tuple[float, float, float], side: int, seconds: float) -> None:
    seen = swung([goal], round(seconds, 2), side)
    last = seen[-1]
    np.testing.assert_allclose(last.pose[side, [0, 1, 3]], goal, atol=2e-3)
    assert np.abs(last.velocity[side]).max() < 0.25
    assert abs(last.pose[side, 2]) < ON_FLOOR
    assert max(feet.pose[side, 2] for feet in seen) == pytest.approx(HEIGHT, rel=0.05)
    assert min(feet.pose[side, 2] for feet in seen) >= 0
    np.testing.assert_array_equal(last.pose[1 - side], standing().pose[1 - side])


@given(GOAL, GOAL)
def test_a_goal_that_moves_is_still_met_and_nothing_jumps(
    first: tuple[float, float, float], second: tuple[float, float, float]
) -> None:
    seen = swung([first, first, second, second, second], SWING)
    np.testing.assert_allclose(seen[-1].pose[RIGHT, [0, 1, 3]], second, atol=6e-3)
    poses = np.array([feet.pose[RIGHT] for feet in seen])
    speeds = np.array([feet.velocity[RIGHT] for feet in seen])
    # what the reference says of its velocity is how it moves
    middle = 0.5 * (speeds[1:] + speeds[:-1])
    np.testing.assert_allclose(np.diff(poses, axis=0)[:-2], DT * middle[:-2], atol=2e-3)


def test_the_path_is_one_polynomial_while_the_goal_stays() -> None:
    # at rest at both ends: s = 10 u^3 - 15 u^4 + 6 u^5
    seen = swung([(0.25, -0.07, 0.1)], 0.5)
    u = (np.arange(len(seen)) + 1) / len(seen)
    expected = 0.05 + 0.2 * (10 * u**3 - 15 * u**4 + 6 * u**5)
    np.testing.assert_allclose([feet.pose[RIGHT, 0] for feet in seen][:-2], expected[:-2], atol=1e-9)


def test_a_late_foot_goes_on_down_and_not_for_ever() -> None:
    feet = swung([(0.2, -0.07, 0.0)], SWING)[-1]
    heights = []
    for tick in range(60):
        feet = swing(feet, RIGHT, (0.5, 0.5, 0.5), HEIGHT, SWING, -tick * DT, DT)
        heights.append(feet.pose[RIGHT, 2])
    assert (np.diff(heights) <= 0).all()
    assert heights[5] < -0.002
    assert heights[-1] == pytest.approx(-0.03)
    np.testing.assert_allclose(feet.pose[RIGHT, :2], [0.2, -0.07], atol=2e-3)


def test_a_foot_that_stands_settles_on_its_anchor() -> None:
    feet, anchor = standing(), np.array([0.01, 0.06, 0.0, 0.02])
    gaps = []
    for _ in range(30):
        feet = rest(feet, LEFT, anchor, DT)
        gaps.append(float(np.abs(feet.pose[LEFT] - anchor).max()))
    assert (np.diff(gaps) < 0).all()
    assert gaps[-1] < 1e-4
    assert not feet.velocity.any()
    np.testing.assert_array_equal(feet.pose[RIGHT], standing().pose[RIGHT])


def test_what_came_in_is_not_touched() -> None:
    feet = standing()
    swing(feet, RIGHT, (0.2, 0.0, 0.0), HEIGHT, 0.0, SWING, DT)
    rest(feet, LEFT, np.ones(4), DT)
    for now, before in zip(feet, standing(), strict=True):
        np.testing.assert_array_equal(now, before)
