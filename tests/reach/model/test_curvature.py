"""Soft arms learned from movements: slopes against differences, geometry against the bodies that made the movements."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from toddle.failures import BadInput
from toddle.reach.model.curvature import Curvature, fit_curvature
from toddle.reach.model.curvature_chain import Shape, joint_slopes, number_slopes, places, tips
from toddle.reach.model.curvature_rest import Mended, rest_of
from toddle.reach.model.curvature_search import groupings, searched, settled
from toddle.robots.continuum import bha
from toddle.robots.soft_variants import random_soft_arm
from toddle.signals import Experience

TWO_SEGMENTS, THREE_SEGMENTS = 11, 1  # seeds


class Arm:
    """A body in NumPy: movements over its whole range."""

    def __init__(self, body):
        self._forward = jax.jit(jax.vmap(body.forward))
        self.joints = body.joints
        self.lower, self.upper = np.asarray(body.lower, float), np.asarray(body.upper, float)

    def forward(self, q):
        return np.asarray(self._forward(jnp.asarray(q, jnp.float32)), float)

    def moved(self, count, seed, noise=0.0):
        rng = np.random.default_rng(seed)
        q = rng.uniform(self.lower, self.upper, (count, len(self.lower)))
        x = self.forward(q)
        return Experience(q, x + noise * rng.normal(size=x.shape))

    def learned(self, experience, **how):
        return fit_curvature(experience, self.lower, self.upper, joints=self.joints, seed=0, **how)

    def errors(self, model, count=500):
        """How far the model is from the body at postures that it hasn't seen [m]."""
        q = np.random.default_rng(9999).uniform(self.lower, self.upper, (count, len(self.lower)))
        return model.forward(q) - self.forward(q)


@pytest.fixture(scope="module")
def soft():
    return Arm(bha())


@pytest.fixture(scope="module")
def uneven():
    """Six actuators that aren't linear, on segments that sag; and its fit."""
    arm = Arm(random_soft_arm(TWO_SEGMENTS, size=3, nonlinear=0.2, sag=2.0))
    return arm, arm.moved(400, 4, 1e-3), arm.learned(arm.moved(400, 4, 1e-3))


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("space", [2, 3])
@pytest.mark.parametrize("size", [0.0, 1e-4, 0.6])
def test_slopes_agree_with_differences(order, space, size):
    """Straight, nearly straight and strongly bent."""
    rng = np.random.default_rng(order)
    shape = Shape((3, 2, 3), order, rng.normal(size=8), 0.5 + rng.random(8), space)
    numbers, q = size * rng.normal(size=places(shape).total), rng.normal(size=(6, 8))
    tip, by_number = number_slopes(shape, numbers, q)
    same, by_joint = joint_slopes(shape, numbers, q)
    np.testing.assert_allclose(tip, tips(shape, numbers, q), atol=1e-12)
    np.testing.assert_allclose(same, tip, atol=1e-12)
    h = 1e-6
    steps = [tips(shape, numbers + h * e, q) - tips(shape, numbers - h * e, q) for e in np.eye(len(numbers))]
    np.testing.assert_allclose(by_number, np.stack(steps, axis=2) / (2 * h), atol=1e-6 + 1e-7 * np.abs(by_number).max())
    steps = [tips(shape, numbers, q + h * e) - tips(shape, numbers, q - h * e) for e in np.eye(8)]
    np.testing.assert_allclose(by_joint, np.stack(steps, axis=2) / (2 * h), atol=1e-6 + 1e-7 * np.abs(by_joint).max())


def test_an_arm_is_found_to_a_tenth_of_the_noise(soft):
    errors = np.linalg.norm(soft.errors(soft.learned(soft.moved(120, 1, 1e-4)).model), axis=1)
    assert errors.max() < 2e-4


def test_300_movements_within_2_mm_give_half_a_millimetre(soft):
    for seed in range(2):
        exact = soft.moved(300, seed)
        noise = np.random.default_rng(seed).uniform(-2e-3, 2e-3, exact.x.shape)
        fit = soft.learned(Experience(exact.q, exact.x + noise))
        assert np.linalg.norm(soft.errors(fit.model), axis=1).mean() < 5e-4
        assert fit.sensor == pytest.approx(2e-3 / np.sqrt(3), rel=0.1)
        assert fit.notes == ("3 segments of 3, 3, 3 actuators",)


@pytest.mark.parametrize("size", [2, 3, 4])
def test_arms_of_other_layouts_are_found(size):
    """Tilted feet, uneven rings, stiff pieces, tips off the middle; how many actuators a segment has isn't told."""
    body = random_soft_arm(THREE_SEGMENTS if size == 2 else TWO_SEGMENTS, size=size)
    arm = Arm(body)
    fit = arm.learned(arm.moved(250, size, 5e-4), arcs_only=True)
    assert isinstance(fit.model, Curvature)
    assert fit.model.shape.sizes == body.sizes
    assert np.linalg.norm(arm.errors(fit.model), axis=1).mean() < 4e-4


def test_wild_movements_are_left_out(soft):
    rng = np.random.default_rng(3)
    moved = soft.moved(300, 3, 2e-3)
    wild = rng.random(300) < 0.05
    moved.x[wild] += rng.uniform(-1, 1, (wild.sum(), 3))
    fit = soft.learned(moved)
    assert (fit.wild == wild).mean() > 0.99
    assert np.linalg.norm(soft.errors(fit.model), axis=1).mean() < 7e-4


def test_it_knows_how_wrong_it_is(soft):
    """Squared errors in units of the spread are about their number of coordinates."""
    ratios = []
    for seed in range(3):
        model = soft.learned(soft.moved(200, 10 + seed, 2e-3)).model
        errors = soft.errors(model)
        q = np.random.default_rng(9999).uniform(soft.lower, soft.upper, (500, 9))
        ratios.append(np.mean(np.einsum("ni,nij,nj->n", errors, np.linalg.inv(model.spread(q)), errors)) / 3)
    assert 0.3 < np.mean(ratios) < 2.0


def test_a_seen_plane_is_enough(soft):
    """Two coordinates of the tip: whatever they leave open doesn't matter for them."""
    moved = soft.moved(300, 5, 1e-3)
    fit = soft.learned(Experience(moved.q, moved.x[:, [2, 0]]))
    q = np.random.default_rng(1).uniform(soft.lower, soft.upper, (200, 9))
    missed = fit.model.forward(q) - soft.forward(q)[:, [2, 0]]
    assert np.linalg.norm(missed, axis=1).mean() < 1e-3


def test_arcs_that_do_not_fit_are_told_and_mended(uneven):
    arm, moved, mended = uneven
    arcs = arm.learned(moved, arcs_only=True)
    plain, better = (np.linalg.norm(arm.errors(fit.model), axis=1).mean() for fit in (arcs, mended))
    assert any("curvature isn't constant" in note for note in mended.notes)
    assert isinstance(mended.model, Mended)
    assert better < plain / 3
    assert mended.sensor < arcs.sensor


def test_what_arcs_of_any_order_miss_is_learned_as_a_polynomial(uneven):
    """Of a sagging arm: the bend of one segment depends on the other's, which no order in its own actuators can say."""
    arm, moved, _ = uneven
    shape = Shape((3, 3), 1, (arm.lower + arm.upper) / 2, (arm.upper - arm.lower) / 2, 3)
    found = settled(*searched([shape], moved.q, moved.x, np.random.default_rng(0)), moved.q, moved.x)
    learned = rest_of(found, moved.q, moved.x, np.random.default_rng(0))
    assert learned is not None
    rest, noise = learned
    assert noise < found.sigma / 2
    structure = Curvature(found.shape, found.numbers, found.covariance)
    model = Mended(structure, rest, 1e-8)
    plain, better = (np.linalg.norm(arm.errors(model), axis=1).mean() for model in (structure, model))
    assert better < plain / 3
    q = np.random.default_rng(2).uniform(arm.lower, arm.upper, (4, len(arm.lower)))
    tip, slope = model.slope(q)
    np.testing.assert_allclose(tip, model.forward(q), atol=1e-12)
    steps = [model.forward(q + 1e-6 * e) - model.forward(q - 1e-6 * e) for e in np.eye(len(arm.lower))]
    np.testing.assert_allclose(slope, np.stack(steps, axis=2) / 2e-6, atol=1e-6)
    assert (np.linalg.eigvalsh(model.spread(q)) > 1e-8).all()


def test_actuators_are_shared_out():
    assert groupings(9) == [(3, 3, 3)]
    assert groupings(12) == [(3,) * 4, (2,) * 6, (4,) * 3]
    assert sorted(groupings(7)) == [(2, 2, 3), (2, 3, 2), (3, 2, 2)]
    assert groupings(1) == [(1,)]
    for count in range(1, 14):
        assert all(sum(sizes) == count for sizes in groupings(count))
        assert groupings(count)


def test_what_cannot_be_learned_is_refused(soft):
    few = soft.moved(20, 0)
    with pytest.raises(BadInput, match="20 movements are too few"):
        soft.learned(few)
    with pytest.raises(BadInput, match="don't share out 9"):
        soft.learned(few, sizes=(3, 3))
    still = soft.moved(200, 0)
    still.q[:, 4] = 0.2
    with pytest.raises(BadInput, match="segment_2_length_2 never varies"):
        soft.learned(still)
