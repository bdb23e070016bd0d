import numpy as np
import pytest
from cmaes import CMA

from toddle.reach.evolve import strategy


def rotated_ellipsoid(n: int, seed: int):
    turn = np.linalg.qr(np.random.default_rng(seed).standard_normal((n, n)))[0]
    scale = 10.0 ** np.linspace(0, 2, n)
    return lambda x: ((x @ turn * scale) ** 2).sum(axis=-1)


@pytest.mark.parametrize(("n", "population"), [(3, 7), (12, 50), (30, 10)])
def test_each_run_follows_the_cmaes_library_from_the_same_samples(n: int, population: int):
    random = np.random.default_rng(0)
    mean = random.standard_normal((3, n))
    score = [rotated_ellipsoid(n, seed) for seed in range(3)]
    theirs = [CMA(mean=one.copy(), sigma=0.7, population_size=population) for one in mean]
    fixed, ours = strategy.constants(n, population), strategy.begin(mean, 0.7)
    for _ in range(25):
        tried = strategy.sample(ours, population, random)
        scores = np.stack([f(x) for f, x in zip(score, tried, strict=True)])
        for run, library in enumerate(theirs):
            library.ask()  # it decomposes its covariance when it is asked
            library.tell([(x, float(s)) for x, s in zip(tried[run], scores[run], strict=True)])
        ours = strategy.advance(ours, fixed, tried, scores)
    for run, library in enumerate(theirs):
        np.testing.assert_allclose(ours.mean[run], library.mean, rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(ours.sigma[run], library._sigma, rtol=1e-7)
        np.testing.assert_allclose(ours.covariance[run], library._C, rtol=1e-5, atol=1e-8)


def test_samples_have_the_distribution_that_the_state_says():
    random = np.random.default_rng(1)
    half = random.standard_normal((2, 4, 4))
    covariance = half @ half.transpose(0, 2, 1)
    values, axes = np.linalg.eigh(covariance)
    state = strategy.begin(random.standard_normal((2, 4)), 0.5)
    state = state._replace(covariance=covariance, axes=axes, lengths=np.sqrt(values))
    drawn = strategy.sample(state, 40_000, random)
    np.testing.assert_allclose(drawn.mean(axis=1), state.mean, atol=0.05)
    for run in range(2):
        np.testing.assert_allclose(np.cov(drawn[run].T), 0.25 * covariance[run], atol=0.06)


def test_a_run_is_the_same_alone_and_beside_others():
    f, fixed = rotated_ellipsoid(5, 0), strategy.constants(5, 8)
    random = np.random.default_rng(2)
    mean = random.standard_normal((4, 5))
    whole, alone = strategy.begin(mean, 1.0), strategy.begin(mean[2:3], 1.0)
    for _ in range(20):
        tried = strategy.sample(whole, 8, random)
        whole = strategy.advance(whole, fixed, tried, f(tried))
        alone = strategy.advance(alone, fixed, tried[2:3], f(tried[2:3]))
    np.testing.assert_allclose(whole.mean[2], alone.mean[0], rtol=1e-9)
    np.testing.assert_allclose(whole.sigma[2], alone.sigma[0], rtol=1e-9)


def test_all_runs_find_the_lowest_point():
    f, fixed, random = rotated_ellipsoid(8, 3), strategy.constants(8, 20), np.random.default_rng(3)
    state = strategy.begin(random.standard_normal((6, 8)), 1.0)
    for _ in range(250):
        tried = strategy.sample(state, 20, random)
        state = strategy.advance(state, fixed, tried, f(tried))
    assert np.all(f(state.mean) < 1e-8)
