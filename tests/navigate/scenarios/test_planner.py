"""The planner against ways that geometry gives, rings, flooding of a finer grid, and its own ways point by point."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy import ndimage

from toddle.failures import BadInput
from toddle.navigate.scenarios.layouts import layouts
from toddle.navigate.scenarios.planner import plan, solvable_layouts

BODY = 0.2
NONE = np.zeros((0, 3))


def ring(radius: float, count: int, size: float) -> np.ndarray:
    angle = 2 * math.pi * np.arange(count) / count
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(count, size)])


def clear(points: np.ndarray, circles: np.ndarray) -> float:
    """The least gap between the robot's edge and a circle along a way [m], by points every 5 mm."""
    along = [np.linspace(a, b, max(int(200 * np.hypot(*(b - a))), 2)) for a, b in itertools.pairwise(points)]
    away = np.hypot(*(np.vstack(along)[:, None] - circles[None, :, :2]).transpose(2, 0, 1))
    return float((away - circles[:, 2] - BODY)[:, circles[:, 2] >= 0].min(initial=math.inf))


def test_a_free_way_is_straight() -> None:
    way = plan(np.array([1.0, -2.0]), np.array([[1.0, 1.0, 0.3], [0.5, -1.0, -1.0]]), body=BODY)
    assert way is not None
    np.testing.assert_allclose(way.points, [[0.0, 0.0], [1.0, -2.0]])
    assert way.length == pytest.approx(math.sqrt(5))


@pytest.mark.parametrize(("radius", "distance"), [(0.1, 2.0), (0.3, 2.0), (0.3, 3.0)])
def test_around_one_circle_the_way_is_two_tangents_and_an_arc(radius: float, distance: float) -> None:
    way = plan(np.array([distance, 0.0]), np.array([[distance / 2, 0.0, radius]]), body=BODY)
    grown, half = radius + BODY, distance / 2
    shortest = 2 * math.sqrt(half**2 - grown**2) + grown * (math.pi - 2 * math.acos(grown / half))
    assert way is not None
    assert shortest - 1e-6 <= way.length < 1.03 * shortest


def test_a_ring_holds_the_robot_and_a_ring_with_a_gap_does_not() -> None:
    circles = ring(1.0, 12, 0.1)  # gaps of 0.32 m for a robot of 0.4 m
    assert plan(np.array([2.0, 0.0]), circles, body=BODY) is None
    assert plan(np.array([2.0, 0.0]), circles[:-1], body=BODY) is not None


@pytest.mark.parametrize(("gap", "fits"), [(0.44, True), (0.38, False)])
def test_a_gate_in_a_wall_counts_when_the_robot_fits(gap: float, fits: bool) -> None:
    aside = gap / 2 + 0.3 + 0.5 * np.arange(12)
    wall = np.array([[1.0, sign * y, 0.3] for sign in (-1, 1) for y in aside])
    way = plan(np.array([2.0, 0.0]), wall, body=BODY)
    assert way is not None
    assert (way.length == pytest.approx(2.0)) == fits


@pytest.mark.parametrize("where", [(0.0, 0.0), (1.0, 0.0)])
def test_a_covered_start_or_goal_has_no_way(where: tuple[float, float]) -> None:
    assert plan(np.array([1.0, 0.0]), np.array([[*where, 0.1]]), body=BODY) is None


def test_planned_ways_keep_clear_and_end_at_the_goal() -> None:
    drawn = layouts(3, 40, body=BODY)
    for goal, circles in zip(drawn.goal, drawn.circles, strict=True):
        way = plan(goal, circles, body=BODY)
        assert way is not None
        assert clear(way.points, circles) >= -1e-4
        np.testing.assert_allclose(way.points[[0, -1]], [[0.0, 0.0], goal])
        assert way.length >= np.hypot(*goal) - 1e-6


def test_solvable_is_what_a_flood_reaches() -> None:
    draw = np.random.default_rng(5)
    answers = []
    for _ in range(30):
        circles = ring(1.0, 9, 0.2)
        circles[:, :2] += draw.normal(0, 0.1, 2) + draw.normal(0, 0.05, (9, 2))
        goal = np.array([2.5, 0.0])
        grid = np.stack(np.meshgrid(np.arange(-3, 4, 0.02), np.arange(-3, 3, 0.02), indexing="ij"), axis=-1)
        gap = np.min([np.hypot(*(grid - (x, y)).transpose(2, 0, 1)) - r - BODY for x, y, r in circles], axis=0)

        def reached(least: float, gap: np.ndarray = gap) -> bool:
            regions = np.asarray(ndimage.label(gap >= least)[0])  # type: ignore[index]
            return bool(regions[150, 150] == regions[275, 150]) and bool(regions[150, 150])

        found = plan(goal, circles, body=BODY) is not None
        assert reached(0.06) <= found <= reached(-0.01)
        answers.append(found)
    assert 0.1 < np.mean(answers) < 0.9


def test_solvable_layouts_all_have_a_way_and_say_how_many_were_drawn() -> None:
    where, lengths, drawn = solvable_layouts(0, 20, circles=12, goal=(2.0, 3.0), body=0.35)
    assert where.goal.shape == (20, 2)
    assert where.circles.shape == (20, 12, 3)
    assert drawn >= 20
    for goal, circles, length in zip(where.goal, where.circles, lengths, strict=True):
        way = plan(goal, circles, body=0.35)
        assert way is not None
        assert way.length == pytest.approx(length)


def test_numbers_must_be_finite() -> None:
    with pytest.raises(BadInput, match="finite"):
        plan(np.array([math.nan, 0.0]), NONE)
