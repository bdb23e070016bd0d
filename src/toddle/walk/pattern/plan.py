"""What every form of the walking pattern is: a state, and a step that adds one interval of the plan to it.

A pattern has no clock, no body and no swing foot: it says how the centre of mass moves until the next iteration, on
which sole, and where the other one is to land. The feet between (`trajectory`) are the same for all forms.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from typing import NamedTuple, Protocol, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import Float

from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT, RIGHT
from toddle.signals import Circle, Footstep, Velocity

State = TypeVar("State")


class Status(StrEnum):
    """How an iteration ended; every other one than SOLVED walks on by the shifted last plan."""

    SOLVED = "solved"
    INFEASIBLE = "infeasible"
    LATE = "late"
    NOT_FINITE = "not finite"


class Interval(NamedTuple):
    """The plan until the next iteration.

    Attributes:
        duration: [s].
        com: x and y of the centre of mass at the beginning: position, velocity, acceleration [m, s].
        jerk: of x and y, constant [m/s^3].
        support: the sole that carries.
        landing: where and when done, the other sole; None: both stand.
        elapsed: since this step began, double support included, at the interval's beginning [s].
        left: until this step ends, at the interval's beginning [s].
        status: how the iteration ended.
        milliseconds: it took, assembly and solver, wall clock.
    """

    duration: float
    com: Float[np.ndarray, "2 3"]
    jerk: Float[np.ndarray, "2"]
    support: Footstep
    landing: Footstep | None
    elapsed: float
    left: float
    status: Status
    milliseconds: float


@runtime_checkable
class Pattern(Protocol[State]):
    """A form of the walking pattern. The state is returned, never kept."""

    def start(self) -> State:
        """Standing, about to walk."""
        ...

    def step(self, state: State, velocity: Velocity, obstacles: Sequence[Circle]) -> tuple[State, Interval]:
        """One iteration.

        Args:
            state: where the last one ended.
            velocity: commanded.
            obstacles: circles that no sole may enter.
        """
        ...


def standing(gait: Gait) -> tuple[Footstep, Footstep]:
    """Left and right sole before the first step, side by side, both looking along x."""
    x, y = gait.first or (0.0, gait.foot_distance / 2)
    return Footstep(LEFT, x, y, 0.0), Footstep(RIGHT, x, y - gait.foot_distance, 0.0)


def com_at_start(gait: Gait) -> Float[np.ndarray, "2 3"]:
    """The centre of mass at rest: x and y; position, velocity, acceleration [m, s]."""
    left, right = standing(gait)
    x, y = gait.start or ((left.x + right.x) / 2, (left.y + right.y) / 2)
    return np.array([[x, 0.0, 0.0], [y, 0.0, 0.0]])
