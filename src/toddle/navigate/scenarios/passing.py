"""People who walk through a room: along their points, standing a while at the second one, never into the robot."""

from __future__ import annotations

import math
from typing import NamedTuple

from toddle.navigate.scenarios.furniture import PERSON_RADIUS
from toddle.navigate.scenarios.rooms import Person

ARM = 0.30
"""So far from the robot's waist a person's circle stops [m]."""


class Stride(NamedTuple):
    """Where a person is in the walk.

    Attributes:
        x: [m].
        y: [m].
        towards: which of the points comes next; 3: the walk has ended.
        stood: at the second point [s].
        going: whether the person has set off.
    """

    x: float
    y: float
    towards: int
    stood: float
    going: bool


def enter(person: Person) -> Stride:
    """The person at the first point."""
    (x, y), *_ = person.points
    return Stride(x, y, 1, 0.0, math.isinf(person.trigger))


def step(person: Person, stride: Stride, robot: tuple[float, float], dt: float) -> Stride:
    """The person a moment later.

    A person who would come nearer than `ARM` to the robot's waist stands still until the robot is gone; one who stands
    so near and would go away, goes.

    Args:
        person: who.
        stride: before.
        robot: its waist, x, y [m].
        dt: time [s].
    """
    second = person.points[1]
    if not stride.going:
        return stride._replace(going=math.dist(robot, second) <= person.trigger)
    if stride.towards == 2 and stride.stood < person.wait:
        return stride._replace(stood=stride.stood + dt)
    if stride.towards > 2:
        return stride
    goal = person.points[stride.towards]
    left, way = math.dist((stride.x, stride.y), goal), person.speed * dt
    share = min(way / max(left, 1e-9), 1.0)
    x, y = stride.x + share * (goal[0] - stride.x), stride.y + share * (goal[1] - stride.y)
    near = math.dist((x, y), robot)
    if near < ARM + PERSON_RADIUS and near < math.dist((stride.x, stride.y), robot):
        return stride
    return stride._replace(x=x, y=y, towards=stride.towards + (left <= way))
