import numpy as np
import pytest

from toddle.reach.evolve.controller import Shape
from toddle.reach.evolve.evolution import Effort, Evolution, evolve_networks, evolve_weights
from toddle.reach.evolve.neat import Settings
from toddle.reach.evolve.score import arm_of, scores
from toddle.robots.dh import planar3

ARM = arm_of(planar3())
GOALS = ARM.drawn(15, 0)
SHAPE = Shape(3, ARM.workspace(), ARM.joints)
EFFORT = Effort(runs=3, population=20, generations=40)
METHODS = {
    "CMA-ES": lambda effort, **more: evolve_weights(ARM, SHAPE, GOALS, effort, sigma=0.5, **more),
    "NEAT": lambda effort, **more: evolve_networks(ARM, SHAPE, GOALS, effort, settings=Settings(add_node=0.1), **more),
}


@pytest.fixture(scope="module", params=METHODS)
def method(request: pytest.FixtureRequest):
    return METHODS[request.param]


@pytest.fixture(scope="module")
def found(method) -> Evolution:
    return method(EFFORT)


def test_the_lowest_error_only_falls(found: Evolution):
    assert found.course.shape == (40, 3)
    assert np.all(np.diff(found.course, axis=0) <= 0)
    assert np.all(found.mse < 0.5 * found.course[0])


def test_the_best_controllers_make_the_error_that_is_told(found: Evolution):
    np.testing.assert_allclose(scores(ARM, found.answers(GOALS), GOALS), found.mse, rtol=1e-3)


def test_a_seed_makes_the_same_runs_again(method, found: Evolution):
    np.testing.assert_array_equal(method(EFFORT).course, found.course)
    assert not np.array_equal(method(Effort(3, 20, 40, seed=1)).course, found.course)


def test_whoever_asks_to_stop_gets_what_was_done(method, found: Evolution):
    told: list[float] = []

    def tell(done: float) -> bool:
        told.append(done)
        return len(told) == 5

    stopped = method(EFFORT, tell=tell)
    np.testing.assert_array_equal(stopped.course, found.course[:5])
    assert told == pytest.approx([k / 40 for k in range(1, 6)])
