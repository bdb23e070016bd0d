"""How far a disc may walk, and where to first, against brute force and the grid's planner."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from toddle.navigate.cloning.detour import first_corner, free_lengths, gaps, narrowed
from toddle.navigate.scenarios.planner import plan
from toddle.navigate.scenarios.rooms import Hall

HALL = Hall(0.5, -0.2, 0.4, (3.0, 2.5), 2.5, 0, 0, (0, 0, 0, 0), ())
HERE = np.zeros(2)
BODY = 0.3


def _circles(seed: int, count: int) -> np.ndarray:
    """Some that leave the start and the goal at (3, 0) free."""
    draw = np.random.default_rng(seed)
    rows = np.column_stack(
        [draw.uniform(-1.0, 4.0, count), draw.uniform(-1.5, 1.5, count), draw.uniform(0.1, 0.4, count)]
    )
    keep = [min(math.hypot(x, y), math.hypot(x - 3.0, y)) - r > BODY + 0.1 for x, y, r in rows.tolist()]
    return rows[np.array(keep, bool)]


@given(st.integers(0, 10_000), st.integers(0, 6))
@settings(deadline=None)
def test_a_heading_is_free_as_far_as_a_disc_gets_in_small_steps(seed: int, count: int) -> None:
    circles, headings = _circles(seed, count), np.linspace(-math.pi, math.pi, 9)
    free = free_lengths(HERE, headings, circles, HALL, BODY, 2.0)
    for heading, length in zip(headings.tolist(), free.tolist(), strict=True):
        far = np.arange(0.0, 2.0, 0.01)
        places = far[:, None] * np.array([math.cos(heading), math.sin(heading)])
        off = np.hypot(*(places[:, None] - circles[None, :, :2]).transpose(2, 0, 1)) - circles[:, 2]
        bad = (off < BODY).any(axis=1) | (HALL.inside(places) < BODY)
        wanted = far[bad.argmax()] if bad.any() else 2.0
        assert abs(length - wanted) <= 0.11


@pytest.mark.parametrize("seed", range(40))
def test_going_from_corner_to_corner_is_about_as_short_as_the_planned_way(seed: int) -> None:
    circles, goal, place, length = _circles(seed, 5), np.array([3.0, 0.0]), HERE, 0.0
    way = plan(goal, circles, body=BODY + 0.05)
    if way is None:
        pytest.skip("no way leads there")
    for _ in range(100):
        corner = first_corner(place, goal, circles, None, BODY, math.nan, 0.0, 0.0)
        step = min(0.1, math.dist(corner, place))
        place = place + step * (corner - place) / max(math.dist(corner, place), 1e-9)
        length += step
        assert (np.hypot(*(circles[:, :2] - place).T) - circles[:, 2] > BODY - 0.07).all()
        if math.dist(place, goal) < 1e-6:
            break
    assert math.dist(place, goal) < 1e-6
    assert length < 1.15 * way.length + 0.1


def test_left_is_rather_gone_than_right_and_on_rather_than_back() -> None:
    ahead, goal = np.array([[1.5, 0.0, 0.3]]), np.array([3.0, 0.0])
    assert first_corner(HERE, goal, ahead, None, BODY, math.nan, 0.25, 0.15)[1] > 0
    assert first_corner(HERE, goal, ahead, None, BODY, -0.6, 0.05, 1.0)[1] < 0
    assert first_corner(HERE, goal, np.zeros((0, 3)), None, BODY, math.nan, 0.25, 0.15) is goal


def test_a_disc_that_overlaps_may_walk_away_but_not_on() -> None:
    overlapped = np.array([[0.4, 0.0, 0.3]])
    assert narrowed(overlapped, HERE, BODY)[0, 2] < 0.4 - BODY
    free = free_lengths(HERE, np.array([0.0, math.pi]), overlapped, None, BODY, 1.0)
    assert free[0] < 0.01
    assert free[1] == 1.0


@given(st.floats(-3.0, 3.0), st.floats(0.3, 2.0))
def test_the_gap_along_a_heading_is_the_least_distance_to_the_rim(bearing: float, away: float) -> None:
    circle = np.array([[away * math.cos(bearing), away * math.sin(bearing), 0.1]])
    found = float(gaps(HERE, np.zeros(1), circle, 1.0)[0])
    if math.cos(bearing) <= 0:
        assert math.isinf(found)
        return
    along = np.linspace(0.0, 1.0, 2001)
    assert found == pytest.approx(float(np.hypot(along - circle[0, 0], circle[0, 1]).min()) - 0.1, abs=1e-3)
