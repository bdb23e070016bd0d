"""Looks made different in ways that don't change what is right, or change it as is known.

A picture shifted across is what a robot would see that is turned aside by so much; the right command then turns back
(Bojarski et al. 2016). Light, colours, noise and missing depth change nothing.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, PRNGKeyArray

from toddle.navigate.cloning.config import CloningConfig
from toddle.navigate.cloning.labels import COS, SIN

FOCAL = 59.0
"""Focal length of the small picture [pixels]."""

GAIN = 1.2
"""How fast a robot that is turned aside should turn back [1/s]: as the expert does."""

_BLOCK = 10  # side of a square whose depth is missing [pixels]
_GREY = 0.5


class Looks(NamedTuple):
    """Of all streams, in order.

    Attributes:
        colours: red, green, blue, 0 to 1.
        depth: [m]; 0 where it is not known.
        taught: velocity ahead [m/s], turning [rad/s].
        labels: see `labels`.
    """

    colours: Float[Array, "streams steps 60 80 3"]
    depth: Float[Array, "streams steps 60 80"]
    taught: Float[Array, "streams steps 2"]
    labels: Float[Array, "streams steps labels"]


def augmented(looks: Looks, config: CloningConfig, key: PRNGKeyArray) -> Looks:
    """The same looks under other circumstances, of each stream and look its own."""
    of_shift, of_light, of_noise, of_depth = jax.random.split(key, 4)
    if config.shift:
        looks = _shifted(looks, config, of_shift)
    colours, depth = looks.colours, looks.depth
    if config.light:
        colours = _lit(colours, config.light, of_light)
    if config.noise:
        bits = jax.random.bits(of_noise, colours.shape, jnp.uint8)
        colours = colours + (bits.astype(jnp.float32) / 127.5 - 1.0) * config.noise
    if config.dropped:
        depth = _dropped(depth, config.dropped, of_depth)
    return looks._replace(colours=colours, depth=depth)


def _shifted(looks: Looks, config: CloningConfig, key: PRNGKeyArray) -> Looks:
    """Each look turned aside a little, and the command that turns back; who stands or turns on the spot goes on so."""
    pixels = jax.random.randint(key, looks.taught.shape[:2], -config.shift, config.shift + 1)
    angle = pixels.astype(jnp.float32) / FOCAL  # a robot turned to the left sees things farther to the right
    walks = jnp.abs(looks.taught[..., 0]) > 1e-3
    turning = looks.taught[..., 1] - jnp.where(walks, GAIN * angle, 0.0)
    taught = looks.taught.at[..., 1].set(jnp.clip(turning, -config.turning, config.turning))
    cos, sin = looks.labels[..., COS], looks.labels[..., SIN]
    labels = looks.labels.at[..., COS].set(cos * jnp.cos(angle) + sin * jnp.sin(angle))
    labels = labels.at[..., SIN].set(sin * jnp.cos(angle) - cos * jnp.sin(angle))
    moved = jax.vmap(jax.vmap(_moved))
    return Looks(moved(looks.colours, pixels), moved(looks.depth[..., None], pixels)[..., 0], taught, labels)


def _moved(picture: Float[Array, "rows columns parts"], pixels: Int[Array, ""]) -> Float[Array, "rows columns parts"]:
    """To the right; what comes in repeats the edge."""
    columns = jnp.clip(jnp.arange(picture.shape[1]) - pixels, 0, picture.shape[1] - 1)
    return picture[:, columns]


def _lit(colours: Float[Array, "streams *rest"], share: float, key: PRNGKeyArray) -> Float[Array, "streams *rest"]:
    """Brightness, contrast and each colour of a stream changed by up to a share."""
    streams, ones = len(colours), (1,) * (colours.ndim - 2)
    of_all, of_each, of_offset = jax.random.split(key, 3)
    gain = 1.0 + jax.random.uniform(of_all, (streams, 1), jnp.float32, -share, share)
    gain = gain * (1.0 + jax.random.uniform(of_each, (streams, 3), jnp.float32, -share / 2, share / 2))
    offset = jax.random.uniform(of_offset, (streams, 1), jnp.float32, -share / 2, share / 2)
    gain, offset = gain.reshape(streams, *ones, 3), offset.reshape(streams, *ones, 1)
    return (colours - _GREY) * gain + _GREY + offset


def _dropped(
    depth: Float[Array, "streams steps 60 80"], share: float, key: PRNGKeyArray
) -> Float[Array, "streams steps 60 80"]:
    """Without the depth of some streams, and of some blocks of each look."""
    of_all, of_blocks = jax.random.split(key)
    streams, steps, rows, columns = depth.shape
    small = streams, steps, rows // _BLOCK, columns // _BLOCK
    kept = jax.random.bernoulli(of_blocks, 1.0 - share, small) & jax.random.bernoulli(
        of_all, 1.0 - share, (streams, 1, 1, 1)
    )
    whole = jnp.repeat(jnp.repeat(kept, _BLOCK, axis=2), _BLOCK, axis=3)
    return jnp.where(whole, depth, 0.0)
