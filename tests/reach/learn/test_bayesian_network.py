"""The Bayesian network against finite differences, dense linear algebra, and data whose noise is known."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.failures import BadInput
from toddle.reach.learn import evidence
from toddle.reach.learn.bayesian_network import train
from toddle.reach.learn.evidence import Samples, Weights


def problem(samples: int = 40, inputs: int = 3, hidden: int = 4, outputs: int = 2) -> tuple[Weights, Samples]:
    drawn = np.random.default_rng(0)
    weights = Weights(drawn.normal(size=(hidden, inputs + 1)), drawn.normal(size=(outputs, hidden + 1)))
    x = evidence.with_one(drawn.normal(size=(samples, inputs)))
    return weights, Samples(x, drawn.normal(size=(samples, outputs)))


def errors_and_jacobian(weights: Weights, samples: Samples) -> tuple[np.ndarray, np.ndarray]:
    """e and J, J by central differences."""

    def errors(w: Weights) -> np.ndarray:
        return (
            np.column_stack([np.tanh(samples.x @ w.hidden.T), np.ones(len(samples.x))]) @ w.output.T - samples.y
        ).ravel()

    steps = 1e-5 * np.eye(len(weights.flat()))
    return errors(weights), np.stack(
        [(errors(weights.less(-s)) - errors(weights.less(s))) / 2e-5 for s in steps], axis=1
    )


def test_the_normal_equations_are_those_of_the_jacobian():
    weights, samples = problem()
    e, jacobian = errors_and_jacobian(weights, samples)
    gradient, matrix = evidence.normal_equations(weights, samples)
    np.testing.assert_allclose(gradient, jacobian.T @ e, atol=1e-6)
    np.testing.assert_allclose(matrix, jacobian.T @ jacobian, atol=1e-6)
    assert evidence.squared_errors(weights, samples) == pytest.approx(e @ e)


@given(st.floats(1e-3, 1e4), st.floats(1e-4, 1e4), st.integers(2, 12))
def test_one_decomposition_serves_every_damping(beta: float, shift: float, size: int):
    drawn = np.random.default_rng(size)
    root, vector = drawn.normal(size=(size + 3, size)), drawn.normal(size=size)
    matrix = root.T @ root
    parts = evidence.decompose(matrix)
    np.testing.assert_allclose(parts.eigenvalues, np.linalg.eigvalsh(matrix), rtol=1e-9, atol=1e-9)
    solution = evidence.turned(parts, evidence.solved(parts, beta, shift, evidence.turned(parts, vector, "T")), "N")
    expected = np.linalg.solve(beta * matrix + shift * np.eye(size), vector)
    np.testing.assert_allclose(solution, expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())


def test_every_step_lowers_what_it_minimises_and_weighs_by_the_evidence():
    weights, samples = problem(samples=60)
    steps = list(evidence.courses(weights, samples, 12))
    assert len(steps) == 13
    for before, after in itertools.pairwise(steps):
        objective = before.beta * before.errors + before.alpha * before.squares
        assert before.beta * after.errors + before.alpha * after.squares < objective
        _, jacobian = errors_and_jacobian(after.weights, samples)
        curved = before.beta * jacobian.T @ jacobian + before.alpha * np.eye(jacobian.shape[1])
        gamma = jacobian.shape[1] - before.alpha * np.trace(np.linalg.inv(curved))
        assert after.gamma == pytest.approx(gamma, rel=1e-5)
        assert after.squares == pytest.approx(np.sum(after.weights.flat() ** 2))
        assert after.alpha == pytest.approx(after.gamma / (2 * after.squares))
        assert after.beta == pytest.approx((samples.y.size - after.gamma) / (2 * after.errors))


@pytest.mark.parametrize("noise", [0.02, 0.2])
def test_the_evidence_finds_the_noise_and_prunes(noise: float):
    drawn = np.random.default_rng(1)
    x = drawn.uniform(-1, 1, (1500, 2))
    clean = np.column_stack([np.sin(3 * x[:, 0]) * x[:, 1], x[:, 0] + x[:, 1]])
    network, record = train(x, clean + noise * drawn.normal(size=clean.shape), hidden=15, iterations=60)
    # beta is 1 / (2 variance) of the normalised outputs, each of which has the noise over its own half range
    sigma = np.sqrt(1 / (2 * record.beta[-1]) / np.mean(network.y_scale.half**-2.0))
    assert sigma == pytest.approx(noise, rel=0.05)
    weights = len(network.weights.flat())
    assert 5 < record.gamma[-1] < 0.9 * weights
    fresh = drawn.uniform(-1, 1, (500, 2))
    truth = np.column_stack([np.sin(3 * fresh[:, 0]) * fresh[:, 1], fresh[:, 0] + fresh[:, 1]])
    assert np.sqrt(np.mean((network.predict(fresh) - truth) ** 2)) < 0.3 * noise
    # nothing was learned by heart: as good on what it was tested on
    assert record.test_error[-1] < 1.15 * record.train_error[-1]


def test_noise_alone_is_not_learned_by_heart():
    drawn = np.random.default_rng(2)
    x, y = drawn.uniform(-1, 1, (150, 4)), drawn.normal(size=(150, 1))
    network, record = train(x, y, hidden=20, iterations=60)
    assert record.gamma[-1] < 0.25 * len(network.weights.flat())
    assert record.test_error[-1] < 1.4 * record.train_error[-1]


@given(st.floats(0.01, 100), st.floats(-10, 10), st.integers(0, 3))
def test_units_do_not_matter(scale: float, offset: float, seed: int):
    drawn = np.random.default_rng(seed)
    x, y = drawn.uniform(-1, 1, (30, 2)), drawn.uniform(-1, 1, (30, 2))
    plain, _ = train(x, y, hidden=3, seed=seed, iterations=5)
    scaled, _ = train(offset + scale * x, scale * y - offset, hidden=3, seed=seed, iterations=5)
    expected = scale * plain.predict(x) - offset
    np.testing.assert_allclose(scaled.predict(offset + scale * x), expected, atol=1e-5 * (scale + abs(offset)))


def test_the_slope_is_the_outputs_derivative():
    drawn = np.random.default_rng(3)
    network, _ = train(drawn.normal(size=(40, 3)), drawn.normal(size=(40, 2)), hidden=4, iterations=3)
    x = drawn.normal(size=(5, 3))
    by_hand = np.stack([(network.predict(x + s) - network.predict(x - s)) / 2e-6 for s in 1e-6 * np.eye(3)], axis=2)
    np.testing.assert_allclose(network.slope(x), by_hand, atol=1e-7)


def test_a_seed_gives_the_same_network_and_training_is_told():
    drawn, told = np.random.default_rng(4), []
    x, y = drawn.normal(size=(30, 2)), drawn.normal(size=(30, 1))
    tell = lambda number, error: told.append((number, error))  # noqa: E731
    first, record = train(x, y, hidden=3, seed=5, iterations=4, tell=tell)
    again, _ = train(x, y, hidden=3, seed=5, iterations=4)
    other, _ = train(x, y, hidden=3, seed=6, iterations=4)
    assert np.array_equal(first.predict(x), again.predict(x))
    assert not np.array_equal(first.predict(x), other.predict(x))
    assert told == list(enumerate(record.train_error[1:], start=1))


def test_a_column_that_never_varies_is_kept():
    x = np.column_stack([np.linspace(-1, 1, 20), np.full(20, 3.0)])
    network, _ = train(x, np.column_stack([x[:, 0], np.full(20, 7.0)]), hidden=2, iterations=20)
    np.testing.assert_allclose(network.predict(x)[:, 1], 7.0, atol=0.05)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"y": np.zeros((9, 1))}, "10 inputs and 9 outputs"),
        ({"x": np.zeros((1, 2)), "y": np.zeros((1, 1))}, "give at least two"),
        ({"x": np.r_[np.zeros((4, 2)), np.full((6, 2), np.nan)]}, "row 4"),
        ({"hidden": 0}, "hidden: 0"),
        ({"iterations": -1}, "iterations: -1"),
        ({"share": 0.0}, "share"),
    ],
)
def test_bad_samples_are_refused_in_a_line(unchecked: None, change: dict[str, object], line: str):
    given_ = {"x": np.zeros((10, 2)), "y": np.zeros((10, 1)), **change}
    with pytest.raises(BadInput, match=line):
        train(**given_)  # type: ignore[arg-type]
