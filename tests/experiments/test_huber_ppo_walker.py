"""The walker that PPO steers, with a robot without legs and a handful of updates."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from toddle.experiments import huber_ppo_walker as experiment
from toddle.experiments.experiment import Task
from toddle.navigate.policy import Policy, policy_of
from toddle.navigate.ppo.training import init
from toddle.navigate.scenarios.driver import drive
from toddle.navigate.task import Outcome
from toddle.outside.files import finite
from toddle.outside.navigation.named_tasks import TASKS, walker_task

ROLLING = replace(TASKS["goal"], robot="unicycle")


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(experiment, "walker_task", lambda _: walker_task(ROLLING))
    tiny = replace(experiment.GOAL, steps=512, actors=8, horizon=16, minibatch=64, epochs=1, hidden=(8,))
    monkeypatch.setattr(experiment, "GOAL", tiny)
    letter = replace(experiment.BY_THE_LETTER, horizon=40, minibatch=20, epochs=1, hidden=(8,))
    monkeypatch.setattr(experiment, "BY_THE_LETTER", letter)
    monkeypatch.setattr(experiment, "QUICK", experiment.Parameters(2, 2, 2, goals=5, courses=0))


def test_it_runs_and_says_honestly_that_nothing_was_learned(small: None, tmp_path: Path) -> None:
    told: list[float] = []
    task = Task(False, 3, None, tmp_path, lambda done, _: told.append(done), lambda: False)
    outcome = experiment.run(task)
    assert not outcome.holds
    assert told == sorted(told)
    assert (tmp_path / "figure-4-32.png").stat().st_size > 10_000
    ours, letter = outcome.figures["ours"], outcome.figures["document"]
    assert [one["seed"] for one in ours] == [one["seed"] for one in letter] == [3, 4]
    assert all(one["steps"] == 512 and one["episodes"] == 5 for one in ours)
    assert all(one["wins"] + one["losses"] == 5 for one in [*ours, *letter])
    json.dumps(finite(outcome.figures))


def test_the_picture_shows_where_the_walker_went() -> None:
    walking = walker_task(ROLLING)
    training = init(walking, experiment.GOAL, jax.random.key(0))

    class Scripted(Policy):
        def __call__(self, observation, memory):
            return drive(observation), memory

    policy = policy_of(training, experiment.GOAL, walking.actions)
    driver = Scripted(policy.network, policy.moments, policy.config, policy.observations, policy.actions)
    for goal in experiment.GOALS.values():
        path, end = experiment.walk_path(walking, driver, goal)
        assert end == Outcome.WON
        assert math.dist(path[-1, 1:3].tolist(), goal) <= walking.near
        np.testing.assert_allclose(np.diff(path[:, 0]), walking.dt, rtol=1e-6)
        assert jnp.hypot(*path[0, 1:3]) == 0
