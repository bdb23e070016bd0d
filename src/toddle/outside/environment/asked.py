"""What may be asked of the environment: checked before anything moves."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from toddle.failures import BadInput
from toddle.outside.environment import WALK
from toddle.outside.simulation.disturbances import SILENT, TICK, WorldOptions
from toddle.signals import Velocity

Numbers = ArrayLike | tuple[float | int, ...]
"""What may be given for an array; to a runtime checker a tuple is no ``ArrayLike``."""


def whole_ticks(seconds: float) -> int:
    """How many ticks of the control loop a time is.

    Raises:
        BadInput: it is no whole number of them, or none.
    """
    ticks = seconds / TICK
    if not (math.isfinite(ticks) and ticks > 0.5 and abs(ticks - round(ticks)) < 1e-9):
        raise BadInput(f"{seconds} s is no multiple of {TICK:g} s", where=f"{WALK}, step_seconds", remedy="round it")
    return round(ticks)


def velocity_of(numbers: Numbers, what: str, fastest: Velocity | None = None) -> Velocity:
    """Three numbers as a velocity.

    Args:
        numbers: ahead, to the left [m/s], turning left [rad/s].
        what: they are for.
        fastest: that may be asked for, each way; None: anything finite.

    Raises:
        BadInput: these are no three finite numbers, or they are too fast.
    """
    where = f"{WALK}, {what}"
    try:
        array = np.asarray(numbers, float)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != (3,) or not np.isfinite(array).all():
        remedy = "give three finite numbers: ahead [m/s], to the left [m/s], turning left [rad/s]"
        raise BadInput(f"{numbers!r} is no velocity", where=where, remedy=remedy)
    if fastest is not None and (np.abs(array) > np.array(fastest) + _ROUNDING).any():
        most = ", ".join(f"{number:g}" for number in fastest)
        raise BadInput(f"{numbers!r} is too fast", where=where, remedy=f"at most {most}, each way")
    return Velocity(*array.tolist())


_ROUNDING = 1e-6  # of a number that was a float32


def draws(world: WorldOptions) -> bool:
    """Whether a world is another one by another seed."""
    return world.noise != SILENT or world.bias != SILENT or bool(world.bumps or world.mass_error)
