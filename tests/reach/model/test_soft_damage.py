"""What happened to a soft arm's actuators: causes and places against the bodies that were broken."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from toddle.failures import BadInput
from toddle.reach.model.crippled import Crippled
from toddle.reach.model.curvature import fit_curvature
from toddle.reach.model.damage_watch import JUMP, surprises
from toddle.reach.model.soft_damage import diagnose, probe_movements
from toddle.robots.continuum import bha
from toddle.signals import Experience

NOISE = 2e-3
LOWER, UPPER = np.full(9, 0.1), np.full(9, 0.3)


@pytest.fixture(scope="module")
def forward():
    body = jax.jit(jax.vmap(bha().forward))
    return lambda q: np.asarray(body(jnp.asarray(q, jnp.float32)), float)


@pytest.fixture(scope="module")
def fit(forward):
    rng = np.random.default_rng(0)
    q = rng.uniform(LOWER, UPPER, (400, 9))
    seen = Experience(q, forward(q) + NOISE * rng.normal(size=(400, 3)))
    return fit_curvature(seen, LOWER, UPPER, joints=bha().joints, seed=0)


def probed(forward, place, share, seed):
    """Probes of an arm whose actuators go to place + share q, the posture that they start from first."""
    rng = np.random.default_rng(seed)
    start = rng.uniform(LOWER, UPPER)
    q = np.concatenate([start[None], probe_movements(start, LOWER, UPPER)])
    return Experience(q, forward(place + share * q) + NOISE * rng.normal(size=(len(q), 3)))


@pytest.mark.parametrize("seed", range(5))
def test_each_probe_moves_one_actuator_within_the_limits(seed):
    start = np.random.default_rng(seed).uniform(LOWER, UPPER)
    probes = np.concatenate([start[None], probe_movements(start, LOWER, UPPER)])
    np.testing.assert_array_equal(np.diff(probes, axis=0) != 0, np.eye(9, dtype=bool))
    assert (probes >= LOWER - 1e-12).all()
    assert (probes <= UPPER + 1e-12).all()


def test_a_whole_arm_is_found_whole(forward, fit):
    found = diagnose(fit.model, probed(forward, np.zeros(9), np.ones(9), 1), LOWER, UPPER, fit.sensor)
    assert found.causes == ()
    assert found.free.all()
    q = np.random.default_rng(5).uniform(LOWER, UPPER, (10, 9))
    np.testing.assert_allclose(found.model.forward(q), fit.model.forward(q), atol=1e-12)


@pytest.mark.parametrize("stuck", [(6, 7, 8), (2,), (0, 4, 5)])
def test_locked_actuators_are_named_and_where_they_are_stuck(forward, fit, stuck):
    place, share = np.zeros(9), np.ones(9)
    share[list(stuck)] = 0.0
    place[list(stuck)] = np.random.default_rng(sum(stuck)).uniform(0.1, 0.3, len(stuck))
    found = diagnose(fit.model, probed(forward, place, share, 2), LOWER, UPPER, fit.sensor)
    assert [cause[:2] for cause in found.causes] == [(j, "locked") for j in stuck]
    np.testing.assert_allclose([cause[2] for cause in found.causes], place[list(stuck)], atol=6e-3)
    np.testing.assert_array_equal(found.free, share > 0)
    q = np.random.default_rng(6).uniform(LOWER, UPPER, (200, 9))
    error = np.linalg.norm(found.model.forward(q) - forward(place + share * q), axis=1)
    assert error.mean() < 5e-3
    np.testing.assert_array_equal(found.model.slope(q)[1][:, :, list(stuck)], 0.0)


@pytest.mark.parametrize(("kind", "place", "share"), [("weak", 0.11, 0.5), ("slip", 0.03, 1.0)])
def test_a_weak_and_a_slipped_actuator_are_told_apart(forward, fit, kind, place, share):
    places, shares = np.zeros(9), np.ones(9)
    places[4], shares[4] = place, share
    found = diagnose(fit.model, probed(forward, places, shares, 3), LOWER, UPPER, fit.sensor)
    ((joint, named, amount),) = found.causes
    assert (joint, named) == (4, kind)
    assert amount == pytest.approx(share if kind == "weak" else place, abs=0.06 if kind == "weak" else 5e-3)
    assert found.surprise < 2.5


def test_the_damage_is_noticed_at_once(forward, fit):
    rng = np.random.default_rng(7)
    q = rng.uniform(LOWER, UPPER, (200, 9))
    x = forward(q) + NOISE * rng.normal(size=(200, 3))
    assert (surprises(fit.model, q, x, fit.sensor) < JUMP).all()
    locked = q.copy()
    locked[:, 6:] = 0.3
    x = forward(locked) + NOISE * rng.normal(size=(200, 3))
    assert (surprises(fit.model, q, x, fit.sensor) > JUMP).mean() > 0.95


def test_the_crippled_slope_agrees_with_differences_and_the_spread_with_draws(fit):
    rng = np.random.default_rng(8)
    root = np.diag(np.r_[np.full(9, 1e-3), np.full(9, 1e-2)])
    body = Crippled(fit.model, np.full(9, 0.2), rng.uniform(0.15, 0.25, 9), rng.uniform(0, 1, 9), root @ root)
    q = rng.uniform(LOWER, UPPER, (3, 9))
    tip, slope = body.slope(q)
    np.testing.assert_allclose(tip, body.forward(q), atol=1e-12)
    steps = [body.forward(q + 1e-6 * e) - body.forward(q - 1e-6 * e) for e in np.eye(9)]
    np.testing.assert_allclose(slope, np.stack(steps, axis=2) / 2e-6, atol=1e-6)
    place, share = np.split(rng.normal(size=(20_000, 18)) @ root, 2, axis=1)
    drawn = fit.model.forward(body.place + place + (body.share + share) * (q[0] - body.about))
    expected = body.spread(q[:1])[0] - fit.model.spread(body.actual(q[:1]))[0]
    np.testing.assert_allclose(np.cov(drawn.T), expected, atol=0.05 * np.abs(expected).max())


def test_no_movements_are_refused(fit):
    with pytest.raises(BadInput, match="no movements since the damage"):
        diagnose(fit.model, Experience(np.zeros((0, 9)), np.zeros((0, 3))), LOWER, UPPER, NOISE)
