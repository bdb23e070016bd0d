"""The linear inverted pendulum, seen through its divergent component of motion (DCM) xi = c + v / omega.

A step lasts T: the zero moment point (ZMP) goes from the previous foot to the stance foot, D away, in a straight
line during double support Tds, and stays there. With E = exp(omega T) the DCM, measured from the foot that the ZMP is
leaving, obeys b_next = E b - k D, so that b = (k D + b_next) / E, backwards from the last previewed step (after
Englsberger 2015, the double support in closed form). Plain arithmetic on pairs (x, y): one robot at 100 Hz.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

Pair = tuple[float, float]


class Timing(NamedTuple):
    """What a step's duration makes of its displacement: ``b = (k D + b_next) / growth``."""

    growth: float
    k: float


def timing(omega: float, step_time: float, double_support: float) -> Timing:
    """E and k of one whole step of ``step_time`` [s], of which ``double_support`` [s]."""
    growth = math.exp(omega * step_time)
    if double_support <= 0:
        return Timing(growth, growth)
    return Timing(growth, (growth - math.exp(omega * (step_time - double_support))) / (omega * double_support))


def offset(step: Timing, displacements: Sequence[Pair]) -> Pair:
    """DCM at the start of a step, from the foot that the ZMP is leaving [m]; after the last one it is at rest."""
    x = y = 0.0
    for dx, dy in reversed(displacements):
        x = (step.k * dx + x) / step.growth
        y = (step.k * dy + y) / step.growth
    return x, y


def ramp(omega: float, displacement: Pair, remaining: float, double_support: float) -> Pair:
    """What the DCM, measured from the stance foot, is short of because the ZMP is still on its way there [m].

    Without its remaining double support a step would end the same if the DCM stood at ``xi - ramp`` now.

    Args:
        omega: of the pendulum [rad/s].
        displacement: from the previous foot to the stance foot [m].
        remaining: of the double support [s].
        double_support: the whole of it [s].
    """
    if remaining <= 0 or double_support <= 0:
        return 0.0, 0.0
    share = (remaining - (1 - math.exp(-omega * remaining)) / omega) / double_support
    return -displacement[0] * share, -displacement[1] * share


def advance(omega: float, position: float, velocity: float, zmp: float, dt: float) -> Pair:
    """Position [m] and velocity [m/s] of the pendulum after ``dt`` [s] over a resting ZMP [m]."""
    cosh, sinh = math.cosh(omega * dt), math.sinh(omega * dt)
    ahead = position - zmp
    return zmp + cosh * ahead + sinh / omega * velocity, omega * sinh * ahead + cosh * velocity
