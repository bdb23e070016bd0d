import numpy as np
import pytest
from scipy.stats import chi2

from toddle.failures import BadInput
from toddle.reach.model.covariance import Embedding, covariance, learn_covariance
from toddle.reach.model.kernel import Kernel, fit_kernel
from toddle.reach.model.model import Model
from toddle.reach.model.network import fit_network
from toddle.signals import Experience


def turning(count, noise=0.0, seed=0):
    """A rigid arm: one joint about the vertical, two about a horizontal axis."""
    rng = np.random.default_rng(seed)
    lower, upper = -2.5 * np.ones(3), 2.5 * np.ones(3)

    def tip(q):
        out = np.cos(q[:, 1]) + 0.8 * np.cos(q[:, 1] + q[:, 2])
        height = np.sin(q[:, 1]) + 0.8 * np.sin(q[:, 1] + q[:, 2])
        return np.stack([out * np.cos(q[:, 0]), out * np.sin(q[:, 0]), height], axis=1)

    q, unseen = rng.uniform(lower, upper, (count, 3)), rng.uniform(lower, upper, (500, 3))
    return Experience(q, tip(q) + noise * rng.normal(size=(count, 3))), lower, upper, unseen, tip(unseen)


def sliding(count, noise=0.0, seed=0):
    """A body without angles: what it does is smooth, and no rigid arm."""
    rng = np.random.default_rng(seed)
    lower, upper = np.array([0.1, 0.1, 0.1]), np.array([0.3, 0.3, 0.3])

    def tip(q):
        bend = 8 * (q[:, 1] - q[:, 0])
        return np.stack([q[:, 2] * np.sin(bend), q[:, 2] * np.cos(bend), q.sum(1) ** 2], axis=1)

    q, unseen = rng.uniform(lower, upper, (count, 3)), rng.uniform(lower, upper, (500, 3))
    return Experience(q, tip(q) + noise * rng.normal(size=(count, 3))), lower, upper, unseen, tip(unseen)


FITS = {"kernel": fit_kernel, "network": lambda *given, **more: fit_network(*given, **more, steps=1200, fewest=0)}
COUNTS = {"kernel": 200, "network": 3000}
BODIES = {"turning": turning, "sliding": sliding}


@pytest.fixture(scope="module")
def learned():
    found = {}
    for name, body in BODIES.items():
        for kind, fit in FITS.items():
            experience, lower, upper, unseen, x = body(COUNTS[kind], noise=5e-4)
            found[name, kind] = fit(experience, lower, upper), unseen, x
    return found


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("kind", FITS)
class TestWithoutPrior:
    def test_unseen_postures(self, learned, name, kind):
        fit, unseen, x = learned[name, kind]
        assert isinstance(fit.model, Model)
        assert fit.kind == kind
        wrong = np.linalg.norm(fit.model.forward(unseen) - x, axis=1)
        assert np.mean(wrong) < {"kernel": 2e-3, "network": 0.03}[kind]
        assert fit.miss.shape == (COUNTS[kind],)

    def test_the_slope_agrees_with_differences(self, learned, name, kind):
        fit, unseen, _ = learned[name, kind]
        q, step = unseen[:5], 1e-3 if name == "turning" else 1e-4
        x, slope = fit.model.slope(q)
        np.testing.assert_allclose(x, fit.model.forward(q), atol=1e-6)
        for joint in range(q.shape[1]):
            away = step * np.eye(q.shape[1])[joint]
            expected = (fit.model.forward(q + away) - fit.model.forward(q - away)) / (2 * step)
            np.testing.assert_allclose(slope[:, :, joint], expected, atol=0.01 * np.abs(slope).max())

    def test_it_finds_whether_joints_are_angles(self, learned, name, kind):
        fit, _, _ = learned[name, kind]
        assert ("as angles" in fit.notes[0]) == (name == "turning")

    def test_the_spread_covers_what_it_misses(self, learned, name, kind):
        fit, unseen, x = learned[name, kind]
        wrong, spread = fit.model.forward(unseen) - x, fit.model.spread(unseen)
        inside = np.einsum("bi,bij,bj->b", wrong, np.linalg.inv(spread), wrong) < chi2.ppf(0.9, 3)
        assert 0.75 < inside.mean() <= 1


def test_the_kernel_finds_the_noise():
    experience, lower, upper, *_ = turning(200, noise=2e-3)
    assert fit_kernel(experience, lower, upper).sensor == pytest.approx(2e-3, rel=0.15)


def test_the_kernel_is_the_textbook_prediction():
    experience, lower, upper, unseen, _ = turning(80, noise=2e-3)
    fit = fit_kernel(experience, lower, upper)
    model = fit.model
    assert isinstance(model, Kernel)
    matrix = np.exp(-0.5 * ((model.known[:, None] - model.known[None]) ** 2).sum(2))
    # of the seen tips in the order in which the model keeps its movements
    order = [int(np.argmin(((model.embedding.of(experience.q) - row) ** 2).sum(1))) for row in model.known]
    seen = experience.x[order] - model.mean
    residual = seen - matrix @ model.weights
    noise = np.sum(residual * model.weights) / np.sum(model.weights**2)
    z = model.embedding.of(unseen)
    near = np.exp(-0.5 * ((z[:, None] - model.known[None]) ** 2).sum(2))
    expected = model.mean + near @ np.linalg.solve(matrix + noise * np.eye(80), seen)
    np.testing.assert_allclose(model.forward(unseen), expected, atol=1e-7)


def test_angles_that_differ_by_a_turn_are_alike():
    embedding = Embedding(np.array([True, False]), np.array([0.8, 3.0]))
    q = np.array([[0.3, 0.1], [0.3 + 2 * np.pi, 0.1], [0.3, 0.2]])
    kernel = covariance(embedding.of(q), embedding.of(q))
    expected = [[1, 1, np.exp(-0.5 * 0.09)], [1, 1, np.exp(-0.5 * 0.09)], [np.exp(-0.5 * 0.09)] * 2 + [1]]
    np.testing.assert_allclose(kernel, expected, atol=1e-12)


def test_the_evidence_has_no_better_neighbour():
    experience, lower, upper, *_ = turning(150, noise=2e-3)
    from toddle.reach.model import covariance as module

    found = learn_covariance(experience.q, experience.x, lower, upper, np.ones(3, bool))
    apart = np.cos(experience.q.T[:, :, None] - experience.q.T[:, None, :]) - 1
    logs = np.append(2 * np.log(found.embedding.weight), np.log(found.noise))
    y = experience.x - experience.x.mean(0)
    for number in range(4):
        for way in (-0.5, 0.5):
            moved = logs + way * np.eye(4)[number]
            assert module._surprise(moved, apart, y)[0] > found.surprise - 0.5
    away = np.log([0.3, 0.5, 0.8, 1e-3])  # where the covariance is far from singular, so that differences are exact
    slope = module._surprise(away, apart, y)[1]
    for number in range(4):
        step = 1e-5 * np.eye(4)[number]
        numeric = module._surprise(away + step, apart, y)[0] - module._surprise(away - step, apart, y)[0]
        assert slope[number] == pytest.approx(numeric / 2e-5, rel=1e-4, abs=1e-4)


def test_the_same_seed_gives_the_same_network():
    experience, lower, upper, unseen, _ = sliding(100)
    one, two = (FITS["kernel"](experience, lower, upper, seed=3).model.forward(unseen) for _ in range(2))
    np.testing.assert_array_equal(one, two)


def test_few_movements_get_a_kernel():
    experience, lower, upper, *_ = sliding(60)
    assert fit_network(experience, lower, upper).kind == "kernel"


def test_too_few_movements_are_refused():
    q = np.zeros((9, 3))
    for fit in FITS.values():
        with pytest.raises(BadInput, match="9 movements of 3 joints; give 12 or more"):
            fit(Experience(q, q), -np.ones(3), np.ones(3))
