"""Rooms drawn by number: the same scenario, split, style and number give the same room.

A draw is thrown away and made anew while something overlaps, no way leads to the target (`planner`), or the target,
faced from the start, fills fewer than `FEWEST` pixels of the small picture. Each split draws from random streams of its
own, so that none of its rooms is another split's; the unseen style is only drawn for tests.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput, unknown_name
from toddle.navigate.scenarios import furniture, room_styles
from toddle.navigate.scenarios.planner import plan
from toddle.navigate.scenarios.raycast import chest_eye, seen_things
from toddle.navigate.scenarios.rooms import (
    SCENARIOS,
    SPLITS,
    STYLES,
    SUCCESS_RADIUS,
    Hall,
    Person,
    Room,
    Scenario,
    Split,
    Style,
    Thing,
)

BODY = 0.35
"""Radius of the disc that must fit through [m]: the robot with its sway."""

FEWEST = 10
"""Pixels of the target in the small picture, when it is faced from the start."""

_TRIES = 500  # draws of one room
_PLACES = 60  # draws of one thing's place
_APART = 0.1  # between two things [m]
_FROM_START, _FROM_TARGET, _FROM_WAY = 0.65, 0.60, 0.45  # to a thing's rim [m]
_FROM_WALL = 0.9  # of start and target [m]
_FROM_PANEL = 0.05  # of a thing to the walls, on which panels are [m]
_BYSTANDER = 0.3  # share of rooms
_PANEL_SURFACES = tuple(map(room_styles.furniture_surface, range(room_styles.FURNITURE_SURFACES)))
_PANEL_SURFACES += (room_styles.CEILING, room_styles.METAL)
_Point = Float[np.ndarray, "2"]


class Task(NamedTuple):
    """Ranges of a scenario: distance of the target [m], how far aside it is, either way [degrees]."""

    distance: tuple[float, float]
    aside: tuple[float, float]


TASKS: dict[Scenario, Task] = {
    "straight": Task((1.8, 3.5), (0.0, 6.0)),
    "curve": Task((1.8, 3.5), (15.0, 31.0)),
    "obstacle": Task((2.6, 3.8), (0.0, 10.0)),
    "search": Task((1.8, 3.5), (90.0, 180.0)),
    "person": Task((2.6, 3.8), (0.0, 10.0)),
    "decoys": Task((1.8, 3.5), (0.0, 31.0)),
}
"""Of each scenario."""


def room(scenario: Scenario, split: Split, number: int, style: Style = "seen") -> Room:
    """One room.

    Args:
        scenario: which.
        split: train, validation or test.
        number: of the room, from 0.
        style: of surfaces and light.

    Raises:
        BadInput: there is no such scenario, split or style, or the unseen style is asked for training.
    """
    for what, name, known in (("scenario", scenario, SCENARIOS), ("split", split, SPLITS), ("style", style, STYLES)):
        if name not in known:
            raise unknown_name(what, name, list(known), where="room")
    if number < 0:
        raise BadInput(f"there is no room {number}", where="room", remedy="count from 0")
    if style == "unseen" and split != "test":
        raise BadInput(f"the unseen style is kept out of {split}", where="room", remedy="use it with split test")
    names = SCENARIOS.index(scenario), SPLITS.index(split), STYLES.index(style)
    draw = np.random.default_rng([2019, *names, number])
    for _ in range(_TRIES):
        found = _attempt(draw, scenario, split, number, style)
        if found is not None:
            return found
    raise BadInput(
        f"no {scenario} in {_TRIES} draws", where=f"room {number} of {split}", remedy="choose another number"
    )


def rooms(scenario: Scenario, split: Split, count: int, style: Style = "seen", first: int = 0) -> Iterator[Room]:
    """Rooms ``first`` to ``first + count - 1``, each drawn when it is asked for."""
    return (room(scenario, split, first + number, style) for number in range(count))


def _attempt(draw: np.random.Generator, scenario: Scenario, split: Split, number: int, style: Style) -> Room | None:
    """A room, if the draw gives one."""
    task = TASKS[scenario]
    distance, side = draw.uniform(*task.distance), draw.choice([-1.0, 1.0])
    aside = side * math.radians(draw.uniform(*task.aside))
    end = distance * np.array([math.cos(aside), math.sin(aside)])
    hall = _hall(draw, end)
    if hall is None:
        return None
    red = furniture.extinguisher(draw, room_styles.RED_PAINT, room_styles.BLACK, room_styles.LABEL)
    target = furniture.stand("extinguisher", red, end, float(draw.uniform(-math.pi, math.pi)))
    walkers = _walkers(draw, scenario, hall, end)
    first = _in_the_way(draw, end) if scenario == "obstacle" else ()
    first += _decoys(draw, hall, target) if scenario == "decoys" else ()
    if walkers is None or (scenario == "decoys" and not first):
        return None
    things = _furnish(draw, hall, target, first, walkers)
    circles = np.array([[thing.x, thing.y, thing.radius] for thing in things]).reshape(-1, 3)
    way = plan(end, circles, body=BODY)
    if way is None or (hall.inside(way.points) < BODY).any():
        return None
    covers, light = room_styles.surfaces(draw, style), room_styles.light(draw, style)
    shortest = way.length - SUCCESS_RADIUS
    made = Room(scenario, split, style, number, hall, target, things, walkers, covers, light, shortest)
    pixels = (seen_things(made, chest_eye(0.0, 0.0, aside)) == 0).sum()
    return made if pixels >= FEWEST else None


def _hall(draw: np.random.Generator, end: _Point) -> Hall | None:
    """A hall that holds start and target."""
    half = draw.uniform(2.0, 4.2), draw.uniform(1.8, 3.2)
    yaw, height = draw.uniform(-math.pi, math.pi), draw.uniform(2.4, 3.2)
    panels = furniture.panels(draw, half, _PANEL_SURFACES)
    walls = draw.choice([room_styles.WALL, room_styles.WALL, room_styles.ACCENT], 4).tolist()
    for _ in range(_PLACES):
        x, y = (end / 2 + draw.uniform(-3.0, 3.0, 2)).tolist()
        hall = Hall(x, y, yaw, half, height, room_styles.FLOOR, room_styles.CEILING, tuple(walls), panels)
        if hall.inside(np.stack([np.zeros(2), end])).min() >= _FROM_WALL:
            return hall
    return None


def _furnish(
    draw: np.random.Generator, hall: Hall, target: Thing, first: tuple[Thing, ...], walkers: tuple[Person, ...]
) -> tuple[Thing, ...]:
    """Furniture beside the straight way, clear of everything else; what finds no place is left out."""
    things = list(first)
    end = np.array([target.x, target.y])
    for _ in range(int(draw.integers(3, 10))):
        kind = str(draw.choice(list(furniture.FURNITURE)))
        number = int(draw.integers(room_styles.FURNITURE_SURFACES))
        covers = room_styles.furniture_surface(number), room_styles.METAL
        parts = furniture.FURNITURE[kind](draw, covers)
        for _ in range(_PLACES):
            thing = furniture.stand(kind, parts, _somewhere(draw, hall), float(draw.uniform(-3.2, 3.2)))
            if _fits(thing, hall, end, things) and _beside(thing, np.zeros(2), end, _FROM_WAY):
                if not all(_lets_pass(thing, person) for person in walkers):
                    continue
                things.append(thing)
                break
    return tuple(things)


def _in_the_way(draw: np.random.Generator, end: _Point) -> tuple[Thing, ...]:
    """One thing across the straight way, about half way."""
    kind = str(draw.choice(furniture.OBSTACLES))
    covers = room_styles.furniture_surface(int(draw.integers(room_styles.FURNITURE_SURFACES))), room_styles.METAL
    parts = furniture.FURNITURE[kind](draw, covers)
    share, aside = draw.uniform(0.42, 0.58), draw.uniform(-0.22, 0.22)
    across = np.array([-end[1], end[0]]) / np.hypot(*end)
    place = share * end + aside * across
    return (furniture.stand(kind, parts, place, float(draw.uniform(-math.pi, math.pi))),)


def _decoys(draw: np.random.Generator, hall: Hall, target: Thing) -> tuple[Thing, ...]:
    """One to three red things within 60 degrees of ahead, off the straight way."""
    found: list[Thing] = []
    end = np.array([target.x, target.y])
    for _ in range(int(draw.integers(1, 4))):
        kind = str(draw.choice(list(furniture.DECOYS)))
        parts = furniture.DECOYS[kind](draw, (room_styles.DECOY, room_styles.METAL))
        for _ in range(_PLACES):
            far, aside = draw.uniform(1.2, 3.8), draw.uniform(-1.05, 1.05)
            place = far * np.array([math.cos(aside), math.sin(aside)])
            thing = furniture.stand(f"red {kind}", parts, place, float(draw.uniform(-math.pi, math.pi)))
            if _fits(thing, hall, end, found) and _beside(thing, np.zeros(2), end, _FROM_WAY):
                found.append(thing)
                break
    return tuple(found)


def _walkers(draw: np.random.Generator, scenario: Scenario, hall: Hall, end: _Point) -> tuple[Person, ...] | None:
    """Who steps in the way, or now and then somebody who walks elsewhere; None: there is no room to step in."""
    if scenario == "person":
        person = _crosser(draw, end)
        inside = hall.inside(np.array(person.points)).min() >= furniture.PERSON_RADIUS + _APART
        return (person,) if inside else None
    if draw.random() >= _BYSTANDER:
        return ()
    for _ in range(_PLACES):
        a, b = _somewhere(draw, hall), _somewhere(draw, hall)
        clear = furniture.PERSON_RADIUS + _FROM_START
        off = min(_gap(a, b, share * end) for share in np.linspace(0.0, 1.0, 9))
        if np.hypot(*(b - a)) >= 1.0 and off >= clear and hall.inside(np.stack([a, b])).min() >= 0.35:
            return (_person(draw, (a, b, a), draw.uniform(1.0, 5.0), math.inf),)
    return ()


def _crosser(draw: np.random.Generator, end: _Point) -> Person:
    """Somebody who comes from the side, stands on the straight way, and goes on to the other side."""
    across = np.array([-end[1], end[0]]) / np.hypot(*end) * draw.choice([-1.0, 1.0])
    middle = draw.uniform(0.48, 0.62) * end + draw.uniform(-0.1, 0.1) * across
    slant = draw.uniform(-0.3, 0.3) * end / np.hypot(*end)
    points = middle - draw.uniform(0.9, 1.3) * across - slant, middle, middle + draw.uniform(0.9, 1.3) * across + slant
    return _person(draw, points, draw.uniform(3.0, 8.0), draw.uniform(1.0, 1.3))


def _person(draw: np.random.Generator, points: tuple[_Point, _Point, _Point], wait: float, trigger: float) -> Person:
    shirt, trousers = draw.choice(room_styles.CLOTHES_SURFACES, 2, replace=False).tolist()
    parts = furniture.person(
        draw,
        room_styles.clothes_surface(shirt),
        room_styles.clothes_surface(trousers),
        room_styles.SKIN,
        room_styles.HAIR,
        room_styles.SHOES,
    )
    (x, y), second = points[0].tolist(), points[1].tolist()
    looks = Thing("person", x, y, math.atan2(second[1] - y, second[0] - x), furniture.PERSON_RADIUS, parts)
    a, b, c = ((float(one), float(other)) for one, other in points)
    return Person(looks, (a, b, c), float(draw.uniform(0.3, 0.8)), float(wait), float(trigger))


def _somewhere(draw: np.random.Generator, hall: Hall) -> _Point:
    """Even over the hall."""
    a, b = (draw.uniform(-1.0, 1.0, 2) * np.array(hall.half)).tolist()
    cos, sin = math.cos(hall.yaw), math.sin(hall.yaw)
    return np.array([hall.x + cos * a - sin * b, hall.y + sin * a + cos * b])


def _fits(thing: Thing, hall: Hall, end: _Point, others: list[Thing]) -> bool:
    place = np.array([thing.x, thing.y])
    return bool(
        hall.inside(place) >= thing.radius + _FROM_PANEL
        and np.hypot(*place) >= thing.radius + _FROM_START
        and np.hypot(*(place - end)) >= thing.radius + _FROM_TARGET
        and all(math.dist(place, (it.x, it.y)) >= thing.radius + it.radius + _APART for it in others)
    )


def _beside(thing: Thing, start: _Point, end: _Point, room_left: float) -> bool:
    """Whether a thing leaves so much room beside the straight way [m]."""
    return _gap(start, end, np.array([thing.x, thing.y])) >= thing.radius + room_left


def _lets_pass(thing: Thing, person: Person) -> bool:
    legs = zip(person.points[:2], person.points[1:], strict=True)
    clear = furniture.PERSON_RADIUS + 0.05
    return all(_beside(thing, np.array(start), np.array(end), clear) for start, end in legs)


def _gap(start: _Point, end: _Point, place: _Point) -> float:
    """From a place to the straight way between two others [m]."""
    along = end - start
    share = np.clip((place - start) @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
    return float(np.hypot(*(place - start - share * along)))
