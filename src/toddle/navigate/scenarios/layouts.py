"""Seeded layouts: where the goal is, and which upright cylinders stand around, many of them in the way.

The robot starts at the origin and faces x; the goal may be ahead, behind or beside. A circle covers neither start nor
goal, and leaves room for the robot there. Whether a way is left between the circles is not asked here: see `planner`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

RADII = (0.1, 0.3)
"""Smallest and largest circle [m]."""

ROOM = 0.2
"""Between the robot's edge at the start and any circle, at least [m]; at the goal half of it."""

_BETWEEN = 0.8  # share of circles that are drawn between start and goal
_ASIDE = 0.4  # those lie so far to both sides of the straight way [m]
_AROUND = 1.0  # the others: in a square that reaches so far beyond start and goal [m]
_TRIES = 8  # circles drawn for each one; the first that leaves room is taken, or none


class Layout(NamedTuple):
    """Where to go, and what is in the way.

    Attributes:
        goal: x, y [m].
        circles: x, y, radius of each obstacle [m]; a negative radius for none.
    """

    goal: Float[Array | np.ndarray, "*layouts 2"]
    circles: Float[Array | np.ndarray, "*layouts circles 3"]


def layout(key: PRNGKeyArray, goal: tuple[float, float], circles: int, body: float) -> Layout:
    """One layout. Runs under ``jit`` and ``vmap``.

    Args:
        key: random.
        goal: how far away the goal is, at least and at most [m]; in any direction.
        circles: 0 to so many, each number as often.
        body: radius of the robot [m].
    """
    far, way, number, those = jax.random.split(key, 4)
    distance = jax.random.uniform(far, minval=goal[0], maxval=goal[1])
    angle = jax.random.uniform(way, minval=-math.pi, maxval=math.pi)
    end = distance * jnp.stack([jnp.cos(angle), jnp.sin(angle)])
    count = jax.random.randint(number, (), 0, circles + 1)
    drawn = jax.vmap(lambda one: _circle(one, end, body))(jax.random.split(those, circles))
    return Layout(end, jnp.where((jnp.arange(circles) < count)[:, None], drawn, jnp.array([[0.0, 0.0, -1.0]])))


def _circle(key: PRNGKeyArray, end: Float[Array, "2"], body: float) -> Float[Array, "3"]:
    """The first of some circles that leaves room at the start and at the goal; else none."""
    kind, size, along, around = jax.random.split(key, 4)
    radius = jax.random.uniform(size, (_TRIES,), minval=RADII[0], maxval=RADII[1])
    distance = jnp.hypot(end[0], end[1])
    ahead = end / distance
    share = jax.random.uniform(
        along, (_TRIES, 2), minval=jnp.array([[0.0, -_ASIDE]]), maxval=jnp.array([[1.0, _ASIDE]])
    )
    between = share[:, :1] * end[None] + share[:, 1:] * jnp.stack([-ahead[1], ahead[0]])[None]
    anywhere = end[None] / 2 + (distance / 2 + _AROUND) * jax.random.uniform(around, (_TRIES, 2), minval=-1.0)
    middle = jnp.where(jax.random.bernoulli(kind, _BETWEEN, (_TRIES, 1)), between, anywhere)
    from_start, from_end = (jnp.hypot(*(middle - point[None]).T) - radius - body for point in (jnp.zeros(2), end))
    good = (from_start >= ROOM) & (from_end >= ROOM / 2)
    first = jnp.argmax(good)
    return jnp.where(good[first], jnp.append(middle[first], radius[first]), jnp.array([0.0, 0.0, -1.0]))


def layouts(
    seed: int, count: int, *, circles: int = 5, goal: tuple[float, float] = (0.5, 3.0), body: float = 0.2
) -> Layout:
    """Many layouts as NumPy arrays, for tests: drawn as a task that is learned draws them.

    Args:
        seed: of the draw.
        count: of layouts.
        circles: 0 to so many in each.
        goal: how far away, at least and at most [m].
        body: radius of the robot [m].
    """
    keys = jax.random.split(jax.random.key(seed), count)
    drawn = jax.jit(jax.vmap(lambda key: layout(key, goal, circles, body)))(keys)
    return Layout(*(np.asarray(part) for part in drawn))
