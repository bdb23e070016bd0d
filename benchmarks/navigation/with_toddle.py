"""This project's PPO on the document's point: the task in JAX under one jit, or by way of Gymnasium.

python -m benchmarks.navigation.with_toddle '{"through": "jax", "config": {...}, "seed": 0, ...}'
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

import jax
import numpy as np

from toddle.navigate.policy import policy_of
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.training import Training, init, train
from toddle.navigate.task import Outcome
from toddle.navigate.tasks.point import PointTask
from toddle.navigate.trial import tally
from toddle.outside.navigation.gym_point import POINT
from toddle.outside.navigation.gym_training import GymTraining

TASK = PointTask()


def run(asked: dict[str, Any]) -> dict[str, Any]:
    config = PpoConfig(**{**asked["config"], "hidden": tuple(asked["config"]["hidden"])})
    updates = asked["check_steps"] // config.batch
    began = time.process_time()
    start, more = (in_jax if asked["through"] == "jax" else by_gymnasium)(config, updates)
    training = start(jax.random.key(asked["seed"]))
    jax.block_until_ready(more(training).updates)
    compiling, taken, checks = time.process_time() - began, 0.0, []
    while int(training.updates) < config.updates:
        began = time.process_time()
        training = jax.block_until_ready(more(training))
        taken += time.process_time() - began
        wins, losses = tested(config, training, asked)
        steps = int(training.updates) * config.batch
        checks.append({"steps": steps, "cpu_seconds": taken, "wins": wins, "losses": losses})
        if wins >= asked["wins"] and losses == 0:
            break
    first = checks[0]["cpu_seconds"]
    return {"checks": checks, "compile_seconds": max(compiling - first, 0.0), "version": version("toddle")}


Start = Callable[[jax.Array], Training]
More = Callable[[Training], Training]


def in_jax(config: PpoConfig, updates: int) -> tuple[Start, More]:
    """Collecting and learning in one call."""
    return lambda key: init(TASK, config, key), lambda training: train(TASK, config, training, updates)[0]


def by_gymnasium(config: PpoConfig, updates: int) -> tuple[Start, More]:
    """Collecting from copies of the numpy environment."""
    learner = GymTraining(POINT, config)

    def more(training: Training) -> Training:
        for _ in range(updates):
            training, _ = learner.advance(training)
        return training

    return learner.init, more


def tested(config: PpoConfig, training: Training, asked: dict[str, Any]) -> tuple[float, int]:
    """Mean wins of ten runs of 10,000 steps without noise, and all losses."""
    policy = policy_of(training, config, TASK.actions)
    found = tally(TASK, policy, jax.random.key(asked["test_seed"]), asked["test_runs"], asked["test_steps"])
    outcomes = np.asarray(found.outcomes)
    return float(outcomes[:, Outcome.WON].mean()), int(outcomes[:, Outcome.LOST].sum())


if __name__ == "__main__":
    print(json.dumps(run(json.loads(sys.argv[1]))))
