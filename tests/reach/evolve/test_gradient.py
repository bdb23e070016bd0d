import numpy as np
import pytest
from scipy.optimize import least_squares

from toddle.reach.evolve.controller import Shape, inputs_of, respond
from toddle.reach.evolve.gradient import _linearised, refine
from toddle.reach.evolve.score import Arm, arm_of, scores
from toddle.reach.model.rigid import Rigid
from toddle.robots.dh import planar3, scara


def problem(name: str, hidden: int = 4, count: int = 12) -> tuple[Arm, Rigid, Shape, np.ndarray]:
    arm = arm_of({"planar": planar3, "scara": scara}[name]())
    numbers = 7 * len(arm.lower) + 6
    model = Rigid(arm.linkage, np.zeros((numbers, numbers)), arm.coordinates)
    return arm, model, Shape(hidden, arm.workspace(), arm.joints), arm.drawn(count, 0)


@pytest.mark.parametrize("name", ["planar", "scara"])
def test_slope_and_error_are_those_of_finite_differences(name: str):
    arm, model, shape, goals = problem(name)
    inputs, small = inputs_of(shape, goals), 1e-6
    weights = np.random.default_rng(0).standard_normal((2, shape.weights))
    mse, normal, slope = _linearised(shape, model, goals, inputs, weights)

    def score(some: np.ndarray) -> np.ndarray:
        return scores(arm, respond(shape, some, inputs), goals)

    np.testing.assert_allclose(mse, score(weights), rtol=1e-12)
    for k in range(shape.weights):
        step = small * np.eye(shape.weights)[k]
        by_differences = (score(weights + step) - score(weights - step)) / (4 * small)  # half the slope of the mean
        np.testing.assert_allclose(slope[:, k], by_differences, atol=1e-9)
    assert np.all(np.linalg.eigvalsh(normal) > -1e-12)


@pytest.mark.parametrize("name", ["planar", "scara"])
def test_it_comes_as_low_as_scipy_does(name: str):
    arm, model, shape, goals = problem(name, hidden=2, count=20)
    inputs = inputs_of(shape, goals)
    starts = 0.5 * np.random.default_rng(1).standard_normal((6, shape.weights))
    ours = refine(shape, model, goals, starts, 300)

    def missed(weights: np.ndarray) -> np.ndarray:
        q = respond(shape, weights[None], inputs)[0]
        return (model.forward(q.T) - goals).ravel() / np.sqrt(len(goals))

    theirs = [2 * least_squares(missed, one, max_nfev=60).cost for one in starts]
    np.testing.assert_allclose(ours.mse, scores(arm, respond(shape, ours.weights, inputs), goals), rtol=1e-9)
    assert ours.mse.min() <= 1.05 * min(theirs)
    assert np.median(ours.mse) <= 1.05 * np.median(theirs)


def test_more_iterations_never_make_it_worse():
    _, model, shape, goals = problem("planar")
    starts = np.random.default_rng(2).standard_normal((5, shape.weights))
    course = np.array([refine(shape, model, goals, starts, k).mse for k in (0, 1, 5, 20)])
    assert np.all(np.diff(course, axis=0) <= 0)
    assert np.all(course[-1] < course[0])
