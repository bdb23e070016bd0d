"""The experiments after Thuruthel 2016: their circle, their locked actuators, and all four cut short."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from toddle.experiments import thuruthel, thuruthel_circle, thuruthel_locked, thuruthel_network_size, thuruthel_points
from toddle.experiments.experiment import Outcome, Task
from toddle.experiments.thuruthel_circle import Followed, judged
from toddle.robots.catalogue import load

TINY = thuruthel.Parameters(samples=300, hidden=5, iterations=10, seeds=2, targets=6)


def task(folder: Path, stops_after: int | None = None) -> Task:
    told: list[float] = []
    stopped = lambda: stops_after is not None and len(told) >= stops_after  # noqa: E731
    return Task(False, 3, None, folder, lambda done, _: told.append(done), stopped)


@pytest.fixture
def tiny(monkeypatch: pytest.MonkeyPatch) -> None:
    """``asked_for`` has its parameters as defaults, which are bound already."""
    for module in (thuruthel_points, thuruthel_circle, thuruthel_locked):
        monkeypatch.setattr(module, "asked_for", lambda _: TINY)


def figures(outcome: Outcome) -> dict[str, float]:
    return {row.what: row.ours for row in outcome.rows if row.ours is not None}


def test_the_circle_is_the_papers():
    path = thuruthel.circle()
    assert path.shape == (200, 3)
    np.testing.assert_allclose(np.linalg.norm(path - [0, 0, 0.7], axis=1), 0.2)
    np.testing.assert_allclose(path[:100], path[100:], atol=1e-12)
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    np.testing.assert_allclose(steps, 2 * 0.2 * np.sin(np.pi / 100))


@pytest.mark.parametrize("locked", [0, 3])
def test_locked_actuators_stay_at_home_whatever_they_are_told(locked: int):
    body = load("bha")
    told = np.random.default_rng(0).uniform(0.1, 0.3, (5, 9))
    q, x = thuruthel.acting(body, locked)(told)
    home = np.asarray(body.home, float)
    np.testing.assert_array_equal(q[:, : 9 - locked], told[:, : 9 - locked])
    np.testing.assert_array_equal(q[:, 9 - locked :], np.tile(home[9 - locked :], (5, 1)))
    np.testing.assert_allclose(x, thuruthel.acting(body)(q)[1], atol=1e-7)


def test_targets_are_no_training_data_and_differ_from_run_to_run():
    body = load("bha")
    first, again, other = (thuruthel.random_targets(body, 20, seed) for seed in (0, 0, 1))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    assert np.all(np.linalg.norm(first, axis=1) < 0.9)


def test_fifty_points_from_end_to_end(tiny: None, tmp_path: Path):
    outcome = thuruthel_points.run(task(tmp_path))
    found = figures(outcome)
    assert found["error, mean of the best run"] <= found["error, mean"] <= found["error, mean of the worst run"]
    assert 0 < found["steps until within 1 mm of where it settles, mean"] < found["steps to settle, mean"]
    assert found["error after 6 looks, mean"] < found["error, mean"]
    assert [row.document for row in outcome.rows[:2]] == [5.68, 1.504]
    assert len(outcome.figures["runs"]) == 2
    assert {path.name for path in tmp_path.iterdir()} == {"figure-2-a.png", "figure-2-b.png"}


def test_the_circle_from_end_to_end(tiny: None, tmp_path: Path):
    outcome = thuruthel_circle.run(task(tmp_path))
    found = figures(outcome)
    assert found["round 2, with feedback: error, mean"] < found["round 2: error, mean"]
    assert len(outcome.figures["first_run_error_mm"]) == 200
    assert {path.name for path in tmp_path.iterdir()} == {"figure-2-c.png", "figure-2-d.png"}


def test_the_locked_circle_from_end_to_end_and_stopped(tiny: None, tmp_path: Path):
    outcome = thuruthel_locked.run(task(tmp_path, stops_after=1))
    assert len(outcome.figures["round_mm_of_each_run"]) == 1
    found = figures(outcome)
    both = (found["round 1: error, mean"] + found["round 2: error, mean"]) / 2
    assert outcome.holds == (both <= 1.5 * found["error with the whole arm, both rounds"])
    assert {path.name for path in tmp_path.iterdir()} == {"figure-2-e.png", "figure-2-f.png"}


def test_network_and_samples_from_end_to_end(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    tiny = thuruthel_network_size.Parameters(TINY, hidden=(1, 8), samples=(40, 400), seeds=2)
    monkeypatch.setattr(thuruthel_network_size, "QUICK", tiny)
    monkeypatch.setattr(thuruthel_network_size, "CHOSEN", 8)
    outcome = thuruthel_network_size.run(task(tmp_path))
    found = figures(outcome)
    assert found["8 units: training error"] < found["1 units: training error"]
    assert found["400 samples: error"] <= found["400 samples: error, worst run"]
    assert np.shape(outcome.figures["by_size"]) == (2, 2, 3)
    assert {path.name for path in tmp_path.iterdir()} == {"figure-1-a.png", "figure-1-b.png"}
    monkeypatch.setattr(thuruthel_network_size, "QUICK", replace(tiny, hidden=(8, 1), seeds=1))
    stopped = thuruthel_network_size.run(task(tmp_path, stops_after=1))
    assert np.shape(stopped.figures["by_size"]) == (1, 1, 3)
    assert not stopped.holds


def made_up(first: float, second: float, settled: float) -> Followed:
    errors, way = np.repeat([first, second], 100), np.zeros((200, 3))
    return Followed(way, errors, way, errors, np.full(100, settled))


@pytest.mark.parametrize(
    ("first", "second", "settled", "holds"),
    [(30.0, 30.0, 29.0, True), (30.0, 40.0, 40.0, False), (30.0, 30.0, 10.0, False), (101.0, 101.0, 101.0, False)],
)
def test_the_circles_verdict_by_hand(first: float, second: float, settled: float, holds: bool):
    assert judged([made_up(first, second, settled)] * 2)[0] is holds
