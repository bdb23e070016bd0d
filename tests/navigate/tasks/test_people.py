"""People keep to their room and their speed, and pay no heed to the robot."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from toddle.navigate.tasks.people import FASTEST, RADIUS, SLOWEST, People, Room, enter, walk

ROOM = Room(jnp.array([1.0, -0.5]), jnp.array(1.5))
DT = 0.1


def walked(seed: int, count: int, steps: int) -> People:
    """Everybody at each step, the first ones as they entered."""

    def once(people: People, key: jax.Array) -> tuple[People, People]:
        return walk(people, key, ROOM, DT), people

    first, keys = jax.random.split(jax.random.key(seed))
    return jax.lax.scan(once, enter(first, ROOM, count, 0.8), jax.random.split(keys, steps))[1]


def test_people_stay_in_the_room_and_never_exceed_their_speed() -> None:
    people = walked(0, 20, 600)
    off = np.abs(np.asarray(people.place) - np.asarray(ROOM.middle))
    assert off.max() <= 1.5 + 1e-5
    stride = np.linalg.norm(np.diff(np.asarray(people.place), axis=0), axis=-1)
    speed = np.asarray(people.speed[0])
    assert ((speed >= SLOWEST) & (speed <= FASTEST)).all()
    assert (stride <= speed * DT + 1e-5).all()


def test_people_walk_at_their_speed_but_for_the_turns() -> None:
    people = walked(1, 20, 600)
    stride = np.linalg.norm(np.diff(np.asarray(people.place), axis=0), axis=-1)
    full = np.abs(stride - np.asarray(people.speed[0]) * DT) < 1e-4
    assert full.mean() > 0.95
    turns = (np.diff(np.asarray(people.towards), axis=0) != 0).any(axis=-1).sum(axis=0)
    assert (turns > 0).all()


def test_who_arrives_stands_at_the_way_point_and_gets_another_one() -> None:
    before = People(jnp.array([[0.0, 0.0], [0.0, 0.0]]), jnp.array([[0.01, 0.0], [1.0, 0.0]]), jnp.array([0.2, 0.2]))
    after = walk(before, jax.random.key(0), ROOM, DT)
    np.testing.assert_allclose(after.place, [[0.01, 0.0], [0.02, 0.0]], atol=1e-7)
    assert (after.towards[0] != before.towards[0]).all()
    assert (after.towards[1] == before.towards[1]).all()


def test_nobody_enters_upon_the_robot_if_there_is_room() -> None:
    everybody = jax.vmap(lambda key: enter(key, ROOM, 5, 0.8).place)(jax.random.split(jax.random.key(0), 200))
    assert (jnp.linalg.norm(everybody, axis=-1) >= 0.8).mean() > 0.999


def test_as_obstacles_they_are_circles() -> None:
    people = walked(2, 3, 1)
    circles = np.asarray(jax.tree.map(lambda part: part[0], people).circles)
    np.testing.assert_array_equal(circles[:, :2], people.place[0])
    np.testing.assert_allclose(circles[:, 2], RADIUS)


def test_nobody_is_nobody() -> None:
    assert walked(0, 0, 2).place.shape == (2, 0, 2)
