"""People who walk: discs that go straight from one random way point to the next inside a square room.

They do not aim at the robot and do not evade it, nor circles: one who comes along has to be let by.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

RADIUS = 0.25
"""Of a person [m]."""

SLOWEST, FASTEST = 0.1, 0.4
"""Speeds of people [m/s]."""

_TRIES = 8  # places drawn for each person, the first that is clear of the robot is taken


class Room(NamedTuple):
    """A square on the floor, along the axes.

    Attributes:
        middle: x, y [m].
        half: of its side [m].
    """

    middle: Float[Array, "2"]
    half: Float[Array, ""]


class People(NamedTuple):
    """Where people are and where they go.

    Attributes:
        place: x, y [m].
        towards: the way point that each goes to [m].
        speed: of each [m/s].
    """

    place: Float[Array, "people 2"]
    towards: Float[Array, "people 2"]
    speed: Float[Array, " people"]

    @property
    def circles(self) -> Float[Array, "people 3"]:
        """As obstacles: x, y, radius [m]."""
        return jnp.column_stack([self.place, jnp.full(len(self.place), RADIUS, self.place.dtype)])


def enter(key: PRNGKeyArray, room: Room, count: int, clear: float) -> People:
    """People somewhere in the room.

    Args:
        key: random.
        room: where they walk.
        count: of people.
        clear: no nearer to the origin than this, if a few draws find such a place [m].
    """
    where, whither, how = jax.random.split(key, 3)
    places = _somewhere(where, room, (count, _TRIES))
    first = jnp.argmax(jnp.hypot(places[..., 0], places[..., 1]) >= clear, axis=1)
    place = jnp.take_along_axis(places, first[:, None, None], axis=1)[:, 0]
    speed = jax.random.uniform(how, (count,), minval=SLOWEST, maxval=FASTEST)
    return People(place, _somewhere(whither, room, (count,)), speed)


def walk(people: People, key: PRNGKeyArray, room: Room, dt: float) -> People:
    """Everybody one step on; who has arrived goes to a new way point.

    Args:
        people: before.
        key: random, for new way points.
        room: where the way points lie, so that people turn at its edge.
        dt: time [s].
    """
    way = people.towards - people.place
    left = jnp.hypot(way[:, 0], way[:, 1])
    arrived = left <= people.speed * dt
    share = jnp.where(arrived, 1.0, people.speed * dt / jnp.maximum(left, 1e-6))
    place = people.place + share[:, None] * way
    new = _somewhere(key, room, (len(left),))
    return People(place, jnp.where(arrived[:, None], new, people.towards), people.speed)


def _somewhere(key: PRNGKeyArray, room: Room, shape: tuple[int, ...]) -> Float[Array, "*shape 2"]:
    drawn = jax.random.uniform(key, (*shape, 2), minval=-1.0, maxval=1.0)
    return room.middle.reshape((1,) * len(shape) + (2,)) + room.half * drawn
