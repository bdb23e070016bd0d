"""``toddle navigate evaluate`` where no physics is asked for: on the walking pattern, the point, or Gymnasium."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from toddle.failures import BadInput

if TYPE_CHECKING:
    from toddle.cli.navigate_evaluate import Evaluate
    from toddle.navigate.policy import Policy

_OF_A_WALKER = ("robot", "config", "circles", "people", "noise")


def try_out(asked: Evaluate, policy: Policy) -> int:
    """Judge a policy on what it learned, leave a folder, and return the exit code."""
    from toddle.cli.navigate_evaluate import learned_figures, tell
    from toddle.cli.run_folder import new_folder
    from toddle.outside.files import write_json

    env = policy.source.get("env") or policy.source.get("task")
    figures = {"env": env, "seed": asked.seed, **_tried(asked, policy), **learned_figures(policy.figures)}
    folder = new_folder(asked.out, "evaluate")
    write_json(folder / "figures.json", figures)
    tell(figures, folder, as_json=asked.json)
    return 0


def _tried(asked: Evaluate, policy: Policy) -> dict[str, Any]:
    from toddle.outside.navigation.judging import judge, judge_gym
    from toddle.outside.navigation.named_tasks import make_task, source_from, source_named

    walks = "env" not in policy.source and policy.source.get("task") != "point"
    if not walks and (useless := [name for name in _OF_A_WALKER if getattr(asked, name) is not None]):
        raise BadInput("this policy does not walk", where=f"--{useless[0]}", remedy="leave it out")
    if "env" in policy.source:
        return judge_gym(str(policy.source["env"]), policy, asked.seed, asked.episodes)
    source = source_from(policy.source)
    if walks:
        if asked.noise:
            raise BadInput("a pattern has no senses", where="--noise", remedy="leave it or --pattern out")
        source = replace(
            source_named(source.task, robot=asked.robot or source.robot, circles=asked.circles, people=asked.people),
            sideways=source.sideways, observe=source.observe, told=source.told,
            robot_config=source.robot_config if asked.config is None else str(asked.config),
        )  # fmt: skip
    return judge(make_task(source), policy, asked.seed, asked.episodes)
