"""The light eyes: one convolution of 4 x 4 pixels by steps of 4, then two of 3 x 3 by steps of 2, and a layer.

The first one's squares don't overlap, so that it is one matrix product: the layouts that overlap there took two to four
times as long to learn on a CPU.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float, PRNGKeyArray

from toddle.navigate.sight import COLUMNS, ROWS

SQUARE = 4
"""Side of the first convolution's squares [pixels]."""


class LightEyes(eqx.Module):
    """From pictures to features.

    Attributes:
        first: from a square's numbers to channels.
        kernels: of the convolutions behind it.
        last: from all that is left to the features.
        biases: of all of these.
    """

    first: Float[Array, "numbers channels"]
    kernels: tuple[Float[Array, "3 3 _ _"], ...]
    last: Float[Array, "_ features"]
    biases: tuple[Float[Array, " _"], ...]

    def __call__(self, frames: Float[Array, "looks 60 80 parts"]) -> Float[Array, "looks features"]:
        """Features of each look."""
        looks, rows, columns, parts = frames.shape
        down, across = rows // SQUARE, columns // SQUARE
        squares = frames.reshape(looks, down, SQUARE, across, SQUARE * parts).swapaxes(2, 3)
        x = squares.reshape(looks * down * across, -1) @ self.first + self.biases[0][None]
        x = jax.nn.relu(x).reshape(looks, down, across, -1)
        for kernel, bias in zip(self.kernels, self.biases[1:-1], strict=True):
            x = jax.nn.relu(_convolved(x, kernel) + bias[None, None, None])
        return jax.nn.relu(x.reshape(looks, -1) @ self.last + self.biases[-1][None])


def light_eyes(parts: int, channels: tuple[int, ...], features: int, key: PRNGKeyArray) -> LightEyes:
    """Untrained ones (He et al. 2015).

    Args:
        parts: numbers of a pixel.
        channels: of the convolutions.
        features: of a look.
        key: draws the weights.
    """
    keys = jax.random.split(key, len(channels) + 1)
    he = jax.nn.initializers.he_normal()
    rows, columns = ROWS // SQUARE, COLUMNS // SQUARE
    kernels = []
    for one, before, after in zip(keys[1:-1], channels[:-1], channels[1:], strict=True):
        kernels.append(he(one, (3, 3, before, after), jnp.float32))
        rows, columns = -(-rows // 2), -(-columns // 2)
    first = he(keys[0], (SQUARE * SQUARE * parts, channels[0]), jnp.float32)
    last = he(keys[-1], (rows * columns * channels[-1], features), jnp.float32)
    return LightEyes(first, tuple(kernels), last, tuple(jnp.zeros(n, jnp.float32) for n in (*channels, features)))


def _convolved(x: Float[Array, "looks _ _ _"], kernel: Float[Array, "3 3 _ _"]) -> Float[Array, "looks _ _ _"]:
    return lax.conv_general_dilated(x, kernel, (2, 2), "SAME", dimension_numbers=("NHWC", "HWIO", "NHWC"))
