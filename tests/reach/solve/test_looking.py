import numpy as np
import pytest

from toddle.failures import BadInput
from toddle.reach.model.kernel import fit_kernel
from toddle.reach.solve.gauss_newton import solve_model
from toddle.reach.solve.looking import aimed, begun, correct, seen
from toddle.reach.solve.solver import ModelSolver
from toddle.signals import Experience

LOWER, UPPER = -np.ones(3), np.ones(3)


def tip(q):
    return np.stack([q[:, 0] + 0.3 * q[:, 1] * q[:, 2], q[:, 1] + 0.2 * np.sin(2 * q[:, 0]), q[:, 2] ** 3 + q[:, 2]], 1)


class Rough:
    """A model that is wrong by a smooth function of about 1 cm, and knows how much."""

    space = 3

    def __init__(self, size=0.01, said=1.0):
        self.size, self.said = size, said

    def forward(self, q):
        wrong = np.stack([np.cos(1.5 * q[:, 1]), np.sin(q[:, 0] + 1), np.cos(q[:, 2] - q[:, 0])], axis=1)
        return tip(q) + self.size * wrong

    def slope(self, q):
        steps = 1e-6 * np.eye(3)
        return self.forward(q), np.stack(
            [(self.forward(q + step) - self.forward(q - step)) / 2e-6 for step in steps], axis=2
        )

    def spread(self, q):
        return np.broadcast_to((self.said * self.size) ** 2 * np.eye(3) / 2, (len(q), 3, 3))


@pytest.fixture(scope="module")
def targets():
    return tip(np.random.default_rng(1).uniform(-0.8, 0.8, (300, 3)))


def started(model, targets):
    q = np.random.default_rng(2).uniform(LOWER, UPPER, (400, 3))
    return solve_model(model, targets, LOWER, UPPER, memory=(q, model.forward(q))).q


def errors(course, targets):
    return np.linalg.norm(np.stack([tip(q) for q in course.q]) - targets, axis=2)


def looked(model, targets, looks, sensor, seed=0):
    rng = np.random.default_rng(seed)

    def observe(q):
        return tip(q) + sensor * rng.normal(size=(len(q), 3))

    return correct(
        model, None, observe, targets, started(model, targets), looks, sensor=sensor, lower=LOWER, upper=UPPER
    )


def test_exact_looks_end_at_the_target(targets):
    course = looked(Rough(), targets, 3, 0.0)
    missed = errors(course, targets)
    assert np.mean(missed[0]) > 5e-3
    assert np.percentile(missed[1], 99) < 1e-3
    assert np.percentile(missed[3], 99) < 1e-5


def test_answers_stay_within_the_limits(targets):
    course = looked(Rough(0.1), targets, 4, 0.01)
    assert (course.q >= LOWER).all()
    assert (course.q <= UPPER).all()


def test_noisy_looks_are_averaged_and_the_model_is_not_forgotten(targets):
    sensor, looks = 2e-3, 6
    mean = errors(looked(Rough(0.01), targets, looks, sensor), targets).mean(axis=1)
    alone = sensor * np.sqrt(8 / np.pi / looks)  # mean length of an average of the looks alone
    assert mean[6] < 1.25 * alone
    assert (np.diff(mean[1:]) < 0.05 * mean[1:-1]).all()
    # a model that is surer than the sensor is hardly worse for having looked
    sure = errors(looked(Rough(2e-4), targets, looks, sensor), targets).mean(axis=1)
    assert sure[6] < 1.5 * sure[0]


def test_what_is_expected_happens(targets):
    for model, sensor in ((Rough(0.01), 2e-3), (Rough(0.003), 2e-3), (Rough(0.01), 5e-3)):
        course = looked(model, targets, 5, sensor)
        missed = errors(course, targets)
        for look in range(1, 6):
            assert 0.8 < np.mean(missed[look] <= course.expected_90[look]) < 0.99
            assert 0.7 < np.mean(missed[look]) / np.mean(course.expected[look]) < 1.4


def test_a_model_that_is_too_sure_of_itself_is_mended(targets):
    missed = errors(looked(Rough(0.05, said=0.01), targets, 6, 1e-3), targets)
    assert np.mean(missed[0]) > 0.03
    assert np.mean(missed[6]) < 2e-3


def test_a_dead_joint_is_worked_around(targets):
    """The first joint's motor stays at 0.1, and nobody said so: what it was asked for is made up by the others."""
    model = Rough(0.005)

    def stuck(q):
        return tip(np.concatenate([np.full((len(q), 1), 0.1), q[:, 1:]], axis=1))

    goals = stuck(np.random.default_rng(4).uniform(-0.7, 0.7, (100, 3)))
    q = started(model, goals)
    course = correct(model, None, stuck, goals, q, 6, sensor=0.0, lower=LOWER, upper=UPPER)
    ends = [np.mean(np.linalg.norm(stuck(each) - goals, axis=1)) for each in course.q]
    assert ends[6] < 0.3 * ends[0]


def test_a_solver_is_asked_where_no_posture_nearby_will_do():
    """Folded to the one side the arm stands at a limit; folded to the other it reaches."""

    def bent(q):
        return np.stack([np.cos(q[:, 0]) + np.cos(q.sum(1)), np.sin(q[:, 0]) + np.sin(q.sum(1))], axis=1)

    rng, lower, upper = np.random.default_rng(0), np.array([-0.4, -2.0]), np.array([2.0, 2.0])
    known = rng.uniform(lower, upper, (300, 2))
    fit = fit_kernel(Experience(known, bent(known)), lower, upper)
    solver = ModelSolver(fit.model, lower, upper, Experience(known, bent(known)))
    right = np.array([[0.0, -1.5]])
    target = bent(right) + 0
    wrong = np.array([[-0.4, 1.0]])
    without, asked = (
        correct(fit.model, who, bent, target, wrong, 3, sensor=0.0, lower=lower, upper=upper) for who in (None, solver)
    )
    assert np.linalg.norm(bent(asked.q[-1]) - target) < 1e-4
    assert np.linalg.norm(bent(without.q[-1]) - target) >= np.linalg.norm(bent(asked.q[-1]) - target)


def test_looks_go_on_from_one_target_to_the_next(targets):
    model = Rough()
    q = started(model, targets)
    course = correct(model, None, tip, targets, q, 3, sensor=0.0, lower=LOWER, upper=UPPER)
    near = targets + 0.01
    first = aimed(course.looks, model, near, course.q[-1], LOWER, UPPER)
    assert np.mean(np.linalg.norm(tip(first) - near, axis=1)) < 2e-3
    again = seen(begun(model, q, 0.0, LOWER, UPPER), model, q, tip(q))
    assert again.q.shape == (300, 1, 3)


def test_targets_are_corrected_as_if_alone(targets):
    together = looked(Rough(), targets[:4], 3, 0.0)
    for i in range(4):
        np.testing.assert_allclose(looked(Rough(), targets[i : i + 1], 3, 0.0).q[:, 0], together.q[:, i], atol=1e-6)


def test_fewer_than_no_looks_are_refused(targets):
    with pytest.raises(BadInput, match="-1 looks"):
        looked(Rough(), targets[:2], -1, 0.0)
