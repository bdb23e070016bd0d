"""The campaign that proves the walker: its pure parts. What it measures isn't tested here; it takes half an hour."""

from __future__ import annotations

import importlib
import json
import math
from itertools import pairwise
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.signals import Circle, Velocity
from toddle.walk.config import WalkConfig
from toddle.walk.guide import guide

ROOT = Path(__file__).parents[1]


def module(name: str) -> ModuleType:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT)
        return importlib.import_module(f"benchmarks.walking.{name}")


FIELDS, PUSHES, CAMPAIGN, WALKS = module("fields"), module("pushes"), module("campaign"), module("walks")
PHYSICS, REPORT, MAIN = module("physics"), module("report"), module("__main__")


@pytest.mark.parametrize("seed", range(12))
def test_a_field_stands_in_the_way_and_can_be_crossed(seed: int) -> None:
    """The second opinion is the guide's: a visibility graph in place of a flooded grid."""
    circles = FIELDS.field(seed)
    assert circles == FIELDS.field(seed)
    assert 5 <= len(circles) <= 9
    assert min(abs(circle.y) for circle in circles) <= 0.15
    gaps = [math.hypot(a.x - b.x, a.y - b.y) - a.radius - b.radius for a in circles for b in circles if a != b]
    assert min(gaps) >= 0.1
    assert guide(circles, FIELDS.GOAL, clearance=0.97 * FIELDS.DISC).ways[0].towards(np.zeros(2)) is not None


def test_fields_differ() -> None:
    assert len({FIELDS.field(seed) for seed in range(12)}) == 12


def test_a_wall_can_not_be_crossed() -> None:
    wall = tuple(Circle(3.0, y, 0.15) for y in np.arange(-2.6, 2.61, 0.4).tolist())
    assert not FIELDS.solvable(wall)
    door = tuple(circle for circle in wall if abs(circle.y) > 0.3)
    assert FIELDS.solvable(door)
    assert not FIELDS.solvable(door, disc=0.6)


def test_who_starts_in_an_obstacle_can_not_go() -> None:
    assert not FIELDS.solvable((Circle(0.2, 0.0, 0.1),))
    assert not FIELDS.solvable((Circle(FIELDS.GOAL[0], 0.3, 0.1),))


@given(st.lists(st.integers(1, 99), min_size=1, max_size=9, unique=True).map(sorted), st.integers(0, 100))
def test_bisection_finds_what_a_search_finds(grid: list[int], limit: int) -> None:
    asked: list[int] = []

    def survives(impulse: int) -> bool:
        asked.append(impulse)
        return impulse <= limit

    assert PUSHES.largest(survives, grid) == max((value for value in grid if value <= limit), default=0)
    assert len(set(asked)) == len(asked) <= math.ceil(math.log2(len(grid) + 1))


def pushed(phase: float | None, supports: list[int]) -> tuple[list[float], float | None]:
    """When pushes are to begin, and when the watcher has seen enough, for supports that last half a second each."""
    starts: list[float] = []
    simulation = SimpleNamespace(push=lambda impulse, direction, start: starts.append(start))
    watch = PUSHES.pushing(6.0, 90.0, phase, SimpleNamespace(step_time=0.6))
    for tick in range(50 * len(supports)):
        moment = SimpleNamespace(t=0.01 * (tick + 1), support=supports[tick // 50])
        if watch(moment, simulation):
            return starts, moment.t
    return starts, None


def test_a_push_comes_in_its_phase_of_the_left_foots_step() -> None:
    starts, end = pushed(0.35, [0, -1, 1, -1] * 6)  # the left foot lands at 5.5 s, after the right one carried
    assert starts == [pytest.approx(5.5 + 0.35 * 0.6)]
    assert end == pytest.approx(starts[0] + PUSHES.WATCHED, abs=0.011)


def test_a_push_to_who_stands_comes_at_once() -> None:
    starts, end = pushed(None, [-1] * 20)
    assert starts == [1.0]
    assert end == pytest.approx(4.0, abs=0.011)


def test_who_never_steps_is_never_pushed() -> None:
    assert pushed(0.1, [-1] * 20) == ([], None)


def test_every_switch_of_the_walker_is_ablated_and_every_term_makes_a_configuration() -> None:
    configs = [WalkConfig(**changed) for changed in PUSHES.terms().values()]
    assert configs[0] == WalkConfig()
    assert all(config != WalkConfig() for config in configs[1:])
    assert {"adapt_steps", "adapt_time", "plan_steps", "feed_forward"} <= set(PUSHES.terms())


def test_random_commands_cover_the_allowed_range() -> None:
    fastest = Velocity(0.3, 0.1, 0.3)
    legs = WALKS.random_commands(3, 300.0, fastest)
    assert legs == WALKS.random_commands(3, 300.0, fastest) != WALKS.random_commands(4, 300.0, fastest)
    assert [leg.t for leg in legs] == [2.0 * k for k in range(150)]
    asked = np.array([leg.velocity for leg in legs]) / np.array(fastest)
    assert np.abs(asked).max() <= 1
    assert np.abs(asked).max(axis=0).min() > 0.9
    moving = (asked != 0).sum(axis=1)
    assert {0, 1, 3} == set(moving.tolist())


def test_the_plan_is_compared_with_what_is_felt_a_tick_later() -> None:
    plan = np.random.default_rng(0).normal(size=(20, 2))
    felt = np.vstack([[[9.0, 9.0]], plan[:-1] + np.array([0.03, 0.04])])
    felt[7] = np.nan
    record: Any = SimpleNamespace(zmp=plan, measured=SimpleNamespace(zmp=felt), t=np.arange(20.0))
    assert PHYSICS.zmp_error(record) == pytest.approx(np.full(18, 0.05))


def test_errors_are_in_percent_of_what_was_asked() -> None:
    assert PHYSICS.errors(np.array([0.13, 0.04, 0.2]), np.array([0.1, 0.0, 0.25])) == [50.0, 20.0]
    assert PHYSICS.errors(np.array([0.0, 0.01, 0.3]), np.array([0.0, 0.0, 0.3])) == [None, 0.0]


def test_only_the_same_cases_by_the_same_source_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "walking_a.json"
    cases = [{"name": "a", "command": (0.1, 0.0)}, {"name": "b", "command": (0.2, 0.0)}]
    assert CAMPAIGN.kept(path, "one", cases) == {}
    rows = [case | {"command": list(case["command"]), "row": {"fell": False}} for case in cases]
    path.write_text(json.dumps({"source": "one", "cases": rows}))
    assert set(CAMPAIGN.kept(path, "one", cases)) == {"a", "b"}
    assert set(CAMPAIGN.kept(path, "one", [cases[0], {"name": "b", "command": (0.3, 0.0)}])) == {"a"}
    assert CAMPAIGN.kept(path, "two", cases) == {}


def test_every_part_has_cases_of_its_own_names_and_a_place_in_the_docs() -> None:
    pages = "".join((ROOT / "docs" / name).read_text() for name in ("walking-proof.md", "push-map.md"))
    for name, part in MAIN.PARTS.items():
        cases = part.cases(False)
        assert len({case["name"] for case in cases}) == len(cases) >= len(part.cases(True)) > 0
        json.dumps(cases)
        assert name in REPORT.TABLES
    for name in REPORT.TABLES:
        assert pages.count(f"<!-- {name} -->\n") == pages.count(f"<!-- /{name} -->") == 1


def test_a_page_is_filled_between_its_markers_again_and_again() -> None:
    page = "Before.\n<!-- a -->\nold\n<!-- /a -->\nMiddle.\n<!-- b -->\n<!-- /b -->\nAfter.\n"
    once = REPORT.filled(page, {"a": r"new \1", "b": "other"})
    want = ["Before.", "<!-- a -->", "", r"new \1", "", "<!-- /a -->", "Middle.", "<!-- b -->", "", "other", ""]
    assert once.splitlines() == [*want, "<!-- /b -->", "After."]
    assert REPORT.filled(once, {"a": r"new \1", "b": "other"}) == once


def test_a_table_names_what_is_missing() -> None:
    table = REPORT.table_of(("a", "b"), [[None, True], [[1.23456, None], "x"]])
    assert table == "| a | b |\n| --- | --- |\n| - | yes |\n| 1.23, - | x |"
    assert all(line.count("|") == 3 for line in table.splitlines())


def test_bad_worlds_differ_and_stay_in_their_range() -> None:
    worlds = [WALKS.bad_world(seed) for seed in range(20)]
    assert all(0.4 <= world.friction <= 1.0 for world in worlds)
    assert all(a != b for a, b in pairwise(worlds))
