"""A room as a record: walls, furniture, a fire extinguisher, things of its colour, people, light and textures.

The scenarios are those of Huber 2019, section 4.1 (straight, curve, obstacle, search), and two more: a person who steps
in the way, and decoys of the target's colour. The frame is the robot's at its start: it stands at the origin and looks
along x; the room lies around it at any angle. How a room is drawn is told by `draw_rooms`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float, Int

Scenario = Literal["straight", "curve", "obstacle", "search", "person", "decoys"]
SCENARIOS: tuple[Scenario, ...] = ("straight", "curve", "obstacle", "search", "person", "decoys")

Split = Literal["train", "validation", "test"]
SPLITS: tuple[Split, ...] = ("train", "validation", "test")

Style = Literal["seen", "unseen"]
STYLES: tuple[Style, ...] = ("seen", "unseen")
"""What surfaces and lights look like; nothing is ever trained or validated on the unseen ones."""

Colour = tuple[float, float, float]
"""Red, green, blue, from 0 to 1."""

SUCCESS_RADIUS = 0.6
"""Who stops with the waist so near to the target's middle has reached it [m]."""


@dataclass(frozen=True)
class Surface:
    """What something is covered with.

    Attributes:
        pattern: one of `textures.PATTERNS`.
        colour: most of it.
        second: the rest of it.
        tile: side of the square that repeats [m].
        grain: standard deviation of its grain, as a share of its brightness.
        seed: of the texture.
    """

    pattern: str
    colour: Colour
    second: Colour
    tile: float
    grain: float
    seed: int


@dataclass(frozen=True)
class Part:
    """A box or an upright cylinder, in the frame of its thing.

    Attributes:
        shape: which of the two.
        middle: x, y, z [m].
        half: half of a box's sides [m]; of a cylinder radius, radius, half of its height.
        surface: which of the room's surfaces covers it.
    """

    shape: Literal["box", "cylinder"]
    middle: tuple[float, float, float]
    half: tuple[float, float, float]
    surface: int


@dataclass(frozen=True)
class Thing:
    """Something that stands on the floor.

    Attributes:
        kind: its name, such as chair.
        x: of its middle [m].
        y: likewise.
        yaw: how it is turned [rad].
        radius: of the upright cylinder that it lies in [m].
        parts: what it is made of.
    """

    kind: str
    x: float
    y: float
    yaw: float
    radius: float
    parts: tuple[Part, ...]


@dataclass(frozen=True)
class Person:
    """Somebody who walks from one point to the next, stands there, and goes on to the last one: see `passing`.

    Attributes:
        looks: the person at the first point.
        points: three places x, y [m].
        speed: [m/s].
        wait: how long the person stands at the second point [s].
        trigger: sets off when the robot is so near to the second point [m]; infinite: at once.
    """

    looks: Thing
    points: tuple[tuple[float, float], tuple[float, float], tuple[float, float]]
    speed: float
    wait: float
    trigger: float


@dataclass(frozen=True)
class Light:
    """Light without place: ``ambient + sum(colour max(0, -normal direction))``, at most 1, scales a texture.

    Attributes:
        ambient: from everywhere.
        directions: unit vectors that light goes along.
        colours: of each of those.
    """

    ambient: Colour
    directions: tuple[tuple[float, float, float], ...]
    colours: tuple[Colour, ...]


@dataclass(frozen=True)
class Hall:
    """Four walls, a floor and a ceiling.

    Attributes:
        x: of the middle [m].
        y: likewise.
        yaw: how it is turned [rad].
        half: half of its length and of its width, between the walls [m].
        height: [m].
        floor: surface of the floor.
        ceiling: surface of the ceiling.
        walls: surfaces of the walls at +x, -x, +y, -y of its own frame.
        panels: doors, windows and the like on the walls, in its own frame.
    """

    x: float
    y: float
    yaw: float
    half: tuple[float, float]
    height: float
    floor: int
    ceiling: int
    walls: tuple[int, int, int, int]
    panels: tuple[Part, ...]

    def inside(self, points: Float[np.ndarray, "*rows 2"]) -> Float[np.ndarray, "*rows"]:
        """How far points are from the nearest wall [m]; negative outside."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        own = (points - np.array([self.x, self.y])) @ np.array([[cos, -sin], [sin, cos]])
        return np.asarray((np.array(self.half) - np.abs(own)).min(axis=-1))


class Solids(NamedTuple):
    """Parts of a room, in its frame.

    Attributes:
        middle: of each [m].
        half: as of a `Part` [m].
        yaw: of each [rad].
        round: 1 for a cylinder, 0 for a box.
        surface: of each.
        thing: 0 the target, then the other things, then the people, then the hall.
    """

    middle: Float[np.ndarray, "solids 3"]
    half: Float[np.ndarray, "solids 3"]
    yaw: Float[np.ndarray, " solids"]
    round: Int[np.ndarray, " solids"]
    surface: Int[np.ndarray, " solids"]
    thing: Int[np.ndarray, " solids"]


@dataclass(frozen=True)
class Room:
    """A room with its task: from the origin to the target.

    Attributes:
        scenario: which.
        split: train, validation or test.
        style: of surfaces and light.
        number: of the room within these three.
        hall: walls, floor, ceiling.
        target: the fire extinguisher.
        things: what else stands around.
        people: who else is there.
        surfaces: of everything.
        light: in the room.
        shortest: length of the way to within `SUCCESS_RADIUS` for a disc of `draw_rooms.BODY`, people left out [m].
    """

    scenario: Scenario
    split: Split
    style: Style
    number: int
    hall: Hall
    target: Thing
    things: tuple[Thing, ...]
    people: tuple[Person, ...]
    surfaces: tuple[Surface, ...]
    light: Light
    shortest: float

    @property
    def standing(self) -> tuple[Thing, ...]:
        """The target, then all other things."""
        return (self.target, *self.things)

    @property
    def circles(self) -> Float[np.ndarray, "things 3"]:
        """x, y, radius of the target, of the other things, and of the people where they start [m]."""
        everyone = (*self.standing, *(person.looks for person in self.people))
        return np.array([[thing.x, thing.y, thing.radius] for thing in everyone])


WALL = 0.1
"""Thickness of walls, floor and ceiling [m]."""


def hall_parts(hall: Hall) -> tuple[Part, ...]:
    """Panels, then floor, ceiling and walls in the hall's own frame; the floor's upper face is z = 0."""
    (a, b), half, h = hall.half, WALL / 2, hall.height / 2
    slabs = (
        ((0.0, 0.0, -half), (a + WALL, b + WALL, half), hall.floor),
        ((0.0, 0.0, hall.height + half), (a + WALL, b + WALL, half), hall.ceiling),
        ((a + half, 0.0, h), (half, b + WALL, h), hall.walls[0]),
        ((-a - half, 0.0, h), (half, b + WALL, h), hall.walls[1]),
        ((0.0, b + half, h), (a, half, h), hall.walls[2]),
        ((0.0, -b - half, h), (a, half, h), hall.walls[3]),
    )
    return (*hall.panels, *(Part("box", middle, size, surface) for middle, size, surface in slabs))


def solids(room: Room) -> Solids:
    """All that is in a room, as arrays; people where they start."""
    hall = Thing("hall", room.hall.x, room.hall.y, room.hall.yaw, math.inf, hall_parts(room.hall))
    rows = []
    for number, thing in enumerate((*room.standing, *(person.looks for person in room.people), hall)):
        cos, sin = math.cos(thing.yaw), math.sin(thing.yaw)
        for part in thing.parts:
            a, b, z = part.middle
            middle = (thing.x + cos * a - sin * b, thing.y + sin * a + cos * b, z)
            rows.append((*middle, *part.half, thing.yaw, part.shape == "cylinder", part.surface, number))
    table = np.array(rows, float)
    whole = table[:, 7:].astype(np.int32)
    arrays = (table[:, :3], table[:, 3:6], table[:, 6], whole[:, 0], whole[:, 1], whole[:, 2])
    return Solids(*map(np.ascontiguousarray, arrays))


def moved(parts: Solids, room: Room, people: Float[np.ndarray, "people 2"]) -> Solids:
    """The same solids with the people somewhere else.

    Args:
        parts: as `solids` gives them.
        room: likewise.
        people: where each is [m].
    """
    shift = np.zeros((len(room.standing) + len(room.people) + 1, 3))
    starts = np.array([[person.looks.x, person.looks.y] for person in room.people]).reshape(-1, 2)
    shift[len(room.standing) : -1, :2] = people - starts
    return parts._replace(middle=parts.middle + shift[parts.thing])
