"""A robot without legs that is steered like the walker: for tests, quick tries, and as a surrogate to learn on.

It obeys the walker's safety gate (caps, an ellipse for ahead and aside, limited changes), and its velocity follows the
one let through with a lag of the first order. It neither sways nor falls, and does not heed obstacles it is told of.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from toddle.failures import BadInput
from toddle.navigate.walks import Walks


class Rolling(NamedTuple):
    """The state of a unicycle.

    Attributes:
        place: x, y [m] and yaw [rad].
        velocity: what the gate let through last: vx, vy [m/s], omega [rad/s], in the robot's frame.
        moving: its own velocity, in the same units and frame.
    """

    place: Float[Array, "3"]
    velocity: Float[Array, "3"]
    moving: Float[Array, "3"]


def unicycle(
    fastest: tuple[float, float, float] = (0.3, 0.1, 0.3),
    *,
    backwards: float = 0.4,
    seconds: float = 0.1,
    acceleration: float = 0.3,
    turning: float = 0.6,
    lag: float = 0.4,
) -> Walks:
    """An ideal unicycle.

    Args:
        fastest: greatest velocity ahead, aside [m/s] and turning [rad/s].
        backwards: share of the fastest walk ahead that is allowed backwards.
        seconds: one step [s].
        acceleration: the fastest that the velocity let through changes [m/s^2].
        turning: the same of the yaw rate [rad/s^2].
        lag: time constant of its own velocity behind the one let through [s]; 0: none.

    Raises:
        BadInput: a number that is no use.
    """
    numbers = {"backwards": backwards, "seconds": seconds, "acceleration": acceleration, "turning": turning}
    named = {f"unicycle, {name}": value for name, value in numbers.items()}
    named |= {f"unicycle, fastest[{place}]": value for place, value in enumerate(fastest)}
    for where, value in named.items():
        if not (math.isfinite(value) and value > 0):
            raise BadInput(f"{value} is no use", where=where, remedy="give a number above 0")
    if not (math.isfinite(lag) and lag >= 0):
        raise BadInput(f"{lag} is no use", where="unicycle, lag", remedy="give 0 or more seconds")
    changes = jnp.array([acceleration, acceleration, turning]) * seconds
    follows = 1.0 - math.exp(-seconds / lag) if lag else 1.0

    def start() -> Rolling:
        return Rolling(jnp.zeros(3), jnp.zeros(3), jnp.zeros(3))

    def advance(state: Rolling, asked: Float[Array, "3"], circles: Float[Array, "circles 3"]) -> Rolling:
        wanted = _allowed(asked, fastest, backwards)
        velocity = state.velocity + jnp.clip(wanted - state.velocity, -changes, changes)
        moving = state.moving + follows * (velocity - state.moving)
        return Rolling(_moved(state.place, moving * seconds), velocity, moving)

    return Walks(
        name="unicycle",
        fastest=fastest,
        slowest=-backwards * fastest[0],
        seconds=seconds,
        start=start,
        advance=advance,
        place=lambda state: state.place,
        velocity=lambda state: state.velocity,
        fallen=lambda state: jnp.zeros((), bool),
    )


def _allowed(asked: Float[Array, "3"], fastest: tuple[float, float, float], backwards: float) -> Float[Array, "3"]:
    """The command within its range, as the walker's safety gate has it; one that is not finite: to stand."""
    most = jnp.array(fastest)
    heard = jnp.where(jnp.isfinite(asked).all(), asked, jnp.zeros(3))
    vx, vy, omega = jnp.clip(heard, -most, most)
    vx = jnp.maximum(vx, -backwards * fastest[0])
    longest = jnp.where(vx > 0, fastest[0], backwards * fastest[0])
    share = 1.0 / jnp.maximum(jnp.hypot(vx / longest, vy / fastest[1]), 1.0)
    return jnp.stack([share * vx, share * vy, omega])


def _moved(place: Float[Array, "3"], step: Float[Array, "3"]) -> Float[Array, "3"]:
    """A place after a step in its own frame, along the arc through the mean yaw."""
    middle = place[2] + step[2] / 2
    cos, sin = jnp.cos(middle), jnp.sin(middle)
    return place + jnp.stack([cos * step[0] - sin * step[1], sin * step[0] + cos * step[1], step[2]])
