"""Layouts leave room where they must, block the way often enough, and are the same for the same seed."""

from __future__ import annotations

import numpy as np
import pytest

from toddle.navigate.scenarios.layouts import RADII, ROOM, Layout, layouts

BODY = 0.2
COUNT = 1000


@pytest.fixture(scope="module")
def drawn() -> Layout:
    return layouts(0, COUNT, body=BODY)


def blocked(where: Layout) -> np.ndarray:
    """Whether the straight way leads the robot's disc through a circle: by points along it."""
    points = np.linspace(0.0, 1.0, 301)[None, :, None] * np.asarray(where.goal)[:, None]
    circles = np.asarray(where.circles)[:, None]
    away = np.hypot(points[..., None, 0] - circles[..., 0], points[..., None, 1] - circles[..., 1])
    covered = (away < circles[..., 2] + BODY) & (circles[..., 2] >= 0)
    return np.any(covered, axis=(1, 2), keepdims=True)[:, 0, 0]


def test_no_circle_crowds_start_or_goal(drawn: Layout) -> None:
    circles, real = np.asarray(drawn.circles), np.asarray(drawn.circles)[..., 2] >= 0
    for point, room in ((np.zeros((COUNT, 1, 2)), ROOM), (np.asarray(drawn.goal)[:, None], ROOM / 2)):
        gap = np.hypot(*np.moveaxis(circles[..., :2] - point, -1, 0)) - circles[..., 2] - BODY
        assert gap[real].min() >= room - 1e-5


def test_the_straight_way_is_blocked_in_at_least_half_of_them(drawn: Layout) -> None:
    assert blocked(drawn).mean() >= 0.5


def test_sizes_numbers_and_directions(drawn: Layout) -> None:
    radius = np.asarray(drawn.circles)[..., 2]
    assert RADII[0] <= radius[radius >= 0].min()
    assert radius.max() <= RADII[1]
    assert set((radius >= 0).sum(axis=1)) == {0, 1, 2, 3, 4, 5}
    distance = np.hypot(*drawn.goal.T)
    assert 0.5 <= distance.min() < 0.6 < 2.9 < distance.max() <= 3.0
    corners = np.histogram(np.arctan2(drawn.goal[:, 1], drawn.goal[:, 0]), 8, (-np.pi, np.pi))[0]
    assert corners.min() > COUNT / 8 * 0.7


def test_the_seed_decides_and_a_longer_draw_starts_alike(drawn: Layout) -> None:
    again, other = layouts(0, COUNT, body=BODY), layouts(1, COUNT, body=BODY)
    np.testing.assert_array_equal(again.circles, drawn.circles)
    assert (other.goal != drawn.goal).all()


def test_without_circles_there_is_only_a_goal() -> None:
    assert layouts(0, 3, circles=0).circles.shape == (3, 0, 3)
