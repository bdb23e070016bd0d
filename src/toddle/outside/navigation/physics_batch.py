"""Many courses in physics on the cores of this machine; the results are those of one process.

Each process loads the robot and makes the driver by itself: what travels is the name of the robot, plain data that a
driver is made of, and frozen records.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from toddle.navigate.driver import Baseline, Driver, Learned
from toddle.navigate.tasks.walker import WalkerTask
from toddle.outside.navigation.course import Course, Finish, Rules
from toddle.outside.navigation.nmpc_walks import nmpc_walks
from toddle.outside.navigation.physics import Ready, run_course
from toddle.outside.simulation.disturbances import WorldOptions
from toddle.outside.workers import shared
from toddle.robots.humanoid import Humanoid
from toddle.robots.humanoids import load_humanoid


@dataclass(frozen=True)
class Recipe:
    """How a process makes its robot and its driver; all of it can be sent to a process.

    Attributes:
        make: a function of a module, called as ``make(humanoid, *given)``.
        given: plain data: a folder, arrays, frozen records.
        robot: as `toddle.robots.humanoids.load_humanoid` takes it.
        config: a configuration file of the robot.
    """

    make: Callable[..., Driver]
    given: tuple[Any, ...] = ()
    robot: str = "heicub"
    config: Path | None = None


def same(_: Humanoid, driver: Driver) -> Driver:
    """A driver that can itself be sent to a process: ``Recipe(same, (Guided(),))``."""
    return driver


def baseline(humanoid: Humanoid) -> Learned:
    """The driver by script: turns to the goal, walks there."""
    return Learned(Baseline(), WalkerTask(nmpc_walks(humanoid)))


class _Worker:
    """What a process keeps between courses; made when the first one comes, so that its failure is that one's."""

    def __init__(self, recipe: Recipe, rules: Rules | None, world: WorldOptions | None) -> None:
        self._humanoid = load_humanoid(recipe.robot, recipe.config)
        self._driver = recipe.make(self._humanoid, *recipe.given)
        self._rules, self._world = rules, world
        self._ready: Ready | None = None

    def __call__(self, task: tuple[Course, int]) -> Finish:
        """One course."""
        course, seed = task
        finish, self._ready = run_course(
            self._humanoid, self._driver, course, self._rules, world=self._world, seed=seed, before=self._ready
        )
        return finish


def run_courses(
    recipe: Recipe,
    courses: Sequence[Course],
    rules: Rules | None = None,
    *,
    world: WorldOptions | None = None,
    seed: int = 0,
    processes: int | None = None,
    progress: Callable[[int, Finish], None] = lambda number, finish: None,
    stopped: Callable[[], bool] = lambda: False,
) -> tuple[Finish | None, ...]:
    """Every course once.

    Args:
        recipe: makes robot and driver.
        courses: where to.
        rules: how they are judged; None: the defaults.
        world: friction, noise and so on.
        seed: the world of course ``i`` draws from ``seed + i``.
        processes: how many; None: one for each core; 1: this one alone.
        progress: is told the number of each course as it ends, and how, in the order in which they end.
        stopped: asked now and then; once it says so, no further course begins.

    Returns:
        How each ended, in the order of the courses; None: it was not run.

    Raises:
        BadInput: a driver or a course that can't be used.
        ToddleError: a process was killed.
    """
    tasks = [(course, seed + number) for number, course in enumerate(courses)]
    found: dict[int, Finish] = {}
    for number, finish in shared(_Worker, (recipe, rules, world), tasks, processes=processes, stopped=stopped):
        found[number] = finish
        progress(number, finish)
    return tuple(found.get(number) for number in range(len(courses)))
