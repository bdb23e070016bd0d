"""What a walking pattern is to who steers it: a value with three functions, so that nothing here knows how to walk."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from jaxtyping import Array, Float


@dataclass(frozen=True, eq=False)
class Walks:
    """A walker in the plane, for tasks in JAX; every function takes and gives one walker, and can be mapped.

    Attributes:
        name: of the robot.
        fastest: greatest velocity ahead, aside [m/s] and turning [rad/s] that may be asked for.
        slowest: greatest velocity backwards, below 0 [m/s].
        seconds: one call of ``advance`` lasts so long [s].
        start: the state in which it stands at the origin, facing x.
        advance: from a state, a velocity asked for (vx, vy [m/s], omega [rad/s]) and obstacles that it is told of
            (x, y, radius [m], in the frame of its start; a negative radius for none) to the next state.
        place: x, y [m] and yaw [rad] of the robot in a state.
        velocity: what the safety gate let through last: vx, vy [m/s], omega [rad/s].
        fallen: whether the pattern has broken down.
    """

    name: str
    fastest: tuple[float, float, float]
    slowest: float
    seconds: float
    start: Callable[[], Any]
    advance: Callable[[Any, Float[Array, "3"], Float[Array, "circles 3"]], Any]
    place: Callable[[Any], Float[Array, "3"]]
    velocity: Callable[[Any], Float[Array, "3"]]
    fallen: Callable[[Any], Array]
