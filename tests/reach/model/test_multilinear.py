import numpy as np
import pytest

import toddle
from toddle.failures import BadInput
from toddle.reach.model.multilinear import Multilinear, features, fit_multilinear
from toddle.robots.chain import Chain
from toddle.robots.linkage import linkage_of, poses
from toddle.signals import Experience


def arm(name):
    body = toddle.load(name)
    assert isinstance(body, Chain)
    linkage = linkage_of(body)
    return lambda q: poses(linkage, q)[:, :3, 3], np.asarray(body.lower, float), np.asarray(body.upper, float)


def learned(name, count, noise, seed=0, slides=None):
    tip, lower, upper = arm(name)
    rng = np.random.default_rng(seed)
    q = rng.uniform(lower, upper, (count, len(lower)))
    experience = Experience(q, tip(q) + noise * rng.normal(size=(count, 3)))
    fit = fit_multilinear(experience, lower, upper, slides=slides)
    unseen = rng.uniform(lower, upper, (1000, len(lower)))
    return fit, unseen, fit.model.forward(unseen) - tip(unseen)


@pytest.mark.parametrize("name", ["nicu", "scara", "planar:4"])
def test_hundred_clean_movements_of_few_joints_are_enough(name):
    _, _, wrong = learned(name, 100, 0.0)
    assert np.abs(wrong).max() < 1e-7


def test_a_sliding_joint_is_found():
    fit, _, _ = learned("scara", 100, 0.0)
    assert fit.notes == ("joint 4 of 4 slides",)


def test_being_told_what_slides_is_being_right_without_looking():
    told, _, _ = learned("scara", 100, 1e-3, slides=np.array([False, False, False, True]))
    assert isinstance(told.model, Multilinear)
    assert told.model.weights.shape == (3**3 * 2, 3)


def test_noise_and_spread_are_what_they_are_said_to_be():
    lengths = []
    for seed in range(10):
        fit, unseen, wrong = learned("nicu", 300, 2e-3, seed)
        assert fit.sensor == pytest.approx(2e-3, rel=0.12)
        white = np.linalg.solve(np.linalg.cholesky(fit.model.spread(unseen)), wrong[:, :, None])
        lengths.append(np.mean(white**2))
    assert 0.7 < np.mean(lengths) < 1.4


def test_the_slope_agrees_with_differences():
    for name in ("nicu", "scara"):
        fit, unseen, _ = learned(name, 100, 1e-3)
        q, slope = unseen[:4], fit.model.slope(unseen[:4])[1]
        for joint in range(q.shape[1]):
            step = 1e-6 * np.eye(q.shape[1])[joint]
            expected = (fit.model.forward(q + step) - fit.model.forward(q - step)) / 2e-6
            np.testing.assert_allclose(slope[:, :, joint], expected, atol=1e-7)


def test_features_are_all_products():
    q = np.array([[0.3, 0.7]])
    first, second = [1, np.cos(0.3), np.sin(0.3)], [1, 0.7]
    expected = [a * b for a in first for b in second]
    np.testing.assert_allclose(features(q, np.array([False, True]))[0], expected)


def test_fewer_movements_than_coefficients_leave_it_unsure():
    few, unseen, _ = learned("nicu", 40, 1e-3)
    many, _, _ = learned("nicu", 400, 1e-3)
    assert np.median(few.model.spread(unseen)) > 2 * np.median(many.model.spread(unseen))


def test_too_many_joints_and_too_few_movements_are_refused():
    q = np.zeros((300, 8))
    with pytest.raises(BadInput, match="8 joints are too many"):
        fit_multilinear(Experience(q, np.zeros((300, 3))), -np.ones(8), np.ones(8))
    with pytest.raises(BadInput, match="3 movements"):
        fit_multilinear(Experience(q[:3, :4], np.zeros((3, 3))), -np.ones(4), np.ones(4))
