"""Drives that a network learns from or is judged by: driven in physics, kept as a dataset, taken from it again.

What a dataset has already is not driven again, so that a run that was interrupted goes on where it was.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from toddle.failures import BadInput, ToddleError
from toddle.navigate.cloning.dagger import Course, Stage, rooms_of
from toddle.navigate.cloning.episodes import Episode, episode
from toddle.navigate.cloning.policy import Cloned
from toddle.navigate.cloning.recording import Recording, RoomKey
from toddle.navigate.scenarios.rooms import SCENARIOS
from toddle.navigate.task import Outcome
from toddle.outside.dataset.drives import Errand, How, expert, missing, record
from toddle.outside.dataset.reader import read_dataset
from toddle.outside.dataset.rows import Damaged
from toddle.outside.dataset.writer import Writer
from toddle.outside.navigation.cloned import cloned
from toddle.outside.navigation.cloning_files import save_cloned
from toddle.outside.navigation.physics_batch import Recipe
from toddle.outside.navigation.room_eyes import EyeOptions
from toddle.outside.navigation.room_run import RoomRules

_SEEDS = 1_000_000  # drives of a seed

Told = Callable[[int, int, int, str], None]
"""Is told of drives made, drives wanted, targets reached, and who drives."""


@dataclass(frozen=True)
class Drives:
    """How drives are made.

    Attributes:
        robot: as `toddle.robots.humanoids.load_humanoid` takes it.
        config: a configuration file of the robot.
        eyes: how it sees.
        noise: of the expert's jolts.
        anywhere: share of drives that begin anywhere in the room.
        seconds: after so long the network's drives end [s]; the expert's have as long as `RoomRules` gives.
        seed: of all of it.
        jobs: processes; None: one for each core.
    """

    robot: str = "heicub"
    config: Path | None = None
    eyes: EyeOptions = field(default_factory=EyeOptions)
    noise: float = 1.0
    anywhere: float = 0.3
    seconds: float = 60.0
    seed: int = 0
    jobs: int | None = None

    def expert(self) -> How:
        """The expert drives, jolted, and says what it would do."""
        return How(Recipe(expert, (), self.robot, self.config), "expert", True, self.noise, self.anywhere, self.eyes)

    def policy(self, folder: Path, called: str) -> How:
        """A network drives, and the expert says what it would do."""
        recipe = Recipe(cloned, (folder,), self.robot, self.config)
        return How(recipe, called, True, 0.0, self.anywhere, self.eyes, RoomRules(seconds=self.seconds))

    def judged(self, folder: Path) -> How:
        """A network drives, from where the rooms say."""
        return How(Recipe(cloned, (folder,), self.robot, self.config), "policy", False, eyes=self.eyes)


@dataclass(frozen=True)
class Aggregation:
    """Brings the episodes of each stage: those of the dataset, and those that are still to be driven.

    Attributes:
        drives: how they are made.
        course: how many, by whom.
        folder: of the run; drives are kept in it.
        stopped: asked now and then.
        told: is told of every drive.
        first: number of the first room of each scenario.
    """

    drives: Drives
    course: Course
    folder: Path
    stopped: Callable[[], bool]
    told: Told
    first: int = 0

    def __call__(self, number: int, policy: Cloned | None) -> tuple[Episode, ...] | None:
        """All episodes up to those of a stage; None: somebody stopped it.

        Raises:
            ToddleError: too few of the drives could be made.
        """
        folder = self.folder / "drives"
        with Writer(folder, self.drives.robot) as writer:
            for before in range(number + 1):
                self._drive(before, policy, writer)
        if self.stopped():
            return None
        return kept(folder, self._wanted(number))

    def _drive(self, number: int, policy: Cloned | None, writer: Writer) -> None:
        stage = self.course.stages[number]
        called, errands = _called(stage, number), self._errands(stage)
        left = missing(writer.folder, errands, called) if len(writer) else errands
        if not left or self.stopped():
            return
        if stage.driver == "expert":
            how = self.drives.expert()
        else:
            assert policy is not None
            how = self.drives.policy(save_cloned(policy, self.folder / "rounds" / str(number)), called)
        done, reached, lost = len(errands) - len(left), 0, 0
        for _, found in record(how, left, self.drives.jobs, self.stopped):
            if isinstance(found, BadInput):
                lost += 1
                continue
            writer.add(found)
            done, reached = done + 1, reached + (found.outcome == Outcome.WON)
            self.told(done, len(errands), reached, called)
        if 2 * lost > len(errands):
            raise ToddleError(f"{lost} of {len(errands)} drives could not be made", where=str(writer.folder))

    def _errands(self, stage: Stage) -> tuple[Errand, ...]:
        rooms = rooms_of(stage, self.first)
        return tuple(Errand(room, self.drives.seed * _SEEDS + room.number) for room in rooms)

    def _wanted(self, number: int) -> set[tuple[str, Errand]]:
        """The drives up to those of a stage."""
        stages = self.course.stages[: number + 1]
        return {(_called(stage, at), one) for at, stage in enumerate(stages) for one in self._errands(stage)}


def kept(
    folder: Path,
    wanted: set[tuple[str, Errand]] | None = None,
    damaged: Callable[[Damaged], None] = lambda fault: None,
) -> tuple[Episode, ...]:
    """A dataset's episodes, in its order; what is damaged is left out.

    Args:
        folder: of the dataset.
        wanted: only these drives; None: all.
        damaged: is told of each that is left out.

    Raises:
        BadInput: there is no dataset here, or nothing in it can be read.
    """
    found = tuple(
        episode(one)
        for _, one in read_dataset(folder, damaged)
        if wanted is None or (one.driver, Errand(one.room, one.seed)) in wanted
    )
    if not found:
        raise BadInput("it holds no episode that can be read", where=str(folder), remedy="record some")
    return found


def judge(
    drives: Drives, episodes: int, stopped: Callable[[], bool], told: Told, first: int = 0
) -> Callable[[Cloned], float | None]:
    """Lets policies drive through rooms of the validation split, all scenarios in turn.

    Args:
        drives: how.
        episodes: how many.
        stopped: asked now and then.
        told: is told of every drive.
        first: number of the first room of each scenario.

    Returns:
        From a policy to the share of drives that reached the target; None: somebody stopped it.
    """
    rooms = [
        RoomKey(SCENARIOS[number % len(SCENARIOS)], "validation", "seen", first + number // len(SCENARIOS))
        for number in range(episodes)
    ]

    def judged(policy: Cloned) -> float | None:
        with tempfile.TemporaryDirectory() as folder:
            how = drives.judged(save_cloned(policy, folder))
            wanted = [Errand(room, drives.seed * _SEEDS + room.number) for room in rooms]
            outcomes = []
            for _, found in record(how, wanted, drives.jobs, stopped):
                outcomes.append(isinstance(found, Recording) and found.outcome == Outcome.WON)
                told(len(outcomes), len(wanted), sum(outcomes), "judged policy")
        return float(np.mean(outcomes)) if len(outcomes) == len(wanted) else None

    return judged


def _called(stage: Stage, number: int) -> str:
    return "expert" if stage.driver == "expert" else f"policy-{number}"
