"""Command sources: at each tick, which velocity is asked for, or that the walk is over.

A source is called with the time [s] and answers with a `Velocity`, or with None once it has ended; the robot then
stops with both feet side by side. What a source says passes the safety gate before it reaches the pattern.
"""

from __future__ import annotations

from collections.abc import Callable

from toddle.signals import STILL, Velocity
from toddle.walk.scenarios import Leg, velocity_at

Source = Callable[[float], Velocity | None]

_AFTER_THE_LAST = 10.0


def follow(legs: tuple[Leg, ...], seconds: float) -> Source:
    """The velocities of a scenario or a script, for so long [s]."""

    def source(t: float) -> Velocity | None:
        return velocity_at(legs, t) if t < seconds else None

    return source


def until(stopped: Callable[[], bool], source: Source) -> Source:
    """The same source, which ends when somebody asks to stop."""

    def stoppable(t: float) -> Velocity | None:
        return None if stopped() else source(t)

    return stoppable


def script_seconds(legs: tuple[Leg, ...]) -> float:
    """How long a script is walked where nobody says [s]: a last line that moves holds for ten seconds more."""
    last = legs[-1]
    return last.t if last.velocity == STILL else last.t + _AFTER_THE_LAST
