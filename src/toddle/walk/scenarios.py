"""The walks that have a name: a velocity over time, how long, and what stands in the way; frozen records.

After the tasks of Huber 2019, sections 4.1.1 and 4.1.2: straight, curved, turned, around an obstacle.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from typing import NamedTuple

from toddle.failures import unknown_name
from toddle.signals import STILL, Circle, Velocity


class Leg(NamedTuple):
    """From time ``t`` [s] on, this velocity, until the next leg."""

    t: float
    velocity: Velocity


def velocity_at(legs: tuple[Leg, ...], t: float) -> Velocity:
    """The velocity that legs in the order of time ask for at one time [s]; before the first one, to stand."""
    index = bisect_right(legs, t + _EARLY, key=lambda leg: leg.t)
    return legs[index - 1].velocity if index else STILL


_EARLY = 1e-9  # [s]; ticks that were added up meet the time that they mean


@dataclass(frozen=True)
class Scenario:
    """A walk that has a name.

    Attributes:
        name: how it is called on the command line.
        about: one line for the listing.
        legs: velocities over time.
        seconds: how long it is commanded [s].
        circles: obstacles on the floor, in the frame in which the robot starts, facing x.
    """

    name: str
    about: str
    legs: tuple[Leg, ...]
    seconds: float = 20.0
    circles: tuple[Circle, ...] = ()


SCENARIOS = {
    scenario.name: scenario
    for scenario in (
        Scenario("straight", "straight ahead", (Leg(0.0, Velocity(0.1, 0.0, 0.0)),)),
        Scenario("sideways", "to the left, facing ahead", (Leg(0.0, Velocity(0.0, 0.1, 0.0)),)),
        Scenario("curve", "ahead and turning left", (Leg(0.0, Velocity(0.1, 0.0, 0.1)),)),
        Scenario("turn", "turning left in place", (Leg(0.0, Velocity(0.0, 0.0, 0.2)),)),
        Scenario("diagonal", "ahead and to the left", (Leg(0.0, Velocity(0.1, 0.05, 0.0)),)),
        Scenario(
            "obstacle",
            "straight on past a cylinder beside the line",
            (Leg(0.0, Velocity(0.15, 0.0, 0.0)),),
            circles=(Circle(1.2, 0.3, 0.1),),
        ),
        Scenario(
            "stop-and-go",
            "five seconds of walking, five of standing",
            tuple(Leg(5.0 * half, STILL if half % 2 else Velocity(0.15, 0.0, 0.0)) for half in range(4)),
        ),
    )
}
"""Every scenario by its name."""


def scenario_named(name: str) -> Scenario:
    """The scenario of that name.

    Raises:
        BadInput: there is none.
    """
    if name not in SCENARIOS:
        raise unknown_name("scenario", name, SCENARIOS, where="--scenario")
    return SCENARIOS[name]
