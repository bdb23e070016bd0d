"""The expert uses only what shows or has shown; it goes around things, waits for people, searches, and stops."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from toddle.failures import BadInput
from toddle.navigate.cloning.expert import Expert, Known
from toddle.navigate.driver import Driver, Situation
from toddle.navigate.scenarios.rooms import Hall
from toddle.navigate.sight import PERIOD, Showing
from toddle.signals import STILL, Velocity

HALL = Hall(0.0, 0.0, 0.0, (4.0, 4.0), 2.5, 0, 0, (0, 0, 0, 0), ())
HALF_VIEW = math.radians(34.0)
Rows = list[tuple[float, float, float]]


def _situation(
    t: float, place: tuple[float, float, float], rows: Rows, shown: list[int], felt: Velocity = STILL
) -> Situation:
    showing = Showing(np.array(place), np.array(rows, float), np.array(shown), HALL)
    return Situation(t, showing.place, (0.0, 0.0), felt, showing=showing)


def _shown(place: tuple[float, float, float], rows: Rows) -> list[int]:
    """Whatever is ahead shows."""
    x, y, yaw = place
    off = [math.remainder(math.atan2(b - y, a - x) - yaw, 2 * math.pi) for a, b, _ in rows]
    return [20 if abs(angle) < HALF_VIEW else 0 for angle in off]


def _drive(
    rows: Callable[[float], Rows], seconds: float, yaw: float = 0.0, expert: Expert | None = None
) -> tuple[list[tuple[float, float, float]], list[Velocity]]:
    """A point that does at once what the expert asks for."""
    driver, (x, y) = expert or Expert(), (0.0, 0.0)
    memory, places, asked, velocity = driver.start(), [], [], STILL
    for look in range(round(seconds / PERIOD)):
        t, place = look * PERIOD, (x, y, yaw)
        now = rows(t)
        velocity, memory = driver.decide(memory, _situation(t, place, now, _shown(place, now), velocity))
        places.append(place)
        asked.append(velocity)
        x += PERIOD * velocity.vx * math.cos(yaw)
        y += PERIOD * velocity.vx * math.sin(yaw)
        yaw += PERIOD * velocity.omega
    return places, asked


def test_it_is_a_driver_that_must_be_told_what_shows() -> None:
    assert isinstance(Expert(), Driver)
    with pytest.raises(BadInput, match="what shows"):
        Expert().decide(Expert().start(), Situation(0.0, np.zeros(3), (1.0, 0.0), STILL))


@given(st.integers(0, 10_000))
@settings(deadline=None, max_examples=30)
def test_what_never_showed_changes_nothing(seed: int) -> None:
    draw = np.random.default_rng(seed)
    rows: Rows = [tuple(row) for row in draw.uniform((-3, -3, 0.1), (3, 3, 0.4), (6, 3)).tolist()]
    shown = (20 * (draw.random(6) < 0.5)).tolist()
    other: Rows = [row if pixels else (row[0] + 1.0, -row[1], 0.3) for row, pixels in zip(rows, shown, strict=True)]
    one, two = Expert().start(), Expert().start()
    for look in range(5):
        place = (0.02 * look, 0.0, 0.05 * look)
        first, one = Expert().decide(one, _situation(look * PERIOD, place, rows, shown))
        second, two = Expert().decide(two, _situation(look * PERIOD, place, other, shown))
        assert first == second


@pytest.mark.parametrize("bearing", [-0.5, 0.0, 0.4])
def test_it_walks_to_the_target_and_stands_near_it(bearing: float) -> None:
    target = (2.0 * math.cos(bearing), 2.0 * math.sin(bearing), 0.1)
    places, asked = _drive(lambda t: [target], 25.0)
    assert asked[-1] == STILL
    assert 0.3 < math.dist(places[-1][:2], target[:2]) <= 0.52
    assert max(velocity.vx for velocity in asked) <= Expert().fastest + 1e-9


@pytest.mark.parametrize("aside", [-0.25, -0.1, 0.0, 0.1, 0.25])
def test_it_goes_around_what_stands_in_the_way(aside: float) -> None:
    thing = (1.4, aside, 0.3)
    places, asked = _drive(lambda t: [(3.0, 0.0, 0.1), thing], 50.0)
    assert asked[-1] == STILL
    assert min(math.dist(place[:2], thing[:2]) for place in places) - thing[2] > 0.28


@pytest.mark.parametrize("radius", [0.12, 0.2, 0.3, 0.45])
@given(st.floats(-0.3, 0.3))
@settings(deadline=None, max_examples=15)
def test_it_does_not_dither_before_what_stands_in_the_way(radius: float, aside: float) -> None:
    _, asked = _drive(lambda t: [(3.0, 0.0, 0.1), (1.4, aside, radius)], 35.0)
    turning = [velocity.omega for velocity in asked if abs(velocity.omega) > 0.2]
    assert sum(one * other < 0 for one, other in pairwise(turning)) <= 4
    assert asked[-1] == STILL


def test_left_of_what_is_right_ahead() -> None:
    places, _ = _drive(lambda t: [(3.0, 0.0, 0.1), (1.4, 0.0, 0.3)], 50.0)
    assert max(y for _, y, _ in places) > 0.4
    assert min(y for _, y, _ in places) > -0.2


@pytest.mark.parametrize("bearing", [2.0, -2.0, 3.1])
def test_it_searches_what_is_behind_it(bearing: float) -> None:
    target = (2.0 * math.cos(bearing), 2.0 * math.sin(bearing), 0.1)
    places, asked = _drive(lambda t: [target], 60.0)
    assert asked[-1] == STILL
    assert math.dist(places[-1][:2], target[:2]) <= 0.52


def test_it_never_spins_forever() -> None:
    driver, memory = Expert(), Expert().start()
    x, y, yaw, far = 0.0, 0.0, 0.0, 0.0
    for look in range(400):
        velocity, memory = driver.decide(memory, _situation(look * PERIOD, (x, y, yaw), [(3.0, 0.0, 0.1)], [0]))
        x += PERIOD * velocity.vx * math.cos(yaw)
        y += PERIOD * velocity.vx * math.sin(yaw)
        yaw += PERIOD * velocity.omega
        far = max(far, math.hypot(x, y))
    assert far > 0.8
    assert HALL.inside(np.array([x, y])) > 0.3


def test_it_waits_for_who_steps_in_the_way_and_goes_on() -> None:
    def rows(t: float) -> Rows:
        side = min(max(1.2 - 0.5 * max(t - 1.0, 0.0), 0.0), 1.2) if t < 8.0 else max(-0.5 * (t - 8.0), -1.2)
        return [(3.0, 0.0, 0.1), (1.6, side, 0.25)]

    places, asked = _drive(rows, 45.0)
    apart = [math.dist(place[:2], rows(look * PERIOD)[1][:2]) - 0.25 for look, place in enumerate(places)]
    assert min(apart) > 0.28
    waits = [look for look, velocity in enumerate(asked) if look * PERIOD < 9.0 and velocity.vx <= 0.0]
    assert len(waits) * PERIOD > 2.0
    assert asked[-1] == STILL


def test_it_backs_off_from_what_is_too_near() -> None:
    near = _situation(0.0, (0.0, 0.0, 0.0), [(3.0, 0.0, 0.1), (0.5, 0.0, 0.25)], [20, 500])
    velocity, _ = Expert().decide(Expert().start(), near)
    assert velocity.vx < 0


def test_who_stands_in_the_way_forever_is_gone_around() -> None:
    def rows(t: float) -> Rows:
        return [(3.0, 0.0, 0.1), (1.6, max(1.0 - 0.5 * t, 0.0), 0.25)]

    places, asked = _drive(rows, 80.0)
    assert asked[-1] == STILL
    assert min(math.dist(place[:2], (1.6, 0.0)) for place in places[20:]) - 0.25 > 0.25


def test_memory_is_handed_back_and_nothing_is_kept() -> None:
    driver, seen = Expert(), _situation(0.0, (0.0, 0.0, 0.0), [(2.0, 0.5, 0.1)], [20])
    begin: Known = driver.start()
    first, memory = driver.decide(begin, seen)
    again, _ = driver.decide(begin, seen)
    assert first == again
    assert len(begin.seen) == 0
    assert memory.seen[0] == 0.0
