import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.reach.evolve.controller import Scale, Shape, inputs_of, respond, respond_with_slopes


def shape(space: int = 2, hidden: int = 3, joints: int = 4) -> Shape:
    random = np.random.default_rng(0)
    scales = [Scale(random.standard_normal(n), random.uniform(0.5, 2.0, n)) for n in (space, joints)]
    return Shape(hidden, *scales)


def test_a_controller_has_as_many_numbers_as_the_document_says():
    assert shape(space=2, hidden=3, joints=4).weights == (2 + 1) * 3 + 3 * 4


def test_it_answers_by_equation_1():
    one = shape()
    weights = np.random.default_rng(1).standard_normal((5, one.weights))
    goals = np.random.default_rng(2).standard_normal((7, 2))
    answers = respond(one, weights, inputs_of(one, goals))
    for row, goal in ((0, 0), (4, 6)):
        w_i, w_o = weights[row, :9].reshape(3, 3), weights[row, 9:].reshape(3, 4)
        a_i = np.append((goals[goal] - one.inputs.centre) / one.inputs.half, 1)
        a_o = np.tanh(np.tanh(a_i @ w_i) @ w_o)
        np.testing.assert_allclose(answers[row, :, goal], one.outputs.centre + one.outputs.half * a_o, rtol=1e-12)


def test_half_the_precision_is_enough():
    one = shape()
    weights, goals = np.random.default_rng(1).standard_normal((5, one.weights)), np.zeros((3, 2))
    exact = respond(one, weights, inputs_of(one, goals))
    rough = respond(one, weights, inputs_of(one, goals).astype(np.float32))
    assert rough.dtype == np.float32
    np.testing.assert_allclose(rough, exact, atol=1e-5)


@given(st.integers(1, 3), st.integers(1, 4), st.integers(1, 4), st.integers(0, 1000))
def test_slopes_are_those_of_finite_differences(space: int, hidden: int, joints: int, seed: int):
    one, random = shape(space, hidden, joints), np.random.default_rng(seed)
    weights, goals = random.standard_normal((2, one.weights)), random.standard_normal((3, space))
    inputs, small = inputs_of(one, goals), 1e-6
    answers, slopes = respond_with_slopes(one, weights, inputs)
    np.testing.assert_allclose(answers, respond(one, weights, inputs))
    for k in range(one.weights):
        step = small * np.eye(one.weights)[k]
        moved = (respond(one, weights + step, inputs) - respond(one, weights - step, inputs)) / (2 * small)
        np.testing.assert_allclose(slopes[..., k], moved.transpose(0, 2, 1), atol=1e-7)


@pytest.mark.parametrize("large", [1e3, -1e3])
def test_answers_stay_within_their_scale(large: float):
    one = shape()
    answers = respond(one, np.full((1, one.weights), large), inputs_of(one, np.ones((1, 2))))[0, :, 0]
    assert np.all(np.abs(answers - one.outputs.centre) <= one.outputs.half * (1 + 1e-12))
