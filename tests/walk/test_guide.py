"""The guide around circles: judged by distances of its own and by walking it with a point that can't turn at once."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.failures import BadInput
from toddle.signals import Circle, Velocity
from toddle.walk.guide import Guide, free, guide

WALL = tuple(Circle(1.5, y, 0.2) for y in np.linspace(-1.5, 1.5, 7).tolist())


def walked(guided: Guide, place: tuple[float, float, float], seconds: float = 60.0) -> tuple[bool, np.ndarray]:
    """Follow a guide with velocities that lag as a robot's do; whether it arrived, and the way."""
    x, y, yaw = place
    v = w = 0.0
    way = []
    for _ in range(round(seconds / 0.05)):
        asked = guided(np.array([x, y, yaw]))
        if asked is None:
            return True, np.array(way)
        v, w = v + 0.05 / 0.6 * (asked.vx - v), w + 0.05 / 0.6 * (asked.omega - w)
        x, y, yaw = x + 0.05 * v * math.cos(yaw), y + 0.05 * v * math.sin(yaw), yaw + 0.05 * w
        way.append((x, y))
    return False, np.array(way)


def gap(way: np.ndarray, circles: tuple[Circle, ...]) -> float:
    return min(float(np.hypot(way[:, 0] - c.x, way[:, 1] - c.y).min()) - c.radius for c in circles)


def test_without_obstacles_it_is_straight_ahead() -> None:
    assert guide((), (3.0, 0.0))(np.zeros(3)) == Velocity(0.2, 0.0, 0.0)


def test_at_the_goal_it_ends() -> None:
    assert guide((), (3.0, 0.0))(np.array([2.9, 0.0, 1.0])) is None


@pytest.mark.parametrize(("yaw", "sign"), [(1.0, -1), (-1.0, 1), (3.0, -1)])
def test_it_turns_towards_the_goal_in_place(yaw: float, sign: int) -> None:
    velocity = guide((), (3.0, 0.0))(np.array([0.0, 0.0, yaw]))
    assert velocity == Velocity(0.0, 0.0, sign * 0.3)


def test_the_way_around_one_circle_is_as_long_as_by_tangents() -> None:
    guided = guide((Circle(2.0, 0.0, 0.3),), (4.0, 0.0), clearance=0.4)
    towards = guided.ways[0].towards(np.zeros(2))
    assert towards is not None
    index = int(np.argmin(np.hypot(*(guided.ways[0].corners - towards).T)))
    length = math.hypot(*towards) + guided.ways[0].left[index]
    exact = 2 * math.sqrt(2.0**2 - 0.7**2) + 0.7 * (math.pi - 2 * math.acos(0.7 / 2.0))
    assert exact <= length < 1.02 * exact


def test_a_wall_is_walked_around() -> None:
    arrived, way = walked(guide(WALL, (3.0, 0.0)), (0.0, 0.0, 0.0))
    assert arrived
    assert gap(way, WALL) > 0.3
    assert np.abs(way[:, 1]).max() > 1.5


def test_who_stands_too_near_is_led_away() -> None:
    circle = Circle(1.0, 0.0, 0.3)
    arrived, way = walked(guide((circle,), (3.0, 0.0)), (0.6, 0.05, 0.0))
    assert arrived
    assert gap(way, (circle,)) > 0.03


def test_a_goal_that_is_walled_in_makes_it_stand() -> None:
    ring = tuple(Circle(3 + 0.8 * math.cos(a), 0.8 * math.sin(a), 0.25) for a in np.linspace(0, 2 * math.pi, 13)[1:])
    assert guide(ring, (3.0, 0.0))(np.zeros(3)) == Velocity(0.0, 0.0, 0.0)


def test_a_narrow_gap_is_taken_where_there_is_no_other() -> None:
    """A ring of posts around the start, closed but for one gap, too narrow for the clearance that is wished."""
    ring = tuple(Circle(1.5 * math.cos(a), 1.5 * math.sin(a), 0.2) for a in np.radians(np.linspace(22, 338, 27)))
    arrived, way = walked(guide(ring, (3.0, 0.0)), (0.0, 0.0, 2.0))
    assert arrived
    assert 0.25 < gap(way, ring) < 0.39


@given(st.lists(st.tuples(st.floats(-2, 4), st.floats(-2, 2), st.floats(0.05, 0.3)), max_size=6), st.floats(-4, 4))
def test_what_it_asks_is_allowed(numbers: list[tuple[float, float, float]], yaw: float) -> None:
    circles = tuple(Circle(*row) for row in numbers if math.hypot(row[0] - 5, row[1]) > row[2])
    velocity = guide(circles, (5.0, 0.0), speed=0.25, fastest_turn=0.2)(np.array([0.0, 0.0, yaw]))
    assert velocity is not None
    assert 0 <= velocity.vx <= 0.25
    assert velocity.vy == 0
    assert abs(velocity.omega) <= 0.2


@given(st.tuples(*4 * [st.floats(-2, 2)]), st.tuples(st.floats(-2, 2), st.floats(-2, 2), st.floats(0.05, 1)))
def test_a_free_way_is_one_by_many_points(ends: tuple[float, ...], row: tuple[float, float, float]) -> None:
    a, b = np.array(ends[:2]), np.array(ends[2:])
    points = a + np.linspace(0, 1, 2001)[:, None] * (b - a)
    least = float(np.hypot(*(points - row[:2]).T).min())
    if abs(least - row[2]) > 0.003:
        assert bool(free(a[None], b[None], np.array([row]))[0]) == (least > row[2])


@pytest.mark.parametrize(
    ("circles", "goal", "speed", "word"),
    [
        ((Circle(3.0, 0.0, 0.2),), (3.0, 0.1), 0.2, "goal"),
        ((), (math.nan, 0.0), 0.2, "finite"),
        ((), (1.0, 0.0), 0.0, "speed"),
        ((), (1.0, 0.0), math.inf, "speed"),
    ],
)
def test_what_can_not_be_is_refused(circles: tuple[Circle, ...], goal: tuple[float, float], speed: float, word: str):
    with pytest.raises(BadInput, match=word):
        guide(circles, goal, speed=speed)
