"""A driver that is jolted now and then, so that its teacher shows how to get back on the way (Laskey et al. 2017)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from toddle.navigate.driver import Driver, Situation
from toddle.signals import Velocity

_BETWEEN = 4.0  # from the end of a jolt to the next one, on average [s]
_LASTS = 0.6, 1.6  # [s]
_AHEAD, _TURN = 0.12, 0.25  # greatest jolt of size 1 [m/s, rad/s]


class Jolt(NamedTuple):
    """What a jolted driver remembers.

    Attributes:
        own: what the driver itself does.
        number: of the last jolt, or the next.
        begins: of the last one, or the next [s].
        ends: likewise.
        ahead: what it adds [m/s].
        turn: likewise [rad/s].
    """

    own: Any
    number: int
    begins: float
    ends: float
    ahead: float
    turn: float


@dataclass(frozen=True)
class Noisy:
    """Whatever the driver asks for, plus jolts.

    Attributes:
        driver: who steers.
        size: of the jolts; 1: up to 0.12 m/s and 0.25 rad/s.
        seed: of the jolts.
    """

    driver: Driver
    size: float
    seed: int

    @property
    def period(self) -> float:
        """The driver's [s]."""
        return self.driver.period

    def start(self) -> Jolt:
        """The driver's own memory; the first jolt is still to come."""
        return self._next(Jolt(self.driver.start(), 0, 0.0, 0.0, 0.0, 0.0))

    def decide(self, memory: Jolt, situation: Situation) -> tuple[Velocity | None, Jolt]:
        """What the driver says, jolted."""
        velocity, own = self.driver.decide(memory.own, situation)
        memory = memory._replace(own=own)
        if velocity is None or situation.t < memory.begins:
            return velocity, memory
        if situation.t >= memory.ends:
            return velocity, self._next(memory)
        return Velocity(velocity.vx + memory.ahead, velocity.vy, velocity.omega + memory.turn), memory

    def _next(self, memory: Jolt) -> Jolt:
        draw = np.random.default_rng([self.seed, memory.number])
        begins = memory.ends + draw.exponential(_BETWEEN)
        ahead, turn = (self.size * draw.uniform(-1.0, 1.0, 2) * np.array([_AHEAD, _TURN])).tolist()
        return Jolt(memory.own, memory.number + 1, begins, begins + draw.uniform(*_LASTS), ahead, turn)
