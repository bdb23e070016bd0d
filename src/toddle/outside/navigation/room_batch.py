"""Many drives through rooms on the cores of this machine; the results are those of one process.

Each process loads the robot and makes the driver by itself, as in `toddle.outside.navigation.physics_batch`.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from multiprocessing import get_context
from typing import NamedTuple

from toddle.failures import ToddleError
from toddle.navigate.cloning.recording import Recording, RoomKey
from toddle.navigate.scenarios.draw_rooms import room
from toddle.navigate.scenarios.rooms import SCENARIOS, Scenario, Split, Style
from toddle.outside.navigation.physics_batch import Recipe
from toddle.outside.navigation.room_eyes import EyeOptions
from toddle.outside.navigation.room_run import RoomFinish, RoomRules, run_room
from toddle.outside.orphans import end_with_parent
from toddle.outside.simulation.disturbances import WorldOptions
from toddle.robots.humanoids import load_humanoid
from toddle.walk.walker import walker

_PATIENCE = 0.1  # between two looks whether to stop [s]


@dataclass(frozen=True)
class Judged:
    """How drives are driven and judged; all of it can be sent to a process.

    Attributes:
        recipe: makes robot and driver.
        eyes: how the robot sees; None: it is blind, which suits who steers by the truth.
        rules: how it is judged.
        world: friction, noise and so on, without circles.
        seed: the eyes' noise of a drive is that of ``seed`` and its room's number.
        kept: what was seen is handed back of the rooms below this number.
    """

    recipe: Recipe
    eyes: EyeOptions | None = None
    rules: RoomRules = field(default_factory=RoomRules)
    world: WorldOptions | None = None
    seed: int = 0
    kept: int = 0


class Drive(NamedTuple):
    """One drive: how it ended, and what was seen if that is kept."""

    finish: RoomFinish
    recording: Recording | None


def keys(
    count: int, scenarios: Sequence[Scenario] = SCENARIOS, split: Split = "test", style: Style = "seen", first: int = 0
) -> tuple[RoomKey, ...]:
    """Rooms ``first`` to ``first + count - 1`` of each scenario, the scenarios in turn."""
    return tuple(RoomKey(scenario, split, style, first + i) for i in range(count) for scenario in scenarios)


class _Worker:
    """What a process keeps between drives; made when the first one comes, so that its failure is that one's."""

    def __init__(self, how: Judged) -> None:
        self._how = how
        self._humanoid = load_humanoid(how.recipe.robot, how.recipe.config)
        self._driver = how.recipe.make(self._humanoid, *how.recipe.given)
        self._walker = walker(self._humanoid)

    def drive(self, key: RoomKey) -> Drive:
        """One drive."""
        how, seen = self._how, key.number < self._how.kept
        finish, recording = run_room(
            self._humanoid, self._driver, room(key.scenario, key.split, key.number, key.style),
            seed=how.seed + key.number, eyes=EyeOptions() if seen and how.eyes is None else how.eyes,
            rules=how.rules, world=how.world, before=self._walker,
        )  # fmt: skip
        return Drive(finish, recording if seen else None)


_told: list[Judged] = []  # a worker process was told
_own: list[_Worker] = []  # and made of it


def run_rooms(
    how: Judged,
    rooms: Sequence[RoomKey],
    *,
    processes: int | None = None,
    progress: Callable[[int, Drive], None] = lambda number, drive: None,
    stopped: Callable[[], bool] = lambda: False,
) -> tuple[Drive | None, ...]:
    """Every room once.

    Args:
        how: they are driven and judged.
        rooms: which.
        processes: how many; None: one for each core; 1: this one alone.
        progress: is told the number of each drive as it ends, and how, in the order in which they end.
        stopped: asked now and then; once it says so, no further drive begins.

    Returns:
        How each ended, in the order of the rooms; None: it was not driven.

    Raises:
        BadInput: a driver or a room that can't be used.
        ToddleError: a process was killed.
    """
    count = min(processes or len(os.sched_getaffinity(0)), len(rooms))
    found: dict[int, Drive] = {}
    if count <= 1:
        worker = _Worker(how)
        for number, key in enumerate(rooms):
            if stopped():
                break
            found[number] = worker.drive(key)
            progress(number, found[number])
    else:
        with ProcessPoolExecutor(count, get_context("spawn"), _begin, (how,)) as pool:
            _shared(pool, rooms, found, progress, stopped)
    return tuple(found.get(number) for number in range(len(rooms)))


def _shared(
    pool: ProcessPoolExecutor,
    rooms: Sequence[RoomKey],
    found: dict[int, Drive],
    progress: Callable[[int, Drive], None],
    stopped: Callable[[], bool],
) -> None:
    """Hands out the rooms one by one, and takes what was under way when it is to stop."""
    waiting: dict[Future[Drive], int] = {pool.submit(_one, key): number for number, key in enumerate(rooms)}
    try:
        while waiting and not stopped():
            done, _ = wait(waiting, timeout=_PATIENCE, return_when=FIRST_COMPLETED)
            for future in done:
                number = waiting.pop(future)
                found[number] = future.result()
                progress(number, found[number])
    except BrokenProcessPool:
        raise ToddleError("a process was killed", where="physics", remedy="is there memory enough?") from None
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
    for future, number in waiting.items():  # those that were under way have ended meanwhile
        if not future.cancelled() and future.exception() is None:
            found[number] = future.result()
            progress(number, found[number])


def _begin(how: Judged) -> None:
    _ = signal.signal(signal.SIGINT, signal.SIG_IGN)  # who started the processes hears it, and asks them to stop
    end_with_parent()
    _told.append(how)


def _one(key: RoomKey) -> Drive:
    if not _own:
        _own.append(_Worker(_told[0]))
    return _own[0].drive(key)
