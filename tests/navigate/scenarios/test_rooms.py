"""Rooms: nothing overlaps, the target is there to be seen and reached, and what is kept apart is apart."""

from __future__ import annotations

import colorsys
import functools
import itertools
import math
from typing import Any, cast

import numpy as np
import pytest
from scipy import ndimage

from toddle.failures import BadInput
from toddle.navigate.scenarios import passing, room_styles
from toddle.navigate.scenarios.draw_rooms import BODY, FEWEST, TASKS, room, rooms
from toddle.navigate.scenarios.furniture import PERSON_RADIUS
from toddle.navigate.scenarios.raycast import chest_eye, seen_things
from toddle.navigate.scenarios.rooms import (
    SCENARIOS,
    SPLITS,
    SUCCESS_RADIUS,
    Room,
    Scenario,
    Split,
    Style,
    Surface,
    Thing,
    moved,
    solids,
)
from toddle.navigate.scenarios.textures import PATTERNS, texture

KINDS: list[tuple[Split, Style]] = [("train", "seen"), ("validation", "seen"), ("test", "seen"), ("test", "unseen")]
ASKED = [(scenario, *kind, number) for scenario, kind, number in itertools.product(SCENARIOS, KINDS, range(2))]
EVERY = pytest.mark.parametrize("drawn", ASKED, indirect=True, ids=lambda asked: "-".join(map(str, asked)))


@functools.cache
def the_room(scenario: Scenario, split: Split, style: Style, number: int) -> Room:
    return room(scenario, split, number, style)


@pytest.fixture
def drawn(request: pytest.FixtureRequest) -> Room:
    return the_room(*request.param)


def gap(start: np.ndarray, end: np.ndarray, points: np.ndarray) -> float:
    """Nearest of many places on a straight way to a point, by brute force."""
    way = start + np.linspace(0.0, 1.0, 400)[:, None] * (end - start)
    return float(np.hypot(*(way - points).T).min())


@EVERY
def test_nothing_overlaps_and_all_is_in_the_hall(drawn: Room) -> None:
    circles = drawn.circles
    for one, other in itertools.combinations(circles, 2):
        assert math.dist(one[:2], other[:2]) > one[2] + other[2]
    assert (drawn.hall.inside(circles[:, :2]) >= circles[:, 2]).all()
    assert (np.hypot(*circles[:, :2].T) > circles[:, 2] + BODY).all()
    for person in drawn.people:
        for start, end in itertools.pairwise(np.array(person.points)):
            standing = circles[: len(drawn.standing)]
            assert all(gap(start, end, it[:2]) > it[2] + PERSON_RADIUS for it in standing)


@EVERY
def test_parts_stay_within_their_thing_and_above_the_floor(drawn: Room) -> None:
    for thing in (*drawn.standing, *(person.looks for person in drawn.people)):
        for part in thing.parts:
            (x, y, z), (a, b, c) = part.middle, part.half
            corners = [math.hypot(x + s * a, y + t * b) for s in (-1, 1) for t in (-1, 1)]
            reach = math.hypot(x, y) + a if part.shape == "cylinder" else max(corners)
            assert reach <= thing.radius + 1e-9
            assert min(part.half) > 0
            assert z - c >= -1e-9
            assert z + c < drawn.hall.height
            assert 0 <= part.surface < len(drawn.surfaces)


@EVERY
def test_the_target_is_where_its_scenario_says(drawn: Room) -> None:
    target, task = drawn.target, TASKS[drawn.scenario]
    end = np.array([target.x, target.y])
    assert task.distance[0] <= np.hypot(*end) <= task.distance[1]
    assert task.aside[0] - 1e-9 <= abs(math.degrees(math.atan2(target.y, target.x))) <= task.aside[1] + 1e-9
    nearest = min((gap(np.zeros(2), end, np.array([it.x, it.y])) - it.radius for it in drawn.things), default=9.0)
    assert (nearest < 0.1) == (drawn.scenario == "obstacle")
    assert any(thing.kind.startswith("red") for thing in drawn.things) == (drawn.scenario == "decoys")
    if drawn.scenario == "person":
        assert gap(np.zeros(2), end, np.array(drawn.people[0].points[1])) < 0.15


@EVERY
def test_the_target_is_well_seen_when_it_is_faced(drawn: Room) -> None:
    eye = chest_eye(0.0, 0.0, math.atan2(drawn.target.y, drawn.target.x))
    assert (seen_things(drawn, eye) == 0).sum() >= FEWEST


@EVERY
def test_a_way_leads_to_the_target(drawn: Room) -> None:
    """A flood over a grid, which knows nothing of the planner."""
    cell, hall = 0.02, drawn.hall
    reach = math.hypot(*hall.half)
    points = np.stack(
        np.meshgrid(
            np.arange(hall.x - reach, hall.x + reach, cell),
            np.arange(hall.y - reach, hall.y + reach, cell),
            indexing="ij",
        ),
        axis=-1,
    )
    free = hall.inside(points) >= BODY - cell
    for thing in drawn.things:
        free &= np.hypot(points[..., 0] - thing.x, points[..., 1] - thing.y) >= thing.radius + BODY - cell
    parts, _ = cast(Any, ndimage.label(free))

    def part(x: float, y: float) -> int:
        return parts[round((x - hall.x + reach) / cell), round((y - hall.y + reach) / cell)]

    assert part(0.0, 0.0) == part(drawn.target.x, drawn.target.y) > 0
    straight = math.hypot(drawn.target.x, drawn.target.y) - SUCCESS_RADIUS
    assert straight - 1e-9 <= drawn.shortest < 2 * straight + 0.5
    if drawn.scenario not in ("obstacle",):
        assert drawn.shortest == pytest.approx(straight)


def test_a_room_is_its_number() -> None:
    assert room("curve", "train", 3) == room("curve", "train", 3)
    assert next(rooms("curve", "train", 1, first=3)) == room("curve", "train", 3)
    assert room("curve", "train", 3) != room("curve", "train", 4)


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_no_layout_is_in_two_splits(scenario: Scenario) -> None:
    """No room of one split is within a centimetre of another split's in target, hall and number of things at once."""
    sets = {split: list(rooms(scenario, split, 20)) for split in SPLITS}
    marks = {
        split: np.array([[r.target.x, r.target.y, r.hall.x, r.hall.y, r.hall.yaw, *r.hall.half] for r in drawn])
        for split, drawn in sets.items()
    }
    for one, other in itertools.combinations(SPLITS, 2):
        assert np.abs(marks[one][:, None] - marks[other][None]).max(axis=-1).min() > 0.01
        assert not {surface for r in sets[one] for surface in r.surfaces} & {
            surface for r in sets[other] for surface in r.surfaces
        }


def test_the_unseen_style_shares_no_pattern_no_hue_no_light() -> None:
    drawn: dict[Style, list[Room]] = {
        style: [r for scenario in SCENARIOS for r in rooms(scenario, "test", 6, style)] for style in ("seen", "unseen")
    }

    def covers(style: Style) -> list[Surface]:
        own = [room_styles.FLOOR, room_styles.WALL, room_styles.ACCENT, *range(room_styles.FURNITURE, 20)]
        return [r.surfaces[number] for r in drawn[style] for number in own]

    def hues(style: Style) -> np.ndarray:
        return np.array([colorsys.rgb_to_hsv(*colour)[0] for s in covers(style) for colour in (s.colour, s.second)])

    assert len(drawn["seen"][0].surfaces) == 20
    assert not {s.pattern for s in covers("seen")} & {s.pattern for s in covers("unseen")}
    assert np.abs(hues("seen")[:, None] - hues("unseen")[None]).min() > 0.03
    bright = {style: [r.light.ambient[1] for r in drawn[style]] for style in drawn}
    assert min(bright["seen"]) > max(bright["unseen"])
    red = [colorsys.rgb_to_hsv(*r.surfaces[room_styles.RED_PAINT].colour) for style in drawn for r in drawn[style]]
    assert all(min(hue, 1 - hue) <= 0.021 and saturation > 0.75 for hue, saturation, _ in red)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("serch", "train", 0), "did you mean search"),
        (("search", "trian", 0), "did you mean train"),
        (("search", "test", 0, "unsen"), "did you mean unseen"),
        (("search", "train", 0, "unseen"), "the unseen style is kept out of train"),
        (("search", "validation", 0, "unseen"), "the unseen style is kept out of validation"),
        (("search", "train", -1), "there is no room -1"),
    ],
)
@pytest.mark.usefixtures("unchecked")
def test_what_is_no_room_is_refused(arguments: tuple[Any, ...], told: str) -> None:
    with pytest.raises(BadInput, match=told):
        room(*arguments)


@pytest.mark.parametrize("number", range(8))
def test_a_person_steps_in_the_way_and_stays_off_the_robot(number: int) -> None:
    drawn = room("person", "train", number)
    (person,) = drawn.people
    end = np.array([drawn.target.x, drawn.target.y])
    distance = float(np.hypot(*end))
    ahead, robot, dt = end / distance, np.zeros(2), 0.1
    stride, blocked, nearest = passing.enter(person), 0.0, 9.0
    for _ in range(900):
        place = np.array([stride.x, stride.y])
        nearest = min(nearest, math.dist(place, robot))
        along, off = float((place - robot) @ ahead), abs(float(np.cross([*ahead, 0], [*(place - robot), 0])[2]))
        stands_in_way = 0 < along < 1.1 and off < PERSON_RADIUS + BODY
        blocked += dt * stands_in_way
        if not stands_in_way and robot @ ahead < distance - SUCCESS_RADIUS:
            robot = robot + 0.12 * dt * ahead
        stride = passing.step(person, stride, (float(robot[0]), float(robot[1])), dt)
    assert blocked >= person.wait
    assert nearest >= PERSON_RADIUS + passing.ARM - 1e-9
    assert stride.towards == 3
    assert (stride.x, stride.y) == pytest.approx(person.points[2])


def test_a_person_waits_for_the_robot_and_for_the_end_of_the_wait() -> None:
    (person,) = room("person", "train", 0).people
    far = (99.0, 0.0)
    stride = passing.enter(person)
    assert passing.step(person, stride, far, 0.1) == stride
    stride = passing.step(person, stride, person.points[1], 0.1)
    assert stride.going
    for _ in range(100):
        stride = passing.step(person, stride, person.points[1], 0.1)
    near = math.dist((stride.x, stride.y), person.points[1])
    assert 0 <= near - PERSON_RADIUS - passing.ARM < 0.1 * person.speed
    steps = 0
    while stride.towards < 3:
        stride, steps = passing.step(person, stride, far, 0.1), steps + 1
    whole = near + math.dist(*person.points[1:])
    assert 0.1 * steps == pytest.approx(whole / person.speed + person.wait, abs=0.5)


def test_solids_are_where_their_things_are() -> None:
    drawn = room("person", "test", 1)
    parts = solids(drawn)
    assert parts.thing.max() == len(drawn.standing) + 1
    for number, thing in enumerate(drawn.standing):
        off = np.hypot(*(parts.middle[parts.thing == number, :2] - [thing.x, thing.y]).T)
        assert (off <= thing.radius).all()
    shifted = moved(parts, drawn, np.array([[0.5, -0.25]]))
    walker = parts.thing == len(drawn.standing)
    by = np.array([0.5, -0.25]) - np.array(drawn.people[0].points[0])
    assert shifted.middle[walker] - parts.middle[walker] == pytest.approx(np.tile([*by, 0.0], (walker.sum(), 1)))
    assert (shifted.middle[~walker] == parts.middle[~walker]).all()


@pytest.mark.parametrize("pattern", PATTERNS)
def test_a_texture_repeats_without_a_seam(pattern: str) -> None:
    pixels = texture(Surface(pattern, (0.8, 0.7, 0.6), (0.4, 0.4, 0.5), 1.0, 0.05, 7)).astype(float)
    assert pixels.shape == (128, 128, 3)
    assert pixels.std(axis=(0, 1)).min() > 1
    for axis in (0, 1):
        steps = np.abs(np.diff(np.concatenate([pixels, pixels.take([0], axis)], axis), axis=axis)).mean(
            axis=(1 - axis, 2)
        )
        assert steps[-1] <= steps.max() + 1e-9
        assert (steps >= 0.8 * steps[-1]).sum() > 1


def test_a_pattern_that_is_none_is_refused() -> None:
    with pytest.raises(BadInput, match="did you mean planks"):
        texture(Surface("plank", (0.8, 0.7, 0.6), (0.4, 0.4, 0.5), 1.0, 0.05, 7))


def test_the_hall_knows_its_inside() -> None:
    hall = room("straight", "train", 0).hall
    turn = np.array([math.cos(hall.yaw), math.sin(hall.yaw)])
    middle = np.array([hall.x, hall.y])
    assert hall.inside(middle) == pytest.approx(min(hall.half))
    assert hall.inside(middle + (hall.half[0] + 0.3) * turn) == pytest.approx(-0.3)
    assert isinstance(room("straight", "train", 0).target, Thing)
