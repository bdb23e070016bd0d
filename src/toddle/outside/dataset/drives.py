"""Which drives are to be recorded, and recording them, on as many processes as there are cores.

A drive is told by its room, its driver and its seed: what a dataset has already is not driven again. Each process makes
its robot and drivers by itself, as in `toddle.outside.navigation.physics_batch`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from toddle.failures import BadInput
from toddle.navigate.cloning.expert import Expert
from toddle.navigate.cloning.noisy import Noisy
from toddle.navigate.cloning.recording import Recording, RoomKey
from toddle.navigate.driver import Driver
from toddle.navigate.scenarios import draw_rooms
from toddle.navigate.scenarios.rooms import SCENARIOS, Room, Scenario, Split, Style
from toddle.navigate.scenarios.starts import DRAWN, Start, some_start
from toddle.outside.dataset.reader import begun, episodes, facts_of
from toddle.outside.dataset.rows import Damaged
from toddle.outside.navigation.physics_batch import Recipe
from toddle.outside.navigation.room_eyes import EyeOptions
from toddle.outside.navigation.room_run import RoomRules, run_room
from toddle.outside.workers import shared
from toddle.robots.humanoid import Humanoid
from toddle.robots.humanoids import load_humanoid
from toddle.walk.walker import walker

_SEEDS = 1_000_000  # for each seed that is given


class Errand(NamedTuple):
    """One drive to be recorded."""

    room: RoomKey
    seed: int


@dataclass(frozen=True)
class How:
    """What all drives share.

    Attributes:
        recipe: makes robot and driver.
        called: the driver's name in the dataset.
        taught: whether the expert says at each look what it would do; else the driver is its own teacher.
        noise: size of the jolts, as in `Noisy`.
        anywhere: share of drives that begin anywhere in the room, facing anywhere.
        eyes: how the robot sees.
        rules: when a drive ends.
    """

    recipe: Recipe
    called: str
    taught: bool = True
    noise: float = 0.0
    anywhere: float = 0.0
    eyes: EyeOptions = field(default_factory=EyeOptions)
    rules: RoomRules = field(default_factory=RoomRules)


def expert(_: Humanoid) -> Expert:
    """The teacher, for a `Recipe`."""
    return Expert()


def errands(
    scenarios: Sequence[Scenario], split: Split, style: Style, count: int, *, first: int = 0, seed: int = 0
) -> tuple[Errand, ...]:
    """Drives through the scenarios in turn, each in a room of its own.

    Args:
        scenarios: which.
        split: of the rooms.
        style: of the rooms.
        count: how many.
        first: number of the first room of each scenario.
        seed: of all that is drawn.
    """
    rooms = [first + i // len(scenarios) for i in range(count)]
    names: list[Scenario] = [scenarios[i % len(scenarios)] for i in range(count)]
    keys = (RoomKey(name, split, style, room) for name, room in zip(names, rooms, strict=True))
    return tuple(Errand(key, seed * _SEEDS + key.number) for key in keys)


def missing(folder: Path, wanted: Sequence[Errand], called: str) -> tuple[Errand, ...]:
    """Those that a dataset does not have yet."""
    have = set()
    for number in episodes(folder) if begun(folder) else ():
        try:
            facts = facts_of(folder, number)
        except Damaged:
            continue
        have.add((facts.driver, Errand(facts.room, facts.seed)))
    return tuple(errand for errand in wanted if (called, errand) not in have)


def start_of(errand: Errand, room: Room, anywhere: float) -> Start:
    """Where a drive begins; in such a share of all, anywhere in the room."""
    draw = np.random.default_rng([errand.seed, SCENARIOS.index(errand.room.scenario), 2])
    return some_start(room, draw) if draw.random() < anywhere else DRAWN


class Rider:
    """What a process keeps between drives."""

    def __init__(self, how: How) -> None:
        """Robot and driver, made.

        Raises:
            BadInput: they can't be.
        """
        self._how = how
        self._humanoid = load_humanoid(how.recipe.robot, how.recipe.config)
        self._driver = how.recipe.make(self._humanoid, *how.recipe.given)
        self._walker = walker(self._humanoid)

    def __call__(self, errand: Errand) -> Recording | BadInput:
        """One drive, or why there is none."""
        try:
            return self.record(errand)
        except BadInput as fault:
            return fault

    def record(self, errand: Errand) -> Recording:
        """One drive.

        Raises:
            BadInput: there is no such room.
        """
        how, key = self._how, errand.room
        room = draw_rooms.room(key.scenario, key.split, key.number, key.style)
        driver: Driver = Noisy(self._driver, how.noise, errand.seed) if how.noise else self._driver
        _, recording = run_room(
            self._humanoid, driver, room, seed=errand.seed, start=start_of(errand, room, how.anywhere), eyes=how.eyes,
            teacher=Expert() if how.taught else None, called=how.called, rules=how.rules, before=self._walker,
        )  # fmt: skip
        assert recording is not None
        return recording


Done = tuple[Errand, Recording | BadInput]


def record(
    how: How, wanted: Sequence[Errand], processes: int | None = None, stopped: Callable[[], bool] = lambda: False
) -> Iterator[Done]:
    """Every drive once, as it ends; what can't be driven comes as the reason why.

    Args:
        how: what they share.
        wanted: which.
        processes: how many; None: one for each core; 1: this one alone.
        stopped: asked now and then; once it says so, no further drive begins.

    Raises:
        BadInput: robot or driver can't be made.
        ToddleError: a process was killed.
    """
    for number, done in shared(Rider, (how,), wanted, processes=processes, stopped=stopped):
        yield wanted[number], done
