"""The document's eyes: a U-Net (Ronneberger et al. 2015; Huber 2019, figure 4.15) over the whole picture, two layers.

Pairs of 3 x 3 convolutions with ReLU; down twice by the greatest of 2 x 2, up twice by interpolation, each time beside
what was there before it went down; four channels of tanh at the end. The numbers of channels are those of the author's
public code, https://github.com/mhubii/nmpc_pattern_generator, which also normalises over the batch; here nothing does.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float, PRNGKeyArray

from toddle.navigate.sight import COLUMNS, ROWS

_LEFT = 4  # channels that leave the U-Net


class Pair(eqx.Module):
    """Two 3 x 3 convolutions with ReLU.

    Attributes:
        kernels: of both.
        biases: of both.
    """

    kernels: tuple[Float[Array, "3 3 _ _"], Float[Array, "3 3 _ _"]]
    biases: tuple[Float[Array, " _"], Float[Array, " _"]]

    def __call__(self, x: Float[Array, "looks rows columns _"]) -> Float[Array, "looks rows columns _"]:
        """Pictures of the same size."""
        for kernel, bias in zip(self.kernels, self.biases, strict=True):
            x = jax.nn.relu(_convolved(x, kernel) + bias[None, None, None])
        return x


class UNetEyes(eqx.Module):
    """From pictures to features.

    Attributes:
        pairs: into it, down, down, up, up.
        out: from the last channels to four.
        weights: of the layers behind it.
        biases: of ``out`` and those layers.
    """

    pairs: tuple[Pair, ...]
    out: Float[Array, "1 1 _ _"]
    weights: tuple[Float[Array, "_ _"], ...]
    biases: tuple[Float[Array, " _"], ...]

    def __call__(self, frames: Float[Array, "looks 60 80 parts"]) -> Float[Array, "looks features"]:
        """Features of each look."""
        into, down, lowest, up, top = self.pairs
        fine = into(frames)
        middle = down(_halved(fine))
        x = up(jnp.concatenate([middle, _doubled(lowest(_halved(middle)))], axis=-1))
        x = top(jnp.concatenate([fine, _doubled(x)], axis=-1))
        x = jnp.tanh(_convolved(x, self.out) + self.biases[0][None, None, None]).reshape(len(frames), -1)
        for weight, bias in zip(self.weights, self.biases[1:], strict=True):
            x = jax.nn.relu(x @ weight + bias[None])
        return x


def unet_eyes(parts: int, channels: tuple[int, ...], hidden: int, features: int, key: PRNGKeyArray) -> UNetEyes:
    """Untrained ones (He et al. 2015).

    Args:
        parts: numbers of a pixel.
        channels: at full, half and quarter size.
        hidden: units of the first layer behind the U-Net.
        features: of a look.
        key: draws the weights.
    """
    a, b, c = channels
    keys = jax.random.split(key, 13)
    he = jax.nn.initializers.he_normal()
    sizes = ((parts, a), (a, b), (b, c), (b + c, a), (2 * a, a))
    pairs = [
        Pair(
            (he(one, (3, 3, before, after), jnp.float32), he(two, (3, 3, after, after), jnp.float32)),
            (jnp.zeros(after, jnp.float32), jnp.zeros(after, jnp.float32)),
        )
        for (before, after), one, two in zip(sizes, keys[:5], keys[5:10], strict=True)
    ]
    out = he(keys[10], (1, 1, a, _LEFT), jnp.float32)
    weights = (
        he(keys[11], (ROWS * COLUMNS * _LEFT, hidden), jnp.float32),
        he(keys[12], (hidden, features), jnp.float32),
    )
    biases = tuple(jnp.zeros(n, jnp.float32) for n in (_LEFT, hidden, features))
    return UNetEyes(tuple(pairs), out, weights, biases)


def _convolved(
    x: Float[Array, "looks rows columns _"], kernel: Float[Array, "_ _ _ _"]
) -> Float[Array, "looks rows columns _"]:
    return lax.conv_general_dilated(x, kernel, (1, 1), "SAME", dimension_numbers=("NHWC", "HWIO", "NHWC"))


def _halved(x: Float[Array, "looks rows columns _"]) -> Float[Array, "looks _ _ _"]:
    """The greatest of each 2 x 2."""
    looks, rows, columns, parts = x.shape
    return x.reshape(looks, rows // 2, 2, columns // 2, 2, parts).max(axis=(2, 4))


def _doubled(x: Float[Array, "looks rows columns parts"]) -> Float[Array, "looks _ _ parts"]:
    """Interpolated between the pixels."""
    looks, rows, columns, parts = x.shape
    return jax.image.resize(x, (looks, 2 * rows, 2 * columns, parts), "linear")
