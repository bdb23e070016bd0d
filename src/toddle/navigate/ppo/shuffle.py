"""The order of minibatches: a random permutation, quickly.

`jax.random.permutation` sorts pairs, twice; on a processor that takes as long as the gradients of small networks. Here
each number to be sorted holds its own place in its lowest bits and chance in all others, so that one plain sort does.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Int, PRNGKeyArray

_MOST = 2**16  # beyond, too few bits would be left to chance: equal ones keep their order


def shuffled(key: PRNGKeyArray, count: int) -> Int[Array, " count"]:
    """The numbers from 0 up to, without, ``count``, in random order."""
    if count > _MOST:
        return jax.random.permutation(key, count)
    places = jnp.arange(count, dtype=jnp.uint32)
    own = jnp.uint32((1 << (count - 1).bit_length()) - 1)
    chance = jax.random.bits(key, (count,), jnp.uint32) & ~own
    return (jnp.sort(chance | places) & own).astype(jnp.int32)
