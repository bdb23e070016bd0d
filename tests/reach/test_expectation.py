from dataclasses import dataclass

import numpy as np
import pytest
from scipy.stats import chi2

from toddle.failures import BadInput
from toddle.reach.evaluate.expectation import Expectation
from toddle.reach.model.model import Fit
from toddle.signals import Experience

NOISE = 1e-3


@dataclass(frozen=True)
class Line:
    """A body whose tip is linear in features of its joints: least squares is exact, and so is its covariance."""

    weights: np.ndarray
    covariance: np.ndarray

    @property
    def space(self):
        return 3

    @staticmethod
    def features(q):
        return np.concatenate([np.ones((len(q), 1)), np.cos(q), np.sin(q)], axis=1)

    def forward(self, q):
        return self.features(q) @ self.weights

    def slope(self, q):
        joints = q.shape[1]
        to_x = np.einsum("bj,js->bsj", -np.sin(q), self.weights[1 : joints + 1])
        return self.forward(q), to_x + np.einsum("bj,js->bsj", np.cos(q), self.weights[joints + 1 :])

    def spread(self, q):
        phi = self.features(q)
        return np.einsum("bi,ij,bj->b", phi, self.covariance, phi)[:, None, None] * np.eye(3)


def truth(q, bent):
    weights = np.random.default_rng(99).normal(size=(9, 3))
    return Line.features(q) @ weights + bent * np.sin(3 * q[:, :3])


def learned(seed, count=60, bent=0.0):
    rng = np.random.default_rng(seed)
    q = rng.uniform(-2, 2, (count, 4))
    x = truth(q, bent) + NOISE * rng.normal(size=(count, 3))
    phi = Line.features(q)
    inverse = np.linalg.inv(phi.T @ phi)
    weights = inverse @ phi.T @ x
    miss = x - phi @ weights
    sensor = float(np.sqrt((miss**2).sum() / (3 * (count - 9))))
    model = Line(weights, sensor**2 * inverse)
    fit = Fit(model, "line", np.linalg.norm(miss, axis=1), sensor, np.zeros(count, bool), 0.0)
    return fit, Experience(q, x), rng


def covered(make, bent=0.0, fits=40, targets=200):
    """Share of held-out tips within what was said, true and seen, over many fits."""
    true, seen = [], []
    for seed in range(fits):
        fit, experience, rng = learned(seed, bent=bent)
        expectation = make(fit, experience, rng)
        q = rng.uniform(-2, 2, (targets, 4))
        tips = truth(q, bent)
        away = np.linalg.norm(tips - fit.model.forward(q), axis=1)
        looked = np.linalg.norm(tips + NOISE * rng.normal(size=tips.shape) - fit.model.forward(q), axis=1)
        true.append((away < expectation.at(q)[1]).mean())
        seen.append((looked < expectation.seen_at(q)[1]).mean())
    return np.mean(true), np.mean(seen)


def by_leverage(fit, experience, rng):
    return Expectation.of(fit, experience, sensor=NOISE)


def by_held_out(bent):
    def make(fit, experience, rng):
        q = rng.uniform(-2, 2, (40, 4))
        held = Experience(q, truth(q, bent) + NOISE * rng.normal(size=(40, 3)))
        return Expectation.held_out(fit.model, held, sensor=NOISE)

    return make


@pytest.mark.parametrize("bent", [0.0, 3e-3])
def test_nine_of_ten_are_within_what_is_said(bent):
    for share in covered(by_leverage, bent):
        assert 0.85 <= share <= 0.96
    _, seen = covered(by_held_out(bent), bent)
    assert 0.86 <= seen <= 0.95


def test_an_overconfident_model_is_set_right_by_held_out_movements():
    fit, _, rng = learned(0)
    assert isinstance(fit.model, Line)
    bold = Line(fit.model.weights + 5e-3, fit.model.covariance / 100)
    q = rng.uniform(-2, 2, (400, 4))
    held = Experience(q, truth(q, 0.0) + NOISE * rng.normal(size=(400, 3)))
    expectation = Expectation.held_out(bold, held, sensor=NOISE)
    q = rng.uniform(-2, 2, (2000, 4))
    away = np.linalg.norm(truth(q, 0.0) - bold.forward(q), axis=1)
    assert 0.8 < (away < expectation.at(q)[1]).mean() < 0.99


def test_of_gaussian_errors_the_quantile_is_that_of_chi():
    model = Line(np.zeros((9, 3)), np.zeros((9, 9)))
    mean, most = Expectation(model, NOISE**2, 0.0, 1.0).at(np.zeros((2, 4)))
    np.testing.assert_allclose(most, NOISE * np.sqrt(chi2.ppf(0.9, 3)), rtol=1e-6)
    np.testing.assert_allclose(mean, NOISE * np.sqrt(8 / np.pi), rtol=1e-6)


def test_what_the_solver_leaves_is_added():
    model = Line(np.zeros((9, 3)), np.zeros((9, 9)))
    expectation = Expectation(model, NOISE**2, 0.0, 1.0)
    rng = np.random.default_rng(0)
    for distance in (0.5e-3, 2e-3, 0.1):
        mean, most = expectation.at(np.zeros((1, 4)), distance)
        drawn = np.linalg.norm(NOISE * rng.normal(size=(20000, 3)) + [distance, 0, 0], axis=1)
        assert mean[0] == pytest.approx(drawn.mean(), rel=0.02)
        assert (drawn < most[0]).mean() == pytest.approx(0.9, abs=0.02)
    assert expectation.at(np.zeros((2, 4)), np.array([0.0, 1.0]))[0][1] == pytest.approx(1.0, rel=1e-3)


def test_a_sensor_that_is_not_known_makes_it_careful():
    fit, experience, rng = learned(1)
    careful, known = Expectation.of(fit, experience), Expectation.of(fit, experience, sensor=NOISE)
    q = rng.uniform(-2, 2, (5, 4))
    np.testing.assert_allclose(careful.at(q)[1], known.seen_at(q)[1])
    np.testing.assert_allclose(careful.seen_at(q)[1], known.seen_at(q)[1])
    assert (careful.at(q)[1] > known.at(q)[1]).all()


def test_wild_movements_do_not_count():
    fit, experience, _ = learned(2)
    wild = np.zeros(60, bool)
    wild[:3] = True
    x = experience.x.copy()
    x[:3] += 1.0
    marked = Fit(fit.model, "line", fit.miss, fit.sensor, wild, 0.0)
    clean = Expectation.of(fit, experience, sensor=NOISE).scale
    assert Expectation.of(marked, Experience(experience.q, x), sensor=NOISE).scale == pytest.approx(clean, rel=0.2)


def test_too_few_held_out_movements_are_refused():
    fit, experience, _ = learned(3)
    few = Experience(experience.q[:5], experience.x[:5])
    with pytest.raises(BadInput, match="5 movements"):
        Expectation.held_out(fit.model, few)
