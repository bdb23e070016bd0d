"""Soft arms of other layouts, against the published arm and against their middle line integrated step by step."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from toddle.robots.continuum import bha
from toddle.robots.soft_variants import SoftVariant, bha_variant, random_soft_arm


def integrated(arm: SoftVariant, q: np.ndarray, steps: int = 360) -> np.ndarray:
    """The tip by following the middle line in small steps: the frame turns as the local curvature says."""
    lower, upper = np.asarray(arm.lower, float), np.asarray(arm.upper, float)
    half = (upper - lower) / 2
    u = (q - lower) / half - 1
    lengths = q + half * (np.asarray(arm.square) * (u**2 - 1) + np.asarray(arm.cube) * (u**3 - u))
    turn, place = small_turn(np.asarray(arm.tilt, float)), np.zeros(3)
    owner = np.repeat(np.arange(len(arm.sizes)), arm.sizes)
    arcs = np.array([lengths[owner == i].mean() for i in range(len(arm.sizes))])
    gaps = np.asarray(arm.gaps, float)
    for i, arc in enumerate(arcs):
        own = owner == i
        lean = (lengths - lower - half)[own] / np.asarray(arm.radii, float)[own]
        around = np.asarray(arm.around, float)[own]
        bend = -2 / own.sum() * np.array([lean @ np.cos(around), lean @ np.sin(around)])
        bend += float(arm.sag[i]) * (arcs[i:].sum() + gaps[i:].sum()) * (turn.T @ [0, 0, -1])[:2]
        pieces = 6  # the curvature is constant in each sixth of a segment
        for step in range(steps):
            local = 1 + float(arm.taper[i]) * ((2 * (step * pieces // steps) + 1) / pieces - 1)
            half_turn = small_turn(local * bend / steps / 2)
            turn = turn @ half_turn
            place = place + turn[:, 2] * arc / steps
            turn = turn @ half_turn
        place = place + turn[:, 2] * gaps[i]
    return place + turn @ np.asarray(arm.offset, float)


def small_turn(bend: np.ndarray) -> np.ndarray:
    """The rotation by |bend| that turns z towards it, by the exponential series (small, or below 2 rad)."""
    cross = np.array([[0, 0, bend[0]], [0, 0, bend[1]], [-bend[0], -bend[1], 0]])
    total, term = np.eye(3), np.eye(3)
    for k in range(1, 20):
        term = term @ cross / k
        total = total + term
    return total


def test_without_deviations_it_is_the_published_arm():
    q = np.random.default_rng(0).uniform(0.1, 0.3, (20, 9)).astype(np.float32)
    plain, published = (jax.jit(jax.vmap(arm.pose))(jnp.asarray(q)) for arm in (bha_variant(), bha()))
    np.testing.assert_allclose(np.asarray(plain), np.asarray(published), atol=2e-6)


@pytest.mark.parametrize(
    "arm",
    [
        bha_variant(taper=0.4),
        bha_variant(nonlinear=0.2),
        bha_variant(sag=0.5),
        random_soft_arm(3, taper=0.3, nonlinear=0.2, sag=0.3),
    ],
    ids=["taper", "nonlinear", "sag", "all, another layout"],
)
def test_the_tip_is_that_of_the_integrated_middle_line(arm):
    q = np.random.default_rng(1).uniform(np.asarray(arm.lower), np.asarray(arm.upper))
    np.testing.assert_allclose(np.asarray(arm.forward(jnp.asarray(q, jnp.float32))), integrated(arm, q), atol=3e-6)


def test_each_deviation_moves_the_tip():
    q = jnp.asarray(np.random.default_rng(2).uniform(0.12, 0.28, 9), jnp.float32)
    plain = np.asarray(bha_variant().forward(q))
    for other in (bha_variant(taper=0.3), bha_variant(nonlinear=0.15), bha_variant(sag=0.3)):
        assert np.linalg.norm(np.asarray(other.forward(q)) - plain) > 3e-3


@pytest.mark.parametrize("seed", range(12))
def test_arms_that_nobody_named_have_two_to_four_segments_and_ranges_in_order(seed):
    arm, again = random_soft_arm(seed), random_soft_arm(seed)
    assert 2 <= len(arm.sizes) <= 4
    assert len(arm.joints) == sum(arm.sizes) == len(set(arm.joints))
    assert (np.asarray(arm.lower) < np.asarray(arm.home)).all()
    assert (np.asarray(arm.home) < np.asarray(arm.upper)).all()
    np.testing.assert_array_equal(np.asarray(arm.radii), np.asarray(again.radii))


def test_the_size_of_segments_can_be_asked_for():
    assert set(random_soft_arm(0, size=2).sizes) == {2}
