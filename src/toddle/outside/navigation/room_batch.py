"""Many drives through rooms on the cores of this machine; the results are those of one process.

Each process loads the robot and makes the driver by itself, as in `toddle.outside.navigation.physics_batch`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from toddle.navigate.cloning.recording import Recording, RoomKey
from toddle.navigate.scenarios.draw_rooms import room
from toddle.navigate.scenarios.rooms import SCENARIOS, Scenario, Split, Style
from toddle.outside.navigation.physics_batch import Recipe
from toddle.outside.navigation.room_eyes import EyeOptions
from toddle.outside.navigation.room_run import RoomFinish, RoomRules, run_room
from toddle.outside.simulation.disturbances import WorldOptions
from toddle.outside.workers import shared
from toddle.robots.humanoids import load_humanoid
from toddle.walk.walker import walker


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

    def __call__(self, key: RoomKey) -> Drive:
        """One drive."""
        how, seen = self._how, key.number < self._how.kept
        finish, recording = run_room(
            self._humanoid, self._driver, room(key.scenario, key.split, key.number, key.style),
            seed=how.seed + key.number, eyes=EyeOptions() if seen and how.eyes is None else how.eyes,
            rules=how.rules, world=how.world, before=self._walker,
        )  # fmt: skip
        return Drive(finish, recording if seen else None)


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
    found: dict[int, Drive] = {}
    for number, drive in shared(_Worker, (how,), rooms, processes=processes, stopped=stopped):
        found[number] = drive
        progress(number, drive)
    return tuple(found.get(number) for number in range(len(rooms)))
