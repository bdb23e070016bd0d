"""A soft arm that goes on learning: against the body, and against all looks taken at once."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from toddle.reach.model.crippled import Crippled
from toddle.reach.model.curvature import Curvature, fit_curvature
from toddle.reach.model.curvature_update import updated
from toddle.robots.continuum import bha
from toddle.signals import Experience

LOWER, UPPER, NOISE = np.full(9, 0.1), np.full(9, 0.3), 1e-3


@pytest.fixture(scope="module")
def forward():
    body = jax.jit(jax.vmap(bha().forward))
    return lambda q: np.asarray(body(jnp.asarray(q, jnp.float32)), float)


@pytest.fixture(scope="module")
def learned(forward):
    """From few movements, seen badly."""
    rng = np.random.default_rng(0)
    q = rng.uniform(LOWER, UPPER, (300, 9))
    seen = Experience(q, forward(q) + 0.01 * rng.normal(size=(300, 3)))
    model = fit_curvature(seen, LOWER, UPPER, joints=bha().joints, seed=0).model
    assert isinstance(model, Curvature)
    return model


def looks(forward, count, seed):
    rng = np.random.default_rng(seed)
    q = rng.uniform(LOWER, UPPER, (count, 9))
    return Experience(q, forward(q) + NOISE * rng.normal(size=(count, 3)))


def error(body, forward):
    q = np.random.default_rng(9999).uniform(LOWER, UPPER, (300, 9))
    return np.linalg.norm(body.forward(q) - forward(q), axis=1).mean()


def test_looks_mend_the_whole_arm(learned, forward):
    after = updated(learned, looks(forward, 60, 1), NOISE)
    assert error(after, forward) < 0.5 * error(learned, forward)
    q = np.random.default_rng(2).uniform(LOWER, UPPER, (20, 9))
    grown = np.linalg.eigvalsh(learned.spread(q) - after.spread(q))
    assert (grown > -1e-12).all()


def test_looks_one_by_one_are_worth_as_much_as_all_at_once(learned, forward):
    since, body = looks(forward, 25, 3), learned
    for q, x in zip(since.q, since.x, strict=True):
        body = updated(body, Experience(q[None], x[None]), NOISE)
    together = updated(learned, since, NOISE)
    q = np.random.default_rng(4).uniform(LOWER, UPPER, (50, 9))
    apart = np.linalg.norm(body.forward(q) - together.forward(q), axis=1)
    assert apart.max() < 0.3 * np.sqrt(np.trace(together.spread(q), axis1=1, axis2=2)).min()


def test_nothing_seen_changes_nothing(learned):
    nothing = Experience(np.zeros((0, 9)), np.zeros((0, 3)))
    assert updated(learned, nothing, NOISE) is learned


def test_after_damage_the_places_of_stuck_actuators_are_mended(learned, forward):
    share = np.array([1.0] * 6 + [0.0] * 3)
    true = np.array([0.0] * 6 + [0.15, 0.22, 0.28])
    doubt = np.diag(np.r_[np.zeros(6), np.full(3, 0.01**2), np.zeros(9)])
    guessed = true + np.r_[np.zeros(6), 0.008, -0.006, 0.01]
    body = Crippled(learned, np.zeros(9), guessed, share, doubt)
    since = looks(lambda q: forward(true + share * q), 80, 5)
    after = updated(body, since, NOISE)
    assert isinstance(after, Crippled)
    np.testing.assert_array_equal(after.share, share)
    np.testing.assert_allclose(after.place, true, atol=4e-3)
    assert error(after, lambda q: forward(true + share * q)) < 1e-3
