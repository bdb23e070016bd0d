"""The area of support, against scipy's hull and a search along the line."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from toddle.robots.gait import Gait
from toddle.walk.balance.support import area, clip, hull, load_share, margin, sole_corners

GAIT = Gait(com_height=0.5, foot_distance=0.14, foot_length=0.2, foot_width=0.1, foot_ahead=0.03)
PLACE = st.floats(-0.5, 0.5)
POINT = st.tuples(PLACE, PLACE)
POSE = st.tuples(PLACE, PLACE, st.floats(-3, 3))


def outside(corners: list[tuple[float, float]], point: tuple[float, float]) -> float:
    """How far beyond the farthest edge's line, by another hull's edges; negative inside."""
    edges = ConvexHull(np.array(corners)).equations
    return float((edges[:, :2] @ np.array(point) + edges[:, 2]).max())


@given(POSE, POSE)
def test_the_hull_is_scipy_s(left: tuple[float, float, float], right: tuple[float, float, float]) -> None:
    corners = [*sole_corners(GAIT, *left), *sole_corners(GAIT, *right)]
    found, other = np.array(hull(corners)), ConvexHull(np.array(corners))
    following = np.roll(found, -1, axis=0)
    assert 0.5 * np.sum(found[:, 0] * following[:, 1] - found[:, 1] * following[:, 0]) == pytest.approx(other.volume)
    assert all(outside(area(GAIT, [left, right]), corner) < 1e-9 for corner in corners)


@given(POSE, POSE, POINT)
def test_the_margin_is_the_distance_to_the_nearest_edge(
    left: tuple[float, float, float], right: tuple[float, float, float], point: tuple[float, float]
) -> None:
    corners = area(GAIT, [left, right])
    assert margin(corners, point) == pytest.approx(-outside(corners, point), abs=1e-7)


@given(POSE, POSE, POINT)
def test_what_is_clipped_is_where_the_line_leaves(
    left: tuple[float, float, float], right: tuple[float, float, float], point: tuple[float, float]
) -> None:
    corners = area(GAIT, [left, right])
    middle = np.mean(corners, axis=0)
    line = middle + np.linspace(0, 1, 401)[:, None] * (np.array(point) - middle)
    edges = ConvexHull(np.array(corners)).equations
    within = (line @ edges[:, :2].T + edges[:, 2]).max(axis=1) <= 1e-12
    last = line[within][-1]
    found = np.array(clip(corners, (float(middle[0]), float(middle[1])), point))
    assert np.linalg.norm(found - last) <= np.linalg.norm(line[1] - line[0]) + 1e-9
    assert outside(corners, (float(found[0]), float(found[1]))) < 1e-9


def test_corners_are_those_of_the_sole() -> None:
    turned = sole_corners(GAIT, 1.0, 2.0, np.pi / 2)
    # x ahead is the world's y: from 2 - 0.07 to 2 + 0.13, half a width either side of 1
    np.testing.assert_allclose(np.sort(turned, axis=0)[[0, -1]], [[0.95, 1.93], [1.05, 2.13]])
    np.testing.assert_allclose(np.mean(sole_corners(GAIT, 0.0, 0.0, 0.0, 0.5), axis=0), [0.03, 0])
    np.testing.assert_allclose(np.ptp(sole_corners(GAIT, 0.0, 0.0, 0.0, 0.5), axis=0), [0.1, 0.05])


def test_a_single_sole_is_the_area() -> None:
    assert area(GAIT, [(0.1, 0.2, 0.3)], 0.7) == sole_corners(GAIT, 0.1, 0.2, 0.3, 0.7)


@given(POINT, POINT, POINT)
def test_the_load_s_middle_is_the_point_between_the_feet_nearest_to_the_zmp(
    left: tuple[float, float], right: tuple[float, float], zmp: tuple[float, float]
) -> None:
    soles = np.array([[*left, 0, 0.2], [*right, 0, 0.1]])
    load = np.array(load_share(soles, zmp, None))
    assert load.sum() == pytest.approx(1)
    assert load.min() >= 0
    shares = np.linspace(0, 1, 1001)[:, None]
    nearest = np.linalg.norm(shares * left + (1 - shares) * np.array(right) - zmp, axis=1).min()
    if np.linalg.norm(np.subtract(left, right)) > 1e-3:
        assert np.linalg.norm(load @ soles[:, :2] - zmp) <= nearest + 1e-9


def test_a_foot_alone_carries_all() -> None:
    soles = np.array([[0.0, 0.1, 0, 0], [0.0, -0.1, 0, 0]])
    assert load_share(soles, (0.0, -0.1), 0) == (1.0, 0.0)
    assert load_share(soles, (0.0, 0.1), 1) == (0.0, 1.0)
    assert load_share(soles, (0.0, 0.05), None) == pytest.approx((0.75, 0.25))
