"""Running mean and variance, by which observations and rewards are normalised (Chan, Golub, LeVeque 1979)."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

_FARTHEST = 10.0  # deviations from the mean
_LEAST = 1e-8  # of a variance


class Moments(NamedTuple):
    """Of what has been seen so far.

    Attributes:
        seen_rows: how many.
        mean: of each number.
        variance: of each number.
    """

    seen_rows: Float[Array, ""]
    mean: Float[Array, " numbers"]
    variance: Float[Array, " numbers"]

    def seen(self, rows: Float[Array, "rows numbers"]) -> Moments:
        """With more rows."""
        new = jnp.float32(len(rows))
        total = self.seen_rows + new
        off = rows.mean(axis=0) - self.mean
        squares = self.variance * self.seen_rows + rows.var(axis=0) * new + off**2 * self.seen_rows * new / total
        return Moments(total, self.mean + off * new / total, squares / total)

    def normalised(self, x: Float[Array, "*batch numbers"]) -> Float[Array, "*batch numbers"]:
        """In deviations from the mean, at most 10."""
        mean, deviation = (jnp.broadcast_to(part, x.shape) for part in (self.mean, jnp.sqrt(self.variance + _LEAST)))
        return jnp.clip((x - mean) / deviation, -_FARTHEST, _FARTHEST)


def unseen(numbers: int) -> Moments:
    """Of nothing: normalising changes nothing."""
    return Moments(jnp.float32(1e-4), jnp.zeros(numbers, jnp.float32), jnp.ones(numbers, jnp.float32))
