"""The continuum arm against its published formulas bent, nearly straight and straight."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.robots.continuum import Continuum, bha, segment

RADII = (0.100, 0.093, 0.079)


def _published(lengths: Sequence[float], radii: Sequence[float]) -> np.ndarray:
    """Thuruthel 2016 as printed: g, bend angle theta, direction phi; the tip at the end of an arc.

    g^2 is computed in fractions, for its terms cancel; all else is in double precision and does not cancel.
    """
    frame = np.eye(4)
    for i, r in enumerate(radii):
        l1, l2, l3 = (Fraction(float(v)) for v in lengths[3 * i : 3 * i + 3])
        g = math.sqrt(l1**2 + l2**2 + l3**2 - l1 * l2 - l1 * l3 - l2 * l3)
        theta, arc = 2 * g / (3 * r), float(l1 + l2 + l3) / 3
        phi = math.atan2(math.sqrt(3) * float(l3 - l2), float(l2 + l3 - 2 * l1))
        out, up = (2 * math.sin(theta / 2) ** 2 / theta, math.sin(theta) / theta) if theta else (0.0, 1.0)
        cp, sp, ct, s = math.cos(phi), math.sin(phi), math.cos(theta), math.sin(theta)
        about_z = np.array([[cp, -sp, 0], [sp, cp, 0], [0, 0, 1]])
        about_y = np.array([[ct, 0, s], [0, 1, 0], [-s, 0, ct]])
        step = np.eye(4)
        step[:3, :3] = about_z @ about_y @ about_z.T
        step[:3, 3] = arc * out * cp, arc * out * sp, arc * up
        frame = frame @ step
    return frame


@jax.jit
def _pose(arm: Continuum, q: jax.Array) -> tuple[jax.Array, jax.Array]:
    return arm.forward(q), arm.pose(q)


@given(st.lists(st.floats(0.1, 0.3), min_size=9, max_size=9), st.sampled_from([1.0, 1e-2, 1e-4, 1e-6]))
def test_it_is_the_published_arm_bent_or_nearly_straight(lengths: list[float], spread: float) -> None:
    arm = bha()
    q = np.asarray(0.2 + spread * (np.array(lengths) - 0.2), dtype=np.float32)
    expected = _published([float(v) for v in q], [float(r) for r in arm.radii])
    x, pose = _pose(arm, jnp.asarray(q))
    np.testing.assert_allclose(np.asarray(x), expected[:3, 3], atol=3e-7, rtol=3e-6)
    np.testing.assert_allclose(np.asarray(pose), expected, atol=1e-6)


@pytest.mark.parametrize("difference", [3e-7, 1e-5, 1e-3, 3e-2, 0.1])
def test_a_small_bend_keeps_its_digits_in_single_precision(difference: float) -> None:
    """The sideways shift is exact to its own last digits, however small, not to those of the arc."""
    lengths = np.array([0.2, 0.2 + difference, 0.2], dtype=np.float32)
    expected = _published([float(v) for v in lengths], [float(np.float32(0.1))])
    turn, shift = segment(jnp.asarray(lengths), jnp.float32(0.1))
    np.testing.assert_allclose(np.asarray(shift), expected[:3, 3], rtol=2e-6)
    np.testing.assert_allclose(np.asarray(turn)[:2, 2], expected[:2, 2], rtol=2e-6)


def test_equal_lengths_are_exactly_straight() -> None:
    for length in (0.1, 0.17, 0.3):
        x, pose = _pose(bha(), jnp.full(9, length, jnp.float32))
        np.testing.assert_array_equal(np.asarray(x)[:2], 0.0)
        np.testing.assert_allclose(float(x[2]), 3 * length, rtol=2e-7)
        np.testing.assert_array_equal(np.asarray(pose)[:3, :3], np.eye(3))


def test_the_home_is_the_papers() -> None:
    np.testing.assert_allclose(np.asarray(bha().forward(bha().home)), [0, 0, 0.9], atol=1e-7)


@pytest.mark.parametrize("where", ["straight", "one segment straight", "bent", "at the change of formula"])
def test_derivatives_agree_with_finite_differences(where: str) -> None:
    """In double precision; reverse, forward and batched alike, and the second derivative is finite too."""
    q = {
        "straight": np.full(9, 0.3),
        "one segment straight": np.array([0.2] * 3 + [0.1, 0.2, 0.3] + [0.15, 0.3, 0.1]),
        "bent": np.array([0.1, 0.2, 0.3, 0.3, 0.12, 0.2, 0.11, 0.29, 0.17]),
        "at the change of formula": np.array([0.2, 0.2 + 0.75 * 0.1 * np.sqrt(0.5) * 2, 0.2] + [0.2] * 6),
    }[where]
    h = 1e-6
    steps = [(_published(q + h * e, RADII) - _published(q - h * e, RADII))[:3, 3] / (2 * h) for e in np.eye(9)]
    with jax.enable_x64(True):
        arm = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), bha())
        arm = replace(arm, radii=jnp.array(RADII))
        forward, reverse, batched, second = (np.asarray(d) for d in _derivatives(arm, jnp.asarray(q)))
    np.testing.assert_allclose(forward, np.stack(steps, axis=1), atol=1e-8)
    np.testing.assert_allclose(reverse, forward, atol=1e-12)
    np.testing.assert_allclose(batched, [forward, forward], atol=1e-12)
    assert np.all(np.isfinite(second))


@jax.jit
def _derivatives(arm: Continuum, q: jax.Array) -> tuple[jax.Array, ...]:
    jacobian = jax.jacfwd(arm.forward)
    _, second = jax.jvp(jacobian, (q,), (jnp.ones(9),))
    return jacobian(q), jax.jacrev(arm.forward)(q), jax.vmap(jacobian)(jnp.stack([q, q])), second


def test_the_straight_arms_derivative_is_exact_in_single_precision() -> None:
    jacobian = np.asarray(jax.jit(jax.jacfwd(bha().forward))(bha().home))
    below = np.array([0.75, 0.45, 0.15])  # [m] from a segment's middle to the tip, or to its own head
    for i, r in enumerate(RADII):
        # a bend b turns all that lies above the segment and half of its own arc: dx = b (rest + arc / 2)
        expected = -2 / (3 * r) * below[i]
        np.testing.assert_allclose(jacobian[0, 3 * i], expected, rtol=1e-6)
        np.testing.assert_allclose(jacobian[2, 3 * i : 3 * i + 3], 1 / 3, rtol=1e-6)
