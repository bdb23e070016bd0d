"""A person as a driver who sees what the robot sees, in real time: a picture on the terminal, keys for the stick."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from toddle.failures import BadInput
from toddle.navigate.driver import Situation
from toddle.navigate.sight import PERIOD, Sight
from toddle.outside.teleoperation.keys import Keyboard
from toddle.outside.teleoperation.seen import Seen, nearest
from toddle.signals import Velocity

_KEYS = "w s faster, slower   a d turn   , . sideways   + - more, less   space stop   q quit"
_THIRDS = "left", "ahead", "right"


@dataclass(frozen=True, eq=False)
class Person:
    """A `toddle.navigate.driver.Driver` who looks at a screen and presses keys.

    Attributes:
        keyboard: what the person presses; open.
        seen: what the person looks at; open.
        order: what is to be done.
        sleep: waits for the clock [s].
        clock: the time [s].
        period: between two looks [s].
    """

    keyboard: Keyboard
    seen: Seen
    order: str
    sleep: Callable[[float], None] = time.sleep
    clock: Callable[[], float] = time.monotonic
    period: float = PERIOD

    def start(self) -> float:
        """When the drive began on the clock; not yet."""
        return math.inf

    def decide(self, memory: float, situation: Situation) -> tuple[Velocity | None, float]:
        """Waits until it is time, shows what the robot sees, and hears the keys; None: the person has quit.

        What was late is not made up for: the robot never walks faster than the clock.

        Raises:
            BadInput: nobody looks.
        """
        if situation.sight is None:
            raise BadInput("nobody looks", where="person", remedy="give the robot eyes")
        now = self.clock()
        begun = now - situation.t if math.isinf(memory) else max(memory, now - situation.t)
        if begun + situation.t > now:
            self.sleep(begun + situation.t - now)
        self.seen.show(situation.sight, self._lines(situation, situation.sight))
        return self.keyboard(situation.t), begun

    def _lines(self, situation: Situation, sight: Sight) -> tuple[str, ...]:
        asked, walks = self.keyboard.velocity, situation.velocity
        parts = np.array_split(nearest(sight.depth), 3)
        near = (
            f"{name} {np.nanmin(part):.1f} m" if np.isfinite(part).any() else f"{name} -"
            for name, part in zip(_THIRDS, parts, strict=True)
        )
        said = f"{situation.t:5.1f} s   asked {_velocity(asked)}   walks {_velocity(walks)}"
        return (said, f"nearest: {', '.join(near)}", self.order, _KEYS)


def _velocity(velocity: Velocity) -> str:
    return f"{velocity.vx:+.2f} {velocity.vy:+.2f} m/s {velocity.omega:+.2f} rad/s"
