"""The guide around cylinders as a driver: it plans the shortest way again whenever what stands in it has changed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from toddle.navigate.driver import Situation
from toddle.signals import STILL, Circle, Velocity
from toddle.walk.guide import Guide, guide


class Way(NamedTuple):
    """What it remembers: the way, and between which circles to which goal it was planned."""

    circles: tuple[Circle, ...]
    goal: tuple[float, float]
    guide: Guide


@dataclass(frozen=True)
class Guided:
    """Leads around circles to the goal (`toddle.walk.guide`).

    Attributes:
        speed: ahead where the way is straight [m/s].
        fastest_turn: yaw rate [rad/s].
        clearance: of the robot's middle to an obstacle [m].
        near: so near to the goal it ends [m].
        period: how often it is asked [s].
    """

    speed: float = 0.2
    fastest_turn: float = 0.3
    clearance: float = 0.4
    near: float = 0.1
    period: float = 0.1

    def start(self) -> None:
        """No way is planned yet."""

    def decide(self, memory: Way | None, situation: Situation) -> tuple[Velocity | None, Way | None]:
        """The velocity along the shortest way; None where the goal is reached. While somebody stands on it: to wait."""
        if any(math.hypot(c.x - situation.goal[0], c.y - situation.goal[1]) <= c.radius for c in situation.circles):
            return STILL, memory
        if memory is None or (memory.circles, memory.goal) != (situation.circles, situation.goal):
            planned = guide(
                situation.circles,
                situation.goal,
                speed=self.speed,
                fastest_turn=self.fastest_turn,
                clearance=self.clearance,
                near=self.near,
            )
            memory = Way(situation.circles, situation.goal, planned)
        return memory.guide(situation.place), memory
