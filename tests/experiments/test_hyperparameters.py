from collections import Counter
from dataclasses import replace
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import spearmanr

from toddle.experiments import mahboob_hyperparameters as study
from toddle.experiments.experiment import Task
from toddle.experiments.mahboob_tables import Cell, cells
from toddle.experiments.padded import PaddedPerceptron, silence
from toddle.experiments.ranks import rank_correlation
from toddle.reach.learn.perceptron import Layer, Layers, Perceptron


def test_the_tables_are_those_of_the_document():
    found = cells()
    assert len(found) == 280
    sizes = Counter(cell.table for cell in found)
    assert [sizes[f"C.{i}"] for i in range(1, 22)] == [19, 16, 8, 8, 7, 6, 7, 5, *[13] * 12, 48]
    assert Cell("C.1", 2, 0.1, 0.1, 0.236096, 0.026751) in found
    assert Cell("C.9", 10, 0.717, 0.233, 0.046847, 0.005433) in found
    assert Cell("C.21", 10, 0.8, 0.35, 0.037193, 0.005857) in found
    assert min(found, key=lambda cell: cell.mean).mean == 0.037193


def test_the_misprints_are_read_as_told():
    (mended,) = [cell for cell in cells() if cell.table == "C.14" and cell.hidden == 2]
    assert mended.mean == pytest.approx(0.088395)
    assert {cell.learning_rate for cell in cells() if cell.table == "C.8"} == {0.07}


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=3))
def test_rank_correlation_is_that_of_scipy(pairs: list[tuple[int, int]]):
    a, b = np.array(pairs, float).T
    if len(set(a)) > 1 and len(set(b)) > 1:
        assert rank_correlation(a, b) == pytest.approx(spearmanr(a, b)[0])


def test_a_padded_perceptron_learns_exactly_as_one_without_padding():
    width, units, rate = 7, 3, jnp.float32(0.7)
    wide, narrow = Perceptron(rate, (width,)), Perceptron(rate, (units,))
    keys = jax.random.split(jax.random.key(0), 3)
    padded = PaddedPerceptron(wide, jnp.int32(units))
    state = silence(wide.init(keys[0], jnp.full(2, 0.5), jnp.full(4, 0.5)), padded.units)
    (inner, bias), (out, out_bias) = state.now
    small = Layers((Layer(inner[:units], bias[:units]), Layer(out[:, :units], out_bias)), None)

    @eqx.filter_jit
    def learn(learner, state, xs, qs):
        def step(s, sample):
            return learner.update(s, *sample, jnp.float32(1.0)), None

        return jax.lax.scan(step, state, (xs, qs))[0]

    xs, qs = jax.random.uniform(keys[1], (300, 2)), jax.random.uniform(keys[2], (300, 4))
    state, small = learn(padded, state, xs, qs), learn(narrow, small, xs, qs)
    for x in xs[:5]:
        np.testing.assert_allclose(padded.predict(state, x), narrow.predict(small, x), atol=1e-6)
    (inner, bias), (out, _) = state.now
    assert not np.any(inner[units:])
    assert not np.any(out[:, units:])
    assert np.all(np.asarray(bias[units:]) < -1e8)
    assert np.any(np.asarray(out[:, :units]) != 0)


@pytest.mark.parametrize("parameters", [study.QUICK, study.FULL])
def test_every_run_is_in_one_batch_wide_enough(parameters: study.Parameters):
    chosen = [cell for cell in cells() if not parameters.hidden or cell.hidden in parameters.hidden]
    found = study.batches(chosen, parameters)
    runs = [run for batch in found for run in batch.runs]
    assert sorted(runs) == [(i, seed) for i in range(len(chosen)) for seed in range(parameters.seeds)]
    for batch in found:
        assert len(batch.runs) <= parameters.rows
        assert all(chosen[cell].hidden <= batch.width for cell, _ in batch.runs)
        assert batch.width > 0 or all(chosen[cell].hidden == 0 for cell, _ in batch.runs)


def test_a_cells_figure_is_the_mean_of_the_settled_tests():
    cell = Cell("C.1", 2, 0.1, 0.1, 0.2, 0.02)
    parameters = replace(study.FULL, settled=1, seeds=3)
    done = {(0, 0): np.array([9.0, 0.2, 0.4]), (0, 2): np.array([9.0, 0.1, 0.1])}
    (row,) = study.measured([cell, cell], done, parameters)
    assert row["ours_mean"] == pytest.approx((0.3 + 0.1) / 2)
    assert row["ours_std"] == pytest.approx((0.1 + 0.0) / 2)
    assert row["ours_std_between_seeds"] == pytest.approx(0.1)


TINY = replace(
    study.FULL, robot="planar:2", movements=100, per_cycle=25, settled=1, seeds=1, hidden=(17, 40), widths=(40,), rows=3
)


def task(folder: Path, stopped: bool = False) -> Task:
    return Task(False, 0, None, folder, lambda _done, _news: None, lambda: stopped)


def test_a_small_study_from_end_to_end(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setattr(study, "QUICK", TINY)
    outcome = study.run(task(tmp_path))
    assert outcome.parameters == TINY
    assert [(cell["table"], cell["hidden"]) for cell in outcome.figures["cells"]] == [("C.1", 17), ("C.6", 40)]
    assert abs(outcome.figures["rank_correlation"]) == pytest.approx(1.0)
    assert outcome.holds == (outcome.figures["rank_correlation"] >= 0.95)
    assert {"figure-4-2.png", "all-cells.png"} <= {path.name for path in tmp_path.iterdir()}
    assert not (tmp_path / "figure-4-5.png").exists()  # no cell of it was asked for


def test_stopped_at_once_it_says_so(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setattr(study, "QUICK", TINY)
    outcome = study.run(task(tmp_path, stopped=True))
    assert not outcome.holds
    assert "stopped" in outcome.verdict
