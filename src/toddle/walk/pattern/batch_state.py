"""Thousands of walkers side by side: their states, plans and commands as arrays with a leading axis.

The records of `nmpc_problem` as pytrees of arrays, JAX's or NumPy's. How a plan is made stands in `batch`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from toddle.robots.humanoid import LEFT, RIGHT
from toddle.signals import Footstep
from toddle.walk.pattern.nmpc_problem import PlanState
from toddle.walk.pattern.plan import Status

STATUSES = tuple(Status)
"""What the numbers of ``BatchPlan.status`` stand for."""

PADDING = -1.0
"""A circle with a negative radius is none: walkers may have different numbers of obstacles."""


class BatchState(NamedTuple):
    """`PlanState` of each walker.

    Attributes:
        com: x and y of the centre of mass: position, velocity, acceleration [m, s].
        side: of the sole that carries: 0 left, 1 right.
        support: that sole: x, y [m], yaw [rad].
        lifted: where the other sole stood when this step began: x, y [m], yaw [rad].
        origin: where the ZMP was then [m].
        phase: time since this step began [s].
        remaining: until it ends [s].
        double_support: how long the weight takes to come over [s].
        halt: the walker stands after so many landings; 0: it stands; -1: it walks on.
    """

    com: Float[Any, "*walkers 2 3"]
    side: Int[Any, "*walkers"]
    support: Float[Any, "*walkers 3"]
    lifted: Float[Any, "*walkers 3"]
    origin: Float[Any, "*walkers 2"]
    phase: Float[Any, "*walkers"]
    remaining: Float[Any, "*walkers"]
    double_support: Float[Any, "*walkers"]
    halt: Int[Any, "*walkers"]


class BatchPlan(NamedTuple):
    """`Plan` of each walker.

    Attributes:
        feet: the landings to come: x, y [m], yaw [rad].
        displacement: of each landing from the one before [m].
        jerks: of x and y over the horizon [m/s^3]; the first is that until the next sample.
        zmp: reference at the samples [m].
        status: a place in `STATUSES`: solved, or why this is the last plan shifted.
        obstacle: a clearance decides the plan.
        violation: of the soft rows of balance, the greatest [m].
        overlap: of the soft clearance rows, the greatest [m].
        known: it may serve as the next iteration's last plan; false: there is none yet.
        state: it was made at.
    """

    feet: Float[Any, "*walkers steps 3"]
    displacement: Float[Any, "*walkers steps 2"]
    jerks: Float[Any, "*walkers 2 samples"]
    zmp: Float[Any, "*walkers samples 2"]
    status: Int[Any, "*walkers"]
    obstacle: Bool[Any, "*walkers"]
    violation: Float[Any, "*walkers"]
    overlap: Float[Any, "*walkers"]
    known: Bool[Any, "*walkers"]
    state: BatchState


def stacked(states: Sequence[PlanState], dtype: type[np.floating] = np.float32) -> BatchState:
    """Single states as one batch."""

    def numbers(rows: list) -> np.ndarray:
        return np.array(rows, dtype)

    return BatchState(
        numbers([s.com for s in states]),
        np.array([s.support.side for s in states], np.int32),
        numbers([s.support[1:] for s in states]),
        numbers([s.lifted[1:] for s in states]),
        numbers([s.origin for s in states]),
        numbers([s.phase for s in states]),
        numbers([s.remaining for s in states]),
        numbers([s.double_support for s in states]),
        np.array([s.halt for s in states], np.int32),
    )


def single(states: BatchState, index: int) -> PlanState:
    """The state of one walker."""
    side, halt = int(states.side[index]), int(states.halt[index])
    support, lifted, origin = (
        np.asarray(part[index], float).tolist() for part in (states.support, states.lifted, states.origin)
    )
    return PlanState(
        np.asarray(states.com[index], float),
        Footstep(side, *support),
        Footstep(RIGHT if side == LEFT else LEFT, *lifted),
        (origin[0], origin[1]),
        float(states.phase[index]),
        float(states.remaining[index]),
        float(states.double_support[index]),
        halt,
    )


def padded(circles: Sequence[np.ndarray], dtype: type[np.floating] = np.float32) -> np.ndarray:
    """Each walker's circles, filled up to the greatest number with none.

    Args:
        circles: centres and radii [m], some 3.
        dtype: of the answer.
    """
    filled = np.full((len(circles), max((len(some) for some in circles), default=0), 3), PADDING, dtype)
    for row, some in zip(filled, circles, strict=True):
        row[: len(some)] = some
    return filled
