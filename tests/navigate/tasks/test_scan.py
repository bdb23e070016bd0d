"""The range scan against points sampled along its rays, and cases that can be counted on fingers."""

from __future__ import annotations

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.navigate.tasks.scan import scan

REACH = 2.0
SAMPLES = np.linspace(0.0, REACH, 4001)  # along each ray, every half millimetre


def sampled(place: np.ndarray, circles: np.ndarray, rays: int) -> np.ndarray:
    """The first sample of each ray that lies in a circle."""
    seen = []
    for ray in range(rays):
        angle = place[2] + 2 * math.pi * ray / rays
        points = place[:2] + SAMPLES[:, None] * np.array([math.cos(angle), math.sin(angle)])
        away = np.hypot(*(points[:, None] - circles[None, :, :2]).transpose(2, 0, 1))
        inside = (away <= circles[:, 2]).any(axis=1)
        seen.append(SAMPLES[np.argmax(inside)] if inside.any() else REACH)
    return np.array(seen) / REACH


@given(seed=st.integers(0, 1000), rays=st.sampled_from([1, 7, 24]))
def test_every_ray_ends_where_samples_along_it_first_lie_in_a_circle(seed: int, rays: int) -> None:
    draw = np.random.default_rng(seed)
    place = draw.uniform(-1, 1, 3) * [1, 1, math.pi]
    circles = np.column_stack([draw.uniform(-2, 2, (6, 2)), draw.uniform(0.05, 0.6, 6)])
    circles[0, 2] = -1.0
    seen = np.asarray(scan(jnp.asarray(place, jnp.float32), jnp.asarray(circles, jnp.float32), rays, REACH, beams=1))
    off = np.abs(seen - sampled(place, circles, rays)) * REACH
    grazing = np.zeros(rays, bool)  # a ray that only touches a rim may be seen or not
    for ray in range(rays):
        angle = place[2] + 2 * math.pi * ray / rays
        aside = math.cos(angle) * (circles[:, 1] - place[1]) - math.sin(angle) * (circles[:, 0] - place[0])
        grazing[ray] = (np.abs(np.abs(aside) - circles[:, 2]) < 1e-4).any()
    assert (off[~grazing] < 2e-3).all()


@pytest.mark.parametrize(
    ("circle", "ahead", "left", "behind"),
    [
        ((1.0, 0.0, 0.25), 0.75, 2.0, 2.0),
        ((0.0, 1.0, 0.25), 2.0, 0.75, 2.0),
        ((-1.0, 0.0, 0.5), 2.0, 2.0, 0.5),
        ((3.0, 0.0, 0.5), 2.0, 2.0, 2.0),
        ((1.0, 0.0, -1.0), 2.0, 2.0, 2.0),
        ((0.1, 0.0, 0.5), 0.0, 0.0, 0.0),
    ],
)
def test_one_circle(circle: tuple[float, float, float], ahead: float, left: float, behind: float) -> None:
    seen = scan(jnp.zeros(3), jnp.array([circle]), 4, REACH, beams=1)
    np.testing.assert_allclose(REACH * np.asarray(seen)[:3], [ahead, left, behind], atol=1e-6)


def test_a_ray_is_the_nearest_of_the_beams_of_its_sector() -> None:
    place, circles = jnp.array([0.3, -0.2, 1.0]), jnp.array([[1.0, 0.5, 0.1], [-0.5, 1.0, 0.3], [0.0, -1.5, 0.2]])
    fine = np.asarray(scan(place, circles, 24, REACH, beams=1))
    sectors = np.roll(fine, 1).reshape(8, 3)  # the first beam of the first sector lies to the right of straight ahead
    np.testing.assert_allclose(scan(place, circles, 8, REACH, beams=3), sectors.min(axis=1), atol=1e-5)
    assert (sectors.min(axis=1) < sectors[:, 1]).any()


def test_no_circle_slips_between_the_rays_of_the_walkers_task() -> None:
    turns = jnp.linspace(0.0, 2 * math.pi, 500)
    thinnest = jnp.array([[1.1, 0.0, 0.1]])
    seen = jax.vmap(lambda turn: scan(jnp.array([0.0, 0.0, 1.0]) * turn, thinnest, 24, REACH))(turns)
    assert (seen.min(axis=1) < 1.0).all()


def test_without_circles_nothing_is_seen() -> None:
    assert scan(jnp.zeros(3), jnp.zeros((0, 3)), 5, REACH).tolist() == [1.0] * 5


def test_without_rays_there_are_no_numbers() -> None:
    assert scan(jnp.zeros(3), jnp.ones((2, 3)), 0, REACH).shape == (0,)
