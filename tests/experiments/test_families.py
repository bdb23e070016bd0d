from dataclasses import replace
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tiny import session

from toddle.experiments import mahboob_planar5 as planar5
from toddle.experiments import rolf_direction_sampling as rolf
from toddle.experiments.capacity import capacity
from toddle.experiments.experiment import Task
from toddle.experiments.families import Family, errors_point_by_point, learn_family, open_for
from toddle.reach import loop
from toddle.reach.config import ReachConfig
from toddle.robots.body import Body


def task(folder: Path, stops_after: int | None = None) -> Task:
    told: list[float] = []

    def stopped() -> bool:
        return stops_after is not None and len(told) >= stops_after

    return Task(False, 5, None, folder, lambda done, _: told.append(done), stopped)


@pytest.fixture(scope="module")
def family(tmp_path_factory: pytest.TempPathFactory) -> Family:
    return learn_family(session(), 2, task(tmp_path_factory.mktemp("family")), keep=(200,))


def test_a_family_learns_as_single_runs_do(family: Family):
    opened = session()
    assert isinstance(opened.body, Body)
    whole = eqx.filter_jit(loop.learn_in_cycles)
    for key, fixed, seen in zip(jax.random.split(jax.random.key(5), 2), family.fixed, family.seen, strict=True):
        targets = jnp.asarray(opened.targets, jnp.float32)
        _, scores = whole(opened.setting, opened.body, key, 4, 100, targets, opened.reachable_cells)
        np.testing.assert_allclose(1000 * scores.fixed_error, fixed, rtol=1e-3)
        np.testing.assert_allclose(1000 * scores.seen_error, seen, rtol=1e-3)
    assert family.samples.tolist() == [100, 200, 300, 400]
    assert family.complete


def test_what_is_kept_is_the_first_runs_progress_then(family: Family):
    assert int(family.kept[200].seen.total) == 200
    fixed, seen_points, seen = errors_point_by_point(family, family.best)
    assert fixed.mean() == pytest.approx(family.fixed[0].min(), rel=1e-4)
    assert seen.mean() == pytest.approx(family.seen[0, family.fixed[0].argmin()], rel=1e-4)
    assert seen_points.shape == session().targets.shape


def test_lines_are_counted_once_a_saturated_movement(family: Family):
    assert np.all(np.diff(family.lines, axis=1, prepend=0) >= 0)
    assert np.all(family.lines[:, -1] <= family.samples[-1])


def test_a_stopped_family_has_what_was_done(tmp_path: Path):
    stopped = learn_family(session(), 2, task(tmp_path, stops_after=2))
    assert stopped.samples.tolist() == [100, 200]
    assert not stopped.complete


def made_up(fixed: list[list[float]], seen: list[list[float]]) -> Family:
    progress = loop.begin(session().setting, jax.random.key(0))
    values = np.array(fixed, float)
    samples = 100.0 * np.arange(1, values.shape[1] + 1)
    return Family(session(), samples, values, values, np.array(seen, float), values, progress, progress, {})


def test_best_cycle_and_settling_by_hand():
    found = made_up([[9, 2, 3, 4, 4], [9, 8, 4, 6, 6]], [[1, 2, 3, 4, 5], [10, 20, 30, 40, 50]])
    assert found.best_cycle() == ((2 + 4) / 2, (2 + 30) / 2)
    assert found.settled(0.4) == (5.0, (4 + 5 + 40 + 50) / 4)
    # means 9, 5, 3.5, 5, 5: it settles at 5, and is within a tenth of that from the second test on
    assert found.settles_at(window=1) == 1
    # running means of two: 7, 4.25, ...: the second of them ends at the third test
    assert found.settles_at(window=2) == 2


def test_trained_through_its_kinematics_a_network_gets_better():
    # one joint: the angle of a target on a half circle, which a few units come close to
    opened = open_for("planar:1", ReachConfig(hidden=(6,), test_points=20))
    barely, trained = (capacity(opened, starts=2, steps=steps, seed=0) for steps in (1, 300))
    assert trained < 0.1 * barely
    assert trained < 20  # [mm], of an arm of one metre


def test_the_planar_arm_from_end_to_end(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    tiny = replace(
        planar5.QUICK, hidden=(4,), movements=200, per_cycle=100, discovery=(100, 200), limits_deg=(90.0,), seeds=1
    )
    monkeypatch.setattr(planar5, "QUICK", tiny)
    monkeypatch.setattr(planar5, "MAJOR_BY", 200)
    outcome = planar5.run(task(tmp_path))
    visited = {row.what: row.ours or 0.0 for row in outcome.rows if row.unit == "%"}
    assert list(visited) == ["workspace visited by 100 movements", "workspace visited by 200 movements"]
    first, second = visited.values()
    assert 0 < first < second < 50  # 200 movements can enter 200 cells of some 1,000
    assert not outcome.holds
    assert {path.name for path in tmp_path.iterdir()} == {"figure-a-3-a-4.png", "figure-a-5-a-8.png"}


@pytest.mark.parametrize("joints", [5, 50])
def test_the_bent_arm_points_straight_ahead_within_its_limits(joints: int):
    bent = rolf.arm(joints, rolf.FULL)
    reach, sideways = np.asarray(bent.forward(bent.home))
    assert sideways == pytest.approx(0.0, abs=1e-5)
    assert 0.3 < reach < 0.95
    assert np.all((np.asarray(bent.home) > np.asarray(bent.lower)) & (np.asarray(bent.home) < np.asarray(bent.upper)))
    assert np.sum(np.asarray(bent.home)[1:]) == pytest.approx(0.9 * np.pi * (joints - 1) / joints, rel=1e-5)


def test_the_goals_lie_on_their_ring():
    goals = rolf.goals_on_a_ring(rolf.FULL, seed=0)
    assert len(goals) == 110
    distance, angle = np.linalg.norm(goals, axis=1), np.arctan2(goals[:, 1], goals[:, 0])
    assert np.all((distance >= 0.3) & (distance <= 0.95))
    assert np.all(np.abs(angle) <= 2.0)
    assert angle.min() < -1.5
    assert angle.max() > 1.5
