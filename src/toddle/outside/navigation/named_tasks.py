"""The tasks that have a name: plain values that travel in a run's folder, and the task that they stand for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_type_hints

from toddle.failures import BadInput, unknown_name
from toddle.navigate.policy import Policy
from toddle.navigate.task import Task
from toddle.navigate.tasks.point import PointTask
from toddle.navigate.tasks.unicycle import unicycle
from toddle.navigate.tasks.walker import WalkerTask
from toddle.navigate.walks import Walks
from toddle.outside.navigation.policy_files import is_a
from toddle.robots.humanoids import load_humanoid

SAMPLES = 4
"""Iterations of the walking pattern that one action lasts."""

UNICYCLE = "unicycle"
"""Who is no humanoid: an ideal robot on wheels, to try things out with."""

_MOST = {"circles": 20, "people": 10}
_OF_A_PATTERN = ("robot_config", "solver")
_OF_A_WALKER = ("robot", "circles", "people", "sideways", "observe", "told", "pace", *_OF_A_PATTERN)


@dataclass(frozen=True)
class TaskSource:
    """What a task is made of.

    Attributes:
        task: its name.
        robot: who walks: a name, or the path of a description; "unicycle": an ideal robot on wheels. Of no meaning
            for the point.
        robot_config: a TOML file beside the robot's description.
        circles: at most so many obstacles.
        people: so many walk around.
        sideways: whether it may be walked aside.
        observe: what the policy is shown; see `WalkerTask`.
        told: whether the walking pattern is told of obstacles, and may evade them by itself.
        pace: greatest velocity that the policy may ask for, as a share of the robot's: at its greatest, ahead and
            turning at once, the robot falls now and then in physics.
        solver: of the walking pattern; see `toddle.outside.navigation.nmpc_walks`.
    """

    task: Literal["point", "goal", "obstacles", "people"] = "goal"
    robot: str = "heicub"
    robot_config: str | None = None
    circles: int = 0
    people: int = 0
    sideways: bool = False
    observe: Literal["document", "full"] = "document"
    told: bool = True
    pace: float = 0.8
    solver: Literal["native", "batch", "auto"] = "auto"

    def __post_init__(self) -> None:
        """Refuses what makes no task.

        Raises:
            BadInput: which number, and the remedy.
        """
        for name, most in _MOST.items():
            count = getattr(self, name)
            if not 0 <= count <= most:
                raise BadInput(f"{count} is out of range", where=f"--{name}", remedy=f"give 0 to {most}")
        if not 0 < self.pace <= 1:
            raise BadInput(f"{self.pace} is out of range", where="--pace", remedy="give a share above 0, up to 1")


TASKS = {
    "point": TaskSource("point"),
    "goal": TaskSource("goal"),
    "obstacles": TaskSource("obstacles", circles=5, observe="full"),
    "people": TaskSource("people", circles=2, people=3, observe="full"),
}
"""Every task by its name: the document's two, and what goes beyond it."""


def source_named(name: str, **changes: Any) -> TaskSource:
    """A task by its name, with what is given otherwise; None leaves it.

    Raises:
        BadInput: there is no such task, or a change makes none.
    """
    if name not in TASKS:
        raise unknown_name("task", name, TASKS, where="toddle navigate ppo")
    source = TASKS[name]
    given = {key: value for key, value in changes.items() if value is not None}
    who, of_others = ("the point", _OF_A_WALKER) if name == "point" else ("an ideal robot on wheels", _OF_A_PATTERN)
    alone = name == "point" or given.get("robot") == UNICYCLE
    if alone and (useless := [key for key in of_others if key in given and given[key] != getattr(source, key)]):
        where = "--config" if useless[0] == "robot_config" else f"--{useless[0]}"
        raise BadInput(f"{who} knows no such thing", where=where, remedy="leave it out")
    if (given.get("circles") or given.get("people")) and source.observe == "document":
        given["observe"] = "full"
    return replace(source, **given)


def source_from(facts: Mapping[str, Any]) -> TaskSource:
    """The same from what a run's folder holds.

    Raises:
        BadInput: the facts are those of no task.
    """
    hints = get_type_hints(TaskSource)
    if not set(facts) <= set(hints) or not all(is_a(hints[name], value) for name, value in facts.items()):
        raise BadInput("it was learned on no task of toddle's", where="policy", remedy="name another --policy")
    return TaskSource(**facts)


def refuse_unfit(policy: Policy, task: Task[Any]) -> None:
    """Refuses a policy that sees or does something else than its task.

    Raises:
        BadInput: what of it.
    """
    if policy.observations != task.observations:
        what = f"it sees {policy.observations} numbers, its task shows {task.observations}"
    elif policy.actions != task.actions:
        what = f"its actions are {policy.actions}, its task's {task.actions}"
    else:
        return
    raise BadInput(what, where="policy", remedy="name another --policy")


def facts_of(source: TaskSource) -> dict[str, Any]:
    """Plain values."""
    return asdict(source)


def make_task(source: TaskSource) -> Task[Any]:
    """The task itself.

    Raises:
        BadInput: the robot can't be used.
    """
    if source.task == "point":
        return PointTask()
    return walker_task(source)


def walker_task(source: TaskSource) -> WalkerTask:
    """A task with a walker; see `make_task`."""
    if source.robot == UNICYCLE:
        walks = unicycle(seconds=0.4)
    else:
        from toddle.outside.navigation.nmpc_walks import nmpc_walks

        config = None if source.robot_config is None else Path(source.robot_config)
        walks = nmpc_walks(load_humanoid(source.robot, config), solver=source.solver, hold=SAMPLES)
    return task_with(walks, source)


def task_with(walks: Walks, source: TaskSource) -> WalkerTask:
    """The task of a walker, at the pace that is asked for."""
    vx, vy, omega = walks.fastest
    slower = replace(
        walks, fastest=(source.pace * vx, source.pace * vy, source.pace * omega), slowest=source.pace * walks.slowest
    )
    return WalkerTask(
        slower, circles=source.circles, people=source.people, sideways=source.sideways, observe=source.observe,
        told=source.told,
    )  # fmt: skip
