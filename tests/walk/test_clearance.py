"""A command held back: a robot that follows it never enters an obstacle, and is left free where there is none."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.optimize import minimize

from toddle.robots.gait import Gait
from toddle.signals import Velocity
from toddle.walk.clearance import GAMMA, held_back, radius

GAIT = Gait(com_height=0.465, foot_distance=0.14, foot_length=0.2, foot_width=0.1)
DT = 0.05
SPEED = st.floats(-0.4, 0.4)
VELOCITY = st.builds(Velocity, SPEED, SPEED, st.floats(-1, 1))
CIRCLES = st.lists(st.tuples(st.floats(-2, 2), st.floats(-2, 2), st.floats(0.05, 0.5)), min_size=1, max_size=4)
HEADING = st.floats(-3, 3)


def gaps(circles: np.ndarray, x: float, y: float) -> np.ndarray:
    return np.hypot(circles[:, 0] - x, circles[:, 1] - y) - circles[:, 2] - radius(GAIT)


@given(VELOCITY, CIRCLES, HEADING)
def test_a_disc_that_follows_it_enters_no_circle(
    velocity: Velocity, told: list[tuple[float, float, float]], heading: float
) -> None:
    circles, x, y = np.array(told), 0.0, 0.0
    assume(gaps(circles, x, y).min() > 0)
    for _ in range(300):
        vx, vy, omega = held_back(velocity, circles, (x, y, heading), GAIT)
        assert omega == velocity.omega
        assert math.hypot(vx, vy) <= math.hypot(velocity.vx, velocity.vy) + 1e-6
        cos, sin = math.cos(heading), math.sin(heading)
        x, y, heading = x + DT * (cos * vx - sin * vy), y + DT * (sin * vx + cos * vy), heading + DT * omega
        assert gaps(circles, x, y).min() > -1e-4


@given(VELOCITY, st.floats(2.5, 10), HEADING, HEADING)
def test_far_from_everything_a_command_is_as_it_was(velocity: Velocity, away: float, where: float, yaw: float) -> None:
    circles = np.array([[away * math.cos(where), away * math.sin(where), 0.5]])
    assert held_back(velocity, circles, (0.0, 0.0, yaw), GAIT) is velocity
    assert held_back(velocity, np.zeros((0, 3)), (0.0, 0.0, yaw), GAIT) is velocity


@given(VELOCITY, CIRCLES, HEADING)
def test_it_is_the_nearest_velocity_that_keeps_off(
    velocity: Velocity, told: list[tuple[float, float, float]], yaw: float
) -> None:
    circles = np.array(told)
    left = gaps(circles, 0.0, 0.0)
    assume(left.min() > 0)
    found = held_back(velocity, circles, (0.0, 0.0, yaw), GAIT)
    # ahead, in the robot's frame, the world's directions are turned back by its heading
    cos, sin = math.cos(yaw), math.sin(yaw)
    away = -circles[:, :2] / np.linalg.norm(circles[:, :2], axis=1)[:, None] @ np.array([[cos, -sin], [sin, cos]])
    keeps = {"type": "ineq", "fun": lambda v: away @ v + GAMMA * left}
    other = minimize(
        lambda v: (v[0] - velocity.vx) ** 2 + (v[1] - velocity.vy) ** 2, np.zeros(2), constraints=[keeps],
        method="SLSQP", options={"ftol": 1e-12},
    )  # fmt: skip
    np.testing.assert_allclose(found[:2], other.x, atol=1e-4)


def test_inside_of_a_circle_it_goes_out_and_between_two_it_stands() -> None:
    inside = held_back(Velocity(0.2, 0.0, 0.1), np.array([[0.3, 0.0, 0.2]]), (0.0, 0.0, 0.0), GAIT)
    assert inside.vx < 0
    both = np.array([[0.3, 0.0, 0.2], [-0.3, 0.0, 0.2]])
    assert held_back(Velocity(0.2, 0.1, 0.1), both, (0.0, 0.0, 0.0), GAIT) == Velocity(0.0, 0.0, 0.1)


def test_the_disc_has_room_for_the_robot() -> None:
    assert radius(GAIT) > (GAIT.foot_distance + GAIT.foot_width) / 2
    assert radius(GAIT) == pytest.approx(0.07 + 0.05 + 0.17)
