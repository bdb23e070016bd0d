import numpy as np
import pytest

import toddle
from toddle.failures import BadInput
from toddle.reach.gather import truth
from toddle.reach.recorded import held_out_errors, learn_recorded
from toddle.robots.catalogue import Choice
from toddle.robots.chain import Chain
from toddle.signals import Experience


@pytest.fixture(scope="module")
def arm():
    body = toddle.load("nicu")
    assert isinstance(body, Chain)
    return body


def movements(arm, count, seed=0):
    rng = np.random.default_rng(seed)
    q = rng.uniform(np.asarray(arm.lower, float), np.asarray(arm.upper, float), (count, 4))
    return q, truth(arm, q)[0] + 1e-3 * rng.normal(size=(count, 3))


def test_held_out_errors_are_those_of_movements_that_a_fit_has_not_seen():
    experience = Experience(np.arange(40.0)[:, None], np.zeros((40, 3)))
    seen = []

    def fold(shown):
        seen.append(set(shown.q[:, 0]))
        known = shown.q[:, 0]
        return lambda q: np.where(np.isin(q, known), 100.0, 1.0) * np.array([1.0, 0.0, 0.0])

    np.testing.assert_allclose(held_out_errors(experience, fold, seed=0), 1.0)
    assert len(seen) == 5
    assert set.intersection(*seen) == set()


def test_without_a_description_the_ranges_are_those_visited(arm):
    q, x = movements(arm, 90)
    skill = learn_recorded(Experience(q, x), arm.joints, Choice(""), method="screws").skill
    np.testing.assert_array_equal(skill.lower, q.min(axis=0))
    unseen, truth_there = movements(arm, 200, seed=5)[0], None
    truth_there = truth(arm, unseen)[0]
    assert np.median(np.linalg.norm(skill.fit.model.forward(unseen) - truth_there, axis=1)) < 1.5e-3


def test_a_description_that_is_off_is_corrected_and_told(arm):
    q, x = movements(arm, 60)
    shift = np.array([0.0, 0.0, np.radians(3.0), 0.0])
    x = truth(arm, q + shift)[0] + (x - truth(arm, q)[0])
    found = learn_recorded(Experience(q, x), arm.joints, Choice("nicu"), described=arm)
    miss = np.linalg.norm(found.skill.fit.model.forward(q) - truth(arm, q + shift)[0], axis=1)
    assert np.percentile(miss, 99) < 2e-3
    assert any("arm_x: zero off by +3." in line or "arm_x: zero off by +2.9" in line for line in found.report)


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (lambda q, x: (np.degrees(q), x), "give radians and metres"),
        (lambda q, x: (q, np.tile(x[:1], (len(x), 1))), "the tip never moves"),
        (lambda q, x: (np.where(np.arange(4) == 2, q[0, 2], q), x), "arm_x never moves"),
        (lambda q, x: (q[:5], x[:5]), "too few"),
    ],
)
def test_what_nothing_can_be_learned_from_is_told(arm, spoil, told):
    q, x = spoil(*movements(arm, 60))
    with pytest.raises(BadInput, match=told):
        learn_recorded(Experience(q, x), arm.joints, Choice(""), method="screws", where="log.csv")


def test_the_log_of_another_robot_is_refused(arm):
    q, _ = movements(arm, 60)
    x = np.random.default_rng(0).uniform(-0.5, 0.5, (60, 3))
    with pytest.raises(BadInput, match="can't be this robot's"):
        learn_recorded(Experience(q, x), arm.joints, Choice("nicu"), described=arm)
    with pytest.raises(BadInput, match="its limits are"):
        learn_recorded(Experience(3 * q, x), arm.joints, Choice("nicu"), described=arm, where="log.csv")
