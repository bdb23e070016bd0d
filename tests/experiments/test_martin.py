import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from toddle.experiments import martin_evolution, martin_generalisation, martin_sensitivity
from toddle.experiments.experiment import Task
from toddle.experiments.martin_arms import ARMS, METHODS, TABLE_3, Setting, arm_named, fresh_goals, goals_of, shape_of
from toddle.robots.dh import UNIT

SMALL = Setting(goals=8, population=10, generations=6, runs=3, hidden=3)


def small_task(folder: Path, stopped=lambda: False) -> Task:
    return Task(False, 0, 3, folder, lambda done, what: None, stopped)


def test_table_3_has_the_means_and_deviations_that_the_document_prints():
    printed = {
        ("planar", "CMA-ES"): (4.1971, 4.3204),
        ("planar", "NEAT"): (4.9218, 0.3243),
        ("SCARA", "CMA-ES"): (228.8792, 361.0539),
        ("SCARA", "NEAT"): (15.1777, 2.0695),
    }
    for cell, (mean, deviation) in printed.items():
        values = np.array(TABLE_3[cell])
        assert len(values) == 30
        assert np.all(np.diff(values) >= 0)
        assert values.mean() == pytest.approx(mean, abs=6e-5)
        assert values.std(ddof=1) == pytest.approx(deviation, abs=6e-5)


@pytest.mark.parametrize(("name", "freedom"), [("planar", 29.3269), ("SCARA", 29.0019)])
def test_welchs_test_of_table_3_is_that_of_table_4(name: str, freedom: float):
    found = martin_evolution.welch(*(np.array(TABLE_3[name, method]) for method in METHODS))
    t, significance = martin_evolution.TABLE_4[name]
    assert found.t == pytest.approx(t, abs=6e-5)
    assert found.freedom == pytest.approx(freedom, abs=6e-5)
    assert found.p == pytest.approx(significance, abs=6e-5)


@pytest.mark.parametrize("name", ARMS)
def test_goals_come_from_the_joint_values_that_the_setting_names(name: str):
    arm = arm_named(name)
    goals = goals_of(arm, Setting(), 500, 0) / UNIT
    reach = {"planar": (8.625, 8.625, 6.125), "SCARA": (20, 20)}[name]
    most = np.cumsum(reach)[-1]
    # the elbows bend by at least 18 degrees: no goal needs the stretched arm
    assert np.linalg.norm(goals[:, :2], axis=1).max() < 0.995 * most
    if name == "SCARA":
        assert goals[:, 2].min() > -16
        assert goals[:, 2].max() < -4
    fresh = fresh_goals(arm, Setting())
    assert not np.any(np.all(np.isclose(goals[:, None] * UNIT, fresh[None]), axis=2))


def test_inputs_are_scaled_as_the_setting_says():
    arm = arm_named("SCARA")
    goals = goals_of(arm, Setting(), 5000, 3)
    for setting, method, edge in (
        (Setting(), "CMA-ES", 1.0),
        (Setting(inputs=3.0), "CMA-ES", 3.0),
        (Setting(), "NEAT", 0.1),
    ):
        inputs = shape_of(arm, setting, method).inputs
        assert np.abs((goals - inputs.centre) / inputs.half).max() == pytest.approx(edge, rel=0.02)
    raw = shape_of(arm, Setting(inputs=0.0), "CMA-ES").inputs
    np.testing.assert_allclose((goals - raw.centre) / raw.half, goals / UNIT)


def test_evolution_reports_every_cell_beside_the_document(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(martin_evolution, "QUICK", martin_evolution.Parameters(SMALL, best_runs=2))
    outcome = martin_evolution.run(small_task(tmp_path))
    assert not outcome.holds  # six generations are too few
    assert {path.name for path in tmp_path.iterdir()} == {"figure-5.png", "figure-6.png"}
    best = {row.what: row for row in outcome.rows if row.what.endswith("best run")}
    assert [row.document for row in best.values()] == [0.1976, 4.1564, 0.0529, 10.344]
    for cell, values in outcome.figures["mse_of_each_run"].items():
        name, method = cell.split(" ")
        assert best[f"{name} arm, {method}: MSE, best run"].ours == values[0] == min(values)
        assert len(values) == 3
    json.dumps([dict(outcome.figures), asdict(outcome.parameters)])


def test_the_learned_body_beats_evolution_on_fresh_goals_at_its_budget(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    setting = replace(SMALL, goals=20, generations=120, population=20)
    parameters = martin_generalisation.Parameters(setting, restarts=2, iterations=60, imagined=40, starts=8)
    monkeypatch.setattr(martin_generalisation, "QUICK", parameters)
    outcome = martin_generalisation.run(small_task(tmp_path))
    assert outcome.holds
    for ways in outcome.figures.values():
        evolution = ways["CMA-ES, best run"]
        assert evolution["asked"] == 20 * 20 * 120 == ways["CMA-ES, restarted, best run"]["asked"]
        assert ways["body learned, controller by LM on 70 goals"]["asked"] == 300
        assert ways[martin_generalisation.SOLVED]["fresh"] < 0.01 * evolution["fresh"]
        noisy = ways[f"{martin_generalisation.SOLVED}, seen with 1 mm noise"]
        assert ways[martin_generalisation.SOLVED]["fresh"] < noisy["fresh"] < 0.01
    json.dumps([dict(outcome.figures), asdict(outcome.parameters)])


def test_sensitivity_draws_each_method_and_counts_readings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(martin_sensitivity, "QUICK", martin_sensitivity.Parameters(SMALL, only=2))
    outcome = martin_sensitivity.run(small_task(tmp_path))
    assert {path.name for path in tmp_path.iterdir()} == {"cma-es.png", "neat.png"}
    assert len(outcome.rows) == 2 * 2 * 2 * 2
    assert {what for some in outcome.figures.values() for what in some} >= {"as taken", "5 hidden neurons"}
    json.dumps([dict(outcome.figures), asdict(outcome.parameters)])


def test_each_variant_changes_what_it_names():
    setting = Setting()
    more = {"as taken": 0, "goals and outputs within ±90 deg": 2}
    for method, some in martin_sensitivity.variants(setting).items():
        for what, changed in some.items():
            differing = [key for key, value in asdict(changed).items() if value != asdict(setting)[key]]
            assert len(differing) == more.get(what, 1), (method, what)


def test_whoever_stops_an_experiment_gets_what_was_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(martin_evolution, "QUICK", martin_evolution.Parameters(SMALL, best_runs=2))
    outcome = martin_evolution.run(small_task(tmp_path, stopped=lambda: True))
    assert not outcome.holds
    monkeypatch.setattr(martin_sensitivity, "QUICK", martin_sensitivity.Parameters(SMALL, only=2))
    assert not martin_sensitivity.run(small_task(tmp_path, stopped=lambda: True)).rows
