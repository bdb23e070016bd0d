"""Pictures and depth as networks see them: colours, nearness and whether it is known, to mean 0 and spread 1."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Float32, UInt8

NEAREST = 0.4
"""Nothing is told to be nearer than this [m]."""

PARTS = 5
"""Numbers of a pixel: red, green, blue, nearness, whether it is known."""


class Scale(NamedTuple):
    """Of what was learned from.

    Attributes:
        mean: of red, green, blue (0 to 1) and nearness [1/m] where it is known.
        deviation: likewise.
    """

    mean: Float32[Array, "4"]
    deviation: Float32[Array, "4"]


def scale_of(pictures: UInt8[np.ndarray, "looks 60 80 3"], depth: Float[np.ndarray, "looks 60 80"]) -> Scale:
    """The scale of some looks; depth [m], 0 where it is not known."""
    known = depth > 0
    near = 1.0 / np.maximum(depth[known], NEAREST) if known.any() else np.zeros(1)
    colours = pictures.reshape(-1, 3) / 255.0
    mean, spread = np.append(colours.mean(axis=0), near.mean()), np.append(colours.std(axis=0), near.std())
    return Scale(jnp.asarray(mean, jnp.float32), jnp.asarray(np.maximum(spread, 0.05), jnp.float32))


def frames(
    colours: Float[Array, "*looks 60 80 3"], depth: Float[Array, "*looks 60 80"], scale: Scale
) -> Float[Array, "*looks 60 80 5"]:
    """What a network sees.

    Args:
        colours: red, green, blue, 0 to 1.
        depth: [m]; 0 where it is not known.
        scale: of what was learned from.
    """
    known = (depth > 0).astype(jnp.float32)
    near = known * (1.0 / jnp.maximum(depth, NEAREST) - scale.mean[3]) / scale.deviation[3]
    middle, spread = (jnp.broadcast_to(part[:3], colours.shape) for part in scale)
    seen = (colours - middle) / spread
    return jnp.concatenate([seen, near[..., None], known[..., None]], axis=-1)
