"""The document's point: the best walk against a count in whole numbers, and the experiment cut short."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from toddle.experiments import huber_ppo_toy
from toddle.experiments.experiment import Task
from toddle.experiments.huber_ppo_toy import best_walk, every_goal
from toddle.navigate.tasks.point import PointTask


def steps_to(x: int, y: int, near: int, *, strictly: bool) -> int:
    """Steps of a tenth along both axes until nearer than so many tenths, counted in whole numbers."""
    for step in range(1, 100):
        squared = sum(max(10 * abs(part) - step, 0) ** 2 for part in (x, y))
        if squared < near**2 or (not strictly and squared == near**2):
            return step
    raise AssertionError


@pytest.mark.parametrize("near", [4, 6])
def test_the_best_walk_is_the_one_counted(near: int) -> None:
    games = best_walk(PointTask(near=near / 10))
    goals = [(x, y) for x in range(-5, 6) for y in range(-5, 6)]
    assert games.won.all()
    np.testing.assert_array_equal(np.asarray(games.seen[0, :, 2:]), np.array(goals))
    latest = np.array([steps_to(x, y, near, strictly=True) for x, y in goals])
    soonest = np.array([steps_to(x, y, near, strictly=False) for x, y in goals])
    length = np.asarray(games.length)
    assert (soonest <= length).all()
    assert (length <= latest).all()


def test_only_the_radius_of_the_later_program_leaves_room_for_the_document_s_wins() -> None:
    wider, narrower = (float(best_walk(PointTask(near=near)).rate) for near in (0.6, 0.4))
    assert narrower < huber_ppo_toy.WINS < wider


def test_who_stands_still_wins_nothing_but_the_goal_at_hand() -> None:
    games = every_goal(PointTask(), lambda seen: jnp.zeros(2, jnp.float32), 20)
    assert int(games.won.sum()) == 1
    assert float(games.rate) == 0.0
    assert sorted(set(np.asarray(games.length).tolist())) == [1, 20]


def test_what_was_learned_until_stopped_is_tested_and_drawn(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    tiny = replace(huber_ppo_toy.QUICK.ours, steps=64, horizon=2, minibatch=16, epochs=1, hidden=(4,))
    monkeypatch.setattr(huber_ppo_toy, "QUICK", replace(huber_ppo_toy.QUICK, ours=tiny, tests=2))
    monkeypatch.setattr(huber_ppo_toy, "TEST_STEPS", 50)
    monkeypatch.setattr(huber_ppo_toy, "EPOCH", 32)
    outcome = huber_ppo_toy.run(Task(False, 5, 2, tmp_path, lambda *_: None, lambda: True))
    assert not outcome.holds
    names = ("figure-4-29.png", "figure-4-30-ours.png", "figure-4-31.png")
    assert {path.name for path in tmp_path.glob("*.png")} == set(names)
    assert set(outcome.figures) == {"ceiling", "ours"}
    runs = outcome.figures["ours"]["runs"]
    assert [run["seed"] for run in runs] == [5, 6]
    assert all(run["steps"] == 32 and run["env"] == "point" and run["solved_at_steps"] is None for run in runs)
    assert outcome.figures["ours"]["compile_seconds"] > 0
    wins = {row.what: row for row in outcome.rows}["our numbers: wins in 50 steps, mean of 2 seeds"]
    assert wins.document == 311.0
    assert wins.ours is not None
    assert wins.ours <= 50
