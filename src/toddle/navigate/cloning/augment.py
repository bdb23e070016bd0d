"""Looks made different in ways that don't change what is right, or change it as is known.

A picture shifted across is what a robot would see that is turned aside by so much; the right command then turns back
(Bojarski et al. 2016). Light, colours, noise and missing depth change nothing.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from toddle.navigate.cloning.config import CloningConfig
from toddle.navigate.cloning.labels import COS, SIN
from toddle.navigate.sight import COLUMNS, ROWS

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


class Circumstances(NamedTuple):
    """Under which looks are seen.

    Attributes:
        shift: of each look, to the right [pixels].
        gain: of each stream: brightness and colours, pixel by pixel along a row.
        offset: of each stream.
        noise: of each step; all streams share it, which is quicker.
        kept: blocks of depth that are not missing.
    """

    shift: Int[Array, "streams steps"]
    gain: Float[Array, "streams numbers"]
    offset: Float[Array, " streams"]
    noise: Float[Array, "steps rows numbers"]
    kept: Bool[Array, "streams steps 6 8"]


@partial(jax.jit, static_argnums=(0, 1, 2))
def drawn(config: CloningConfig, streams: int, steps: int, key: PRNGKeyArray) -> Circumstances:
    """Circumstances at random.

    They are compiled apart from `augmented`: together, the compiler draws anew for each pixel, and it takes three times
    as long.
    """
    of_shift, of_all, of_each, of_offset, of_noise, of_depth, of_blocks = jax.random.split(key, 7)
    shift = jax.random.randint(of_shift, (streams, steps), -config.shift, config.shift + 1)
    share = config.light
    gain = 1.0 + jax.random.uniform(of_all, (streams, 1), jnp.float32, -share, share)
    gain = gain * (1.0 + jax.random.uniform(of_each, (streams, 3), jnp.float32, -share / 2, share / 2))
    offset = jax.random.uniform(of_offset, (streams,), jnp.float32, -share / 2, share / 2)
    bits = jax.random.bits(of_noise, (steps, ROWS, 3 * COLUMNS), jnp.uint8)
    noise = (bits.astype(jnp.float32) / 127.5 - 1.0) * config.noise
    small = streams, steps, ROWS // _BLOCK, COLUMNS // _BLOCK
    kept = jax.random.bernoulli(of_blocks, 1.0 - config.dropped, small)
    kept &= jax.random.bernoulli(of_depth, 1.0 - config.dropped, (streams, 1, 1, 1))
    return Circumstances(shift, jnp.tile(gain, (1, COLUMNS)), offset, noise, kept)


def augmented(looks: Looks, config: CloningConfig, under: Circumstances) -> Looks:
    """The same looks under these circumstances."""
    looks = _shifted(looks, config, under.shift)
    shape = looks.colours.shape
    rows = looks.colours.reshape(*shape[:3], -1)
    gain = jnp.broadcast_to(under.gain[:, None, None], rows.shape)
    offset = jnp.broadcast_to(under.offset[:, None, None, None] + _GREY, rows.shape)
    rows = (rows - _GREY) * gain + offset + jnp.broadcast_to(under.noise[None], rows.shape)
    kept = jnp.repeat(jnp.repeat(under.kept, _BLOCK, axis=2), _BLOCK, axis=3)
    return looks._replace(colours=rows.reshape(shape), depth=jnp.where(kept, looks.depth, 0.0))


def _shifted(looks: Looks, config: CloningConfig, pixels: Int[Array, "streams steps"]) -> Looks:
    """Each look turned aside a little, and the command that turns back; who stands or turns on the spot goes on so."""
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
