"""The same room from another start: the robot always begins at the origin, so that it is the room that is moved."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.navigate.scenarios.draw_rooms import BODY
from toddle.navigate.scenarios.planner import plan
from toddle.navigate.scenarios.rooms import SUCCESS_RADIUS, Light, Person, Room, Thing

_TRIES = 200
_FREE = 0.5  # between the start and the rim of anything, or a wall [m]
_FAR = 1.0  # of the target, at least [m]


class Start(NamedTuple):
    """Where the robot begins, in the frame that the room was drawn in: x, y [m] and yaw [rad]."""

    x: float
    y: float
    yaw: float


DRAWN = Start(0.0, 0.0, 0.0)
"""Where the room's scenario begins."""


def seen_from(room: Room, start: Start) -> Room:
    """The room in the frame of a robot that begins elsewhere.

    Raises:
        BadInput: no way leads from there to the target.
    """
    if start == DRAWN:
        return room
    target = _thing(room.target, start)
    things = tuple(_thing(thing, start) for thing in room.things)
    circles = np.array([[thing.x, thing.y, thing.radius] for thing in things]).reshape(-1, 3)
    way = plan(np.array([target.x, target.y]), circles, body=BODY)
    if way is None:
        raise BadInput(
            f"no way leads from {tuple(start)} to the target", where=f"room {room.number}", remedy="start elsewhere"
        )
    (x, y), cos, sin = _place((room.hall.x, room.hall.y), start), math.cos(start.yaw), math.sin(start.yaw)
    directions = tuple((cos * a + sin * b, cos * b - sin * a, c) for a, b, c in room.light.directions)
    return replace(
        room,
        hall=replace(room.hall, x=x, y=y, yaw=room.hall.yaw - start.yaw),
        target=target,
        things=things,
        people=tuple(_person(person, start) for person in room.people),
        light=Light(room.light.ambient, directions, room.light.colours),
        shortest=max(way.length - SUCCESS_RADIUS, 0.0),
    )


def drawn_places(places: Float[np.ndarray, "*rows 2"], start: Start) -> Float[np.ndarray, "*rows 2"]:
    """Places in the frame of a robot that begins elsewhere [m], in the frame that the room was drawn in."""
    cos, sin = math.cos(start.yaw), math.sin(start.yaw)
    return places @ np.array([[cos, sin], [-sin, cos]]) + np.array([start.x, start.y])


def some_start(room: Room, draw: np.random.Generator) -> Start:
    """A free place in the room, facing anywhere, from which a way leads to the target; else where it was drawn."""
    (a, b), circles = room.hall.half, room.circles
    cos, sin = math.cos(room.hall.yaw), math.sin(room.hall.yaw)
    for _ in range(_TRIES):
        u, v = (draw.uniform(-1.0, 1.0, 2) * np.array([a, b])).tolist()
        place = np.array([room.hall.x + cos * u - sin * v, room.hall.y + sin * u + cos * v])
        free = np.hypot(*(circles[:, :2] - place).T) - circles[:, 2] >= np.array([_FAR, *[_FREE] * (len(circles) - 1)])
        if not free.all() or room.hall.inside(place) < _FREE:
            continue
        start = Start(float(place[0]), float(place[1]), float(draw.uniform(-math.pi, math.pi)))
        end, things = np.array([room.target.x, room.target.y]), circles[1 : len(room.standing)]
        way = plan(end, things, body=BODY, start=place)
        if way is not None and (room.hall.inside(way.points) >= BODY).all():
            return start
    return DRAWN


def _place(place: tuple[float, float], start: Start) -> tuple[float, float]:
    x, y, cos, sin = place[0] - start.x, place[1] - start.y, math.cos(start.yaw), math.sin(start.yaw)
    return cos * x + sin * y, cos * y - sin * x


def _thing(thing: Thing, start: Start) -> Thing:
    x, y = _place((thing.x, thing.y), start)
    return replace(thing, x=x, y=y, yaw=thing.yaw - start.yaw)


def _person(person: Person, start: Start) -> Person:
    a, b, c = (_place(point, start) for point in person.points)
    return replace(person, looks=_thing(person.looks, start), points=(a, b, c))
