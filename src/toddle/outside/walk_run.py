"""A walk in physics, watched: every tick is recorded, now and then filmed and told; it can be stopped at any time."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

from toddle.outside.simulation.disturbances import TICK
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.outside.simulation.pictures import Camera
from toddle.outside.teleoperation.commands import Source, follow
from toddle.outside.video import Film
from toddle.outside.walk_record import Recorder
from toddle.signals import Velocity
from toddle.walk.loop import Moment, Walks, walk
from toddle.walk.scenarios import Leg

_FRAMES, _FRAMES_SLOW = 25, 12  # pictures a second
_BEGINNING = 20.0  # of a walk [s]
_QUICK = 0.02  # for a picture [s]; where it takes longer, no graphics card draws
_LARGE, _SMALL = (960, 540), (640, 360)  # pixels

_LOOK = 10  # ticks between two looks at the truth
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
        film: Callable[[float], None] = lambda _: None,
        real_time: Callable[[], bool] = lambda: False,
    ) -> None:
        """Watch a walk to its end.

        Args:
            moments: the walk.
            tell: is told of each moment.
            film: takes a picture, if it is time.
            real_time: whether to wait for the clock.
        """
        began = last = time.perf_counter()
        for number, moment in enumerate(moments, start=1):
            self.wall += time.perf_counter() - last
            self._recorder.add(moment)
            if number % _LOOK == 0:
                self._recorder.add_truth(moment.t, self._simulation.truth().waist)
            film(moment.t)
            tell(moment)
            if real_time():
                time.sleep(max(began + moment.t - time.perf_counter(), 0.0))
            last = time.perf_counter()


class Filming:
    """Films a simulation: all of it in full, or, where nobody asked, its beginning as fast as can be drawn.

    Within ``with``; afterwards the film lies under its name, or nothing does.
    """

    def __init__(self, simulation: HumanoidSimulation, path: Path, *, full: bool) -> None:
        """Try out how fast pictures come.

        Raises:
            ToddleError: nothing here can draw.
        """
        self._camera = Camera(simulation, *_LARGE)
        _ = self._camera.picture()  # the first one takes longer
        began = time.perf_counter()
        _ = self._camera.picture()
        slow = not full and time.perf_counter() - began > _QUICK
        if slow:
            self._camera.close()
            self._camera = Camera(simulation, *_SMALL, shadows=False)
        rate = _FRAMES_SLOW if slow else _FRAMES
        self._between, self._until = 1 / rate, math.inf if full else _BEGINNING
        self._film, self._next = Film(path, rate), 0.0

    def __enter__(self) -> Filming:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._camera.close()
        if kind is None:
            self._film.close()
        else:
            self._film.drop()

    def __call__(self, t: float) -> None:
        """Take a picture, if it is time [s] for one."""
        if self._next <= t + TICK / 2 and t <= self._until:
            self._next += self._between
            self._film.add(self._camera.picture())


def warm_up(walker: Walks[Any], simulation: HumanoidSimulation) -> None:
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
