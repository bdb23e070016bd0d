import numpy as np
import pytest

from toddle.reach.model.misfit import fits, misfit
from toddle.reach.model.model import Fit
from toddle.reach.model.multilinear import fit_multilinear
from toddle.signals import Experience


class Still:
    """A model that puts the tip at the origin: what is seen is what it misses."""

    space = 3

    def forward(self, q):
        return np.zeros((len(q), 3))

    def slope(self, q):
        return self.forward(q), np.zeros((len(q), 3, q.shape[1]))

    def spread(self, q):
        return np.zeros((len(q), 3, 3))


def judged(q, x, seed=0, wild=None):
    wild = np.zeros(len(q), bool) if wild is None else wild
    return misfit(Experience(q, x), Fit(Still(), "screws", np.zeros(len(q)), 1e-3, wild, 0.0), seed=seed)


def test_noise_is_no_misfit_more_often_than_said():
    alarms = 0
    for seed in range(150):
        rng = np.random.default_rng(seed)
        q = rng.uniform(-2, 2, (40, 5))
        alarms += judged(q, 1e-3 * rng.standard_t(4, (40, 3))).size > 0
    # 0.5 % are meant: five or more of 150 happen in 1 of 700 such tests
    assert alarms < 5


@pytest.mark.parametrize(
    "missed",
    [
        lambda q: np.cos(2 * q[:, 2]),
        lambda q: 0.8 * q[:, 0] * q[:, 3],
        lambda q: 0.6 * q[:, 0] * q[:, 1] * q[:, 4],
        lambda q: np.sin(q[:, 0] + q[:, 1]),
    ],
)
def test_what_follows_the_joints_is_noticed(missed):
    for seed in range(5):
        rng = np.random.default_rng(seed)
        q = rng.uniform(-2, 2, (300, 5))
        x = 1e-3 * rng.normal(size=(300, 3))
        systematic = 1e-3 * missed(q)
        found = judged(q, x + systematic[:, None] * np.array([1.0, -1.0, 0.5]), seed)
        size = np.sqrt(2.25 * np.mean((systematic - systematic.mean()) ** 2))
        assert found.chance <= 0.005
        assert 0.5 * size < found.size < 1.5 * size


def test_wild_movements_neither_raise_nor_hide_it():
    rng = np.random.default_rng(0)
    q = rng.uniform(-2, 2, (300, 5))
    x = 1e-3 * rng.normal(size=(300, 3))
    wild = np.arange(300) < 15
    x[wild] += rng.uniform(-1, 1, (15, 3))
    assert judged(q, x).size == 0
    systematic = 2e-3 * np.cos(2 * q[:, [2]])
    assert judged(q, x + systematic, wild=wild).size > 1e-3
    assert judged(q, x + systematic).size > 1e-3


def test_a_soft_body_is_not_multilinear_and_a_rigid_one_is():
    rng = np.random.default_rng(0)
    q = rng.uniform(-1.5, 1.5, (300, 3))
    rigid = np.stack([np.cos(q[:, 0]) * (1 + q[:, 2]), np.sin(q[:, 0] + q[:, 1]), np.cos(q[:, 1])], axis=1)
    for bend, expected in ((0.0, True), (0.02, False)):
        x = rigid + bend * np.sin(3 * q[:, [0]] + q[:, [2]]) + 1e-3 * rng.normal(size=(300, 3))
        experience = Experience(q, x)
        slides = np.array([False, False, True])
        fit = fit_multilinear(experience, -1.5 * np.ones(3), 1.5 * np.ones(3), slides=slides)
        assert fits(experience, fit) is expected


def test_a_few_movements_show_nothing():
    q = np.linspace(0, 1, 12)[:, None]
    assert judged(q, q * np.ones((12, 3))) == (0.0, 1.0)


def test_exact_fits_fit():
    rng = np.random.default_rng(0)
    q = rng.uniform(-2, 2, (100, 3))
    assert fits(Experience(q, 1e-9 * q), Fit(Still(), "screws", np.zeros(100), 1e-9, np.zeros(100, bool), 0.0))
    assert judged(q, np.zeros((100, 3))).size == 0
