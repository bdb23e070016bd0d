"""A picture that is shifted is what a robot sees that is turned, and is taught to turn back."""

from __future__ import annotations

import math
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from toddle.navigate.cloning.augment import GAIN, Circumstances, Looks, augmented, drawn
from toddle.navigate.cloning.config import CloningConfig
from toddle.navigate.cloning.labels import COS, LABELS, SIN
from toddle.navigate.scenarios.draw_rooms import room
from toddle.navigate.scenarios.raycast import chest_eye, ray_caster

CONFIG = CloningConfig()


def _plain(shift: int = 0) -> Circumstances:
    """Nothing but a shift."""
    kept = jnp.ones((1, 1, 6, 8), bool)
    return Circumstances(jnp.full((1, 1), shift), jnp.ones((1, 240)), jnp.zeros(1), jnp.zeros((1, 60, 240)), kept)


def _looks(colours: np.ndarray, depth: np.ndarray, bearing: float, taught: tuple[float, float]) -> Looks:
    labels = np.zeros((1, 1, LABELS), np.float32)
    labels[..., COS], labels[..., SIN] = math.cos(bearing), math.sin(bearing)
    given = colours[None, None], depth[None, None], np.array([[taught]]), labels
    return Looks(*(jnp.asarray(part, jnp.float32) for part in given))


def test_it_is_what_a_turned_robot_sees() -> None:
    """Against rays: turned to the left by two pixels, and the bearing of the target as it then is."""
    there = room("straight", "train", 0)
    caster, angle = ray_caster(there), 2 / 59.0
    straight, turned = (caster.view(chest_eye(0.0, 0.0, yaw, pitch=0.0)) for yaw in (0.0, angle))
    bearing = math.atan2(there.target.y, there.target.x)
    looks = augmented(_looks(straight.picture / 255.0, straight.depth, bearing, (0.2, 0.0)), CONFIG, _plain(2))
    middle = slice(30, 50)  # near the optical axis a turn is a shift
    made, real = np.asarray(looks.depth)[0, 0, 20:40, middle], turned.depth[20:40, middle]
    shifted, unshifted = np.abs(made - real), np.abs(straight.depth[20:40, middle] - real)
    assert np.median(shifted) < 0.25 * max(np.median(unshifted), 1e-3) or np.median(shifted) < 0.02
    found = math.atan2(float(looks.labels[0, 0, SIN]), float(looks.labels[0, 0, COS]))
    assert found == pytest.approx(bearing - angle, abs=1e-5)
    assert float(looks.taught[0, 0, 1]) == pytest.approx(-GAIN * angle, abs=1e-6)


def test_who_stands_goes_on_standing() -> None:
    looks = _looks(np.zeros((60, 80, 3)), np.ones((60, 80)), 0.1, (0.0, 0.0))
    assert augmented(looks, CONFIG, _plain(2)).taught.tolist() == [[[0.0, 0.0]]]


def test_without_circumstances_nothing_changes() -> None:
    draw = np.random.default_rng(0)
    looks = _looks(draw.random((60, 80, 3)), draw.random((60, 80)), 0.3, (0.1, 0.2))
    off = replace(CONFIG, shift=0, light=0.0, noise=0.0, dropped=0.0)
    for under in (_plain(), drawn(off, 1, 1, jax.random.key(0))):
        for one, other in zip(augmented(looks, off, under), looks, strict=True):
            np.testing.assert_allclose(one, other, atol=1e-6)


def test_depth_is_missing_where_it_is_dropped_and_nothing_beyond_the_bounds() -> None:
    under = drawn(replace(CONFIG, dropped=0.3), 16, 8, jax.random.key(1))
    assert 0.55 < float(under.kept.mean()) / 0.7 / 0.7 * 0.7 < 0.85
    assert int(jnp.abs(under.shift).max()) == CONFIG.shift
    assert float(jnp.abs(under.noise).max()) <= CONFIG.noise + 1e-6
    assert float(jnp.abs(under.gain - 1.0).max()) <= 1.15 * 1.075 - 1.0 + 1e-6
    looks = Looks(
        jnp.ones((16, 8, 60, 80, 3)), jnp.ones((16, 8, 60, 80)), jnp.zeros((16, 8, 2)), jnp.zeros((16, 8, LABELS))
    )
    depth = augmented(looks, CONFIG, under).depth
    blocks = np.asarray(depth).reshape(16, 8, 6, 10, 8, 10).mean(axis=(3, 5))
    assert np.array_equal(blocks, np.asarray(under.kept).astype(np.float32))
