"""Drivers from folders and files, as recipes that can be sent to a process, and on a robot that walks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.navigate.driver import Driver, Learned, Situation, Steering, Timed
from toddle.navigate.policy import Policy
from toddle.navigate.tasks.walker import WalkerTask
from toddle.outside.navigation.named_tasks import SAMPLES, TaskSource, refuse_unfit, source_from, task_with
from toddle.outside.navigation.nmpc_walks import nmpc_walks
from toddle.outside.navigation.policy_files import load_policy
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.outside.teleoperation.commands import follow, script_seconds
from toddle.outside.teleoperation.script import read_script
from toddle.robots.humanoid import Humanoid
from toddle.signals import STILL, Circle, Senses, Velocity


class Steered:
    """A simulated robot with a driver on top: a robot for the walk, and the source of its commands.

    Attributes:
        allowed: what the safety gate let through last; whoever walks tells it.
    """

    def __init__(
        self,
        simulation: HumanoidSimulation,
        driver: Driver,
        goal: tuple[float, float],
        circles: tuple[Circle, ...],
        near: float,
    ) -> None:
        """Ready to walk once.

        Args:
            simulation: the robot.
            driver: decides.
            goal: x, y from the start [m].
            circles: what stands in the way.
            near: the walk ends so near to the goal [m].
        """
        self._simulation, self._goal, self._circles = simulation, goal, circles
        self._steering = Steering(driver, self._look, near)
        self.allowed = STILL

    def reset(self) -> Senses:
        """Stand at home."""
        self._senses = self._simulation.reset()
        return self._senses

    def tick(self, servo: Float[np.ndarray, " joints"]) -> Senses:
        """Command the servos and let 10 ms pass."""
        self._senses = self._simulation.tick(servo)
        return self._senses

    def __call__(self, t: float) -> Velocity | None:
        """The velocity asked for at a time [s]; None: it is there."""
        return self._steering(t)

    def _look(self, t: float) -> Situation:
        return Situation(t, self._senses.place, self._goal, self.allowed, self._circles)


def learned(humanoid: Humanoid, folder: Path) -> Learned:
    """The policy in a folder, steering a robot.

    Raises:
        BadInput: there is none, it did not learn to walk, or it sees something else than its task shows.
    """
    policy = load_policy(folder)
    task = task_for(humanoid, walking_source(policy, folder))
    refuse_unfit(policy, task)
    return Learned(policy, task)


def walking_source(policy: Policy, folder: Path) -> TaskSource:
    """What a policy learned to walk on.

    Raises:
        BadInput: it learned something else.
    """
    source = None if "env" in policy.source else source_from(policy.source)
    if source is None or source.task == "point":
        name = policy.source.get("env", "point")
        raise BadInput(f"it learned {name}, not to walk", where=str(folder), remedy="name a policy that walks")
    return source


def task_for(humanoid: Humanoid, source: TaskSource) -> WalkerTask:
    """The task as a robot meets it: in its frame, with its greatest velocities."""
    return task_with(nmpc_walks(humanoid, hold=SAMPLES), source)


def scripted(_: Humanoid, path: Path) -> Timed:
    """Velocities from a file, whatever the goal.

    Raises:
        BadInput: it can't be read.
    """
    legs = read_script(path)
    return Timed(follow(legs, script_seconds(legs)))
