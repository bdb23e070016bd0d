"""Drivers as recipes for physics: what travels to a process is a folder's or a file's name, and plain values."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from toddle.failures import BadInput
from toddle.navigate.driver import Learned, Timed
from toddle.navigate.policy import Policy
from toddle.navigate.tasks.walker import WalkerTask
from toddle.outside.navigation.named_tasks import SAMPLES, TaskSource, source_from
from toddle.outside.navigation.nmpc_walks import nmpc_walks
from toddle.outside.navigation.policy_files import load_policy
from toddle.outside.teleoperation.commands import follow, script_seconds
from toddle.outside.teleoperation.script import read_script
from toddle.robots.humanoid import Humanoid


def learned(humanoid: Humanoid, folder: Path) -> Learned:
    """The policy in a folder, steering a robot.

    Raises:
        BadInput: there is none, or it did not learn to walk.
    """
    policy = load_policy(folder)
    return Learned(policy, task_for(humanoid, walking_source(policy, folder)))


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
    task = WalkerTask(
        nmpc_walks(humanoid, hold=SAMPLES), circles=source.circles, people=source.people, sideways=source.sideways,
        observe=source.observe,
    )  # fmt: skip
    return replace(task, told=source.told)


def scripted(_: Humanoid, path: Path) -> Timed:
    """Velocities from a file, whatever the goal.

    Raises:
        BadInput: it can't be read.
    """
    legs = read_script(path)
    return Timed(follow(legs, script_seconds(legs)))
