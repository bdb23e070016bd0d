"""``toddle navigate evaluate`` where no physics is asked for: on the walking pattern, the point, or Gymnasium."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from toddle.failures import BadInput

if TYPE_CHECKING:
    from toddle.cli.navigate_evaluate import Evaluate
    from toddle.navigate.policy import Policy
    from toddle.outside.navigation.named_tasks import TaskSource

_OF_A_WALKER = ("robot", "config", "circles", "people", "noise")


def try_out(asked: Evaluate, policy: Policy) -> int:
    """Judge a policy on what it learned, leave a folder, and return the exit code."""
    from toddle.cli.navigate_evaluate import learned_figures, tell
    from toddle.cli.navigate_folder import left_folder
    from toddle.outside.files import write_json

    trial = _trial(asked, policy)
    env = policy.source.get("env") or policy.source.get("task")
    with left_folder(asked.out, "evaluate") as folder:
        figures = {"env": env, "seed": asked.seed, **trial(), **learned_figures(policy.figures)}
        write_json(folder / "figures.json", figures)
    tell(figures, folder, as_json=asked.json)
    return 0


def _trial(asked: Evaluate, policy: Policy) -> Callable[[], dict[str, Any]]:
    """What judges it, once everything that may be refused has been.

    Raises:
        BadInput: something is asked that this policy does not know.
    """
    from toddle.outside.navigation.judging import judge, judge_gym
    from toddle.outside.navigation.named_tasks import make_task, refuse_unfit, source_from

    walks = "env" not in policy.source and policy.source.get("task") != "point"
    if not walks and (useless := [name for name in _OF_A_WALKER if getattr(asked, name) is not None]):
        raise BadInput("this policy does not walk", where=f"--{useless[0]}", remedy="leave it out")
    if asked.jobs is not None:
        raise BadInput("only physics takes several processes", where="--jobs", remedy="leave it out")
    if "env" in policy.source:
        return lambda: judge_gym(str(policy.source["env"]), policy, asked.seed, asked.episodes)
    source = source_from(policy.source)
    if walks:
        if asked.noise:
            raise BadInput("a pattern has no senses", where="--noise", remedy="leave it or --pattern out")
        source = _instead(asked, source)
    task = make_task(source)
    refuse_unfit(policy, task)
    return lambda: judge(task, policy, asked.seed, asked.episodes)


def _instead(asked: Evaluate, source: TaskSource) -> TaskSource:
    """What it learned on, with what is asked otherwise; a file that describes a robot is of no other."""
    robot = asked.robot or source.robot
    config = None if asked.config is None else str(asked.config)
    given = {"circles": asked.circles, "people": asked.people}
    return replace(
        source,
        robot=robot,
        robot_config=source.robot_config if config is None and robot == source.robot else config,
        **{name: value for name, value in given.items() if value is not None},
    )
