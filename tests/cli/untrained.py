"""Policies that have learned nothing yet: enough to ask the command line about."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jax

from toddle.navigate.policy import policy_of
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.training import init
from toddle.navigate.tasks.point import PointTask
from toddle.outside.navigation.gym_training import GymTraining
from toddle.outside.navigation.named_tasks import facts_of, make_task, source_named
from toddle.outside.navigation.policy_files import save_policy

CONFIG = PpoConfig(actors=2, horizon=2, minibatch=4, hidden=(4,))


def leave_point(folder: Path) -> None:
    """A policy of the document's point."""
    task = PointTask()
    training = init(task, CONFIG, jax.random.key(0))
    save_policy(policy_of(training, CONFIG, task.actions, facts_of(source_named("point"))), folder)


def leave_env(folder: Path, name: str) -> None:
    """A policy of a Gymnasium environment."""
    gym = GymTraining(name, CONFIG)
    training = gym.init(jax.random.key(0))
    save_policy(policy_of(training, CONFIG, gym.copies.spaces.actions, {"env": name}), folder)
    gym.close()


def leave_walker(folder: Path, task: str = "goal", **changes: Any) -> None:
    """A policy of the walker's task, for the ideal robot on wheels unless told otherwise."""
    source = source_named(task, **{"robot": "unicycle", **changes})
    made = make_task(source)
    training = init(made, CONFIG, jax.random.key(0))
    save_policy(policy_of(training, CONFIG, made.actions, facts_of(source), {"steps": 8}), folder)
