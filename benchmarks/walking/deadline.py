"""Late plans: the predictive controller misses its deadline at every second iteration, standing and walking slowly."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import count

from benchmarks.walking.campaign import Case, Part, Row
from benchmarks.walking.physics import figures, simulation_of, steady, stroll, walker_of
from benchmarks.walking.walks import ROBOT, summary
from toddle.outside.simulation.disturbances import WorldOptions
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.robots.gait import Gait
from toddle.signals import Circle, Senses, Velocity
from toddle.walk.balance.support import Corners
from toddle.walk.config import TICK, WalkConfig
from toddle.walk.loop import Moment
from toddle.walk.state import Action, WalkerState
from toddle.walk.walker import Walker


@dataclass(frozen=True)
class EverySecondLate:
    """Walks as a walker does whose every second plan misses its deadline.

    A tick is a pure function, so a tick in which a plan was made in time is done over with a deadline of 0 ms.

    Attributes:
        walker: in time.
        late: the same with a deadline of 0 ms.
        plans: counts them.
    """

    walker: Walker
    late: Walker
    plans: Iterator[int] = field(default_factory=count)

    @property
    def gait(self) -> Gait:
        """How it steps."""
        return self.walker.gait

    def start(self) -> WalkerState:
        """Standing at home."""
        return self.walker.start()

    def step(
        self, state: WalkerState, velocity: Velocity, senses: Senses, circles: tuple[Circle, ...] = ()
    ) -> tuple[WalkerState, Action]:
        """One tick of 10 ms."""
        found = self.walker.step(state, velocity, senses, circles)
        if found[1].plan is not None and next(self.plans) % 2:
            return self.late.step(state, velocity, senses, circles)
        return found

    def area(self, state: WalkerState) -> Corners:
        """The area of the soles that stand."""
        return self.walker.area(state)


def deadlines(quick: bool) -> list[Case]:
    directions = (90,) if quick else tuple(range(0, 360, 45))
    pushed = [
        {"name": f"standing, {impulse} N.s, {degrees} deg", "impulse": impulse, "direction": degrees, "speed": 0.0}
        for impulse in ((6,) if quick else (4, 6))
        for degrees in directions
    ]
    seconds = 8.0 if quick else 60.0
    return [
        *(case | {"seconds": 8.0} for case in pushed),
        {"name": "walking 0.05", "speed": 0.05, "impulse": 0, "direction": 0, "seconds": seconds},
    ]


def run_deadline(case: Case) -> Row:
    walks = EverySecondLate(walker_of(ROBOT, WalkConfig()), walker_of(ROBOT, WalkConfig(deadline_ms=0.0)))

    def watch(moment: Moment, simulation: HumanoidSimulation) -> bool:
        if case["impulse"] and moment.t < 1.5 * TICK:
            simulation.push(case["impulse"], math.radians(case["direction"]), start=1.0)
        return False

    commands = steady((case["speed"], 0.0, 0.0))
    return figures(stroll(walks, simulation_of(ROBOT, WorldOptions()), commands, case["seconds"], watcher=watch), walks)


PARTS = (
    Part("deadline", "every second plan is late", deadlines, run_deadline, summary, ("fell", "plans", "fallbacks")),
)
