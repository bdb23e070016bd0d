"""A walk in physics, watched: every tick is recorded, now and then filmed and told; it can be stopped at any time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from itertools import islice

from toddle.outside.simulation.disturbances import TICK
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.outside.teleoperation.commands import Source, follow
from toddle.outside.video import FRAMES
from toddle.outside.walk_record import Recorder
from toddle.signals import Velocity
from toddle.walk.loop import Moment, walk
from toddle.walk.scenarios import Leg
from toddle.walk.walker import Walker

FILMED = 60.0
"""A film holds so much of the beginning of a walk [s]."""

_LOOK = 10  # ticks between two looks at the truth
_FRAME = round(1 / (FRAMES * TICK))  # ticks between two pictures
_WARM = 130  # ticks, in which everything is called once


class Watch:
    """Observes the moments of a walk.

    Attributes:
        wall: what walker and physics took so far, without recording and pictures [s].
    """

    def __init__(self, recorder: Recorder, simulation: HumanoidSimulation) -> None:
        self.wall = 0.0
        self._recorder, self._simulation = recorder, simulation

    def __call__(
        self,
        moments: Iterator[Moment],
        *,
        tell: Callable[[Moment], None],
        film: Callable[[], None] | None = None,
        real_time: Callable[[], bool] = lambda: False,
    ) -> None:
        """Watch a walk to its end.

        Args:
            moments: the walk.
            tell: is told of each moment.
            film: takes a picture, called `FRAMES` times a simulated second.
            real_time: whether to wait for the clock.
        """
        began = last = time.perf_counter()
        for number, moment in enumerate(moments, start=1):
            self.wall += time.perf_counter() - last
            self._recorder.add(moment)
            if number % _LOOK == 0:
                self._recorder.add_truth(moment.t, self._simulation.truth().waist)
            if film is not None and number % _FRAME == 0 and moment.t <= FILMED:
                film()
            tell(moment)
            if real_time():
                time.sleep(max(began + moment.t - time.perf_counter(), 0.0))
            last = time.perf_counter()


def warm_up(walker: Walker, simulation: HumanoidSimulation) -> None:
    """Call everything once, so that no compiler interrupts the walk; the robot stands at its start again."""
    source = follow((Leg(0.0, Velocity(0.05, 0.0, 0.0)),), _WARM * TICK)
    for _ in islice(walk(walker, simulation, source), _WARM):
        pass
    _ = simulation.reset()


class Heard:
    """A command source, and until when it commanded [s]."""

    def __init__(self, source: Source) -> None:
        self._source, self.until = source, 0.0

    def __call__(self, t: float) -> Velocity | None:
        """What the source asks for at a time [s]."""
        velocity = self._source(t)
        if velocity is not None:
            self.until = t + TICK
        return velocity
