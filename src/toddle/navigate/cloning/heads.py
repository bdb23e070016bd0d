"""What else the memory can tell, by one linear layer: where the target is and how near things are (see `labels`)."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from toddle.navigate.cloning.labels import COS, DISTANCE, FIRST_SECTOR, SECTORS, SEEN, VISIBLE


def heads_loss(told: Float[Array, "*rows labels"], labels: Float[Array, "*rows labels"]) -> Float[Array, "*rows"]:
    """How wrong it is about each look: entropies of what is or isn't, squares of the rest.

    Bearing and distance count where the target was seen lately; then they are known, in view or not.
    """
    known = labels[..., SEEN]
    is_or_not = sum(_entropy(told[..., column], labels[..., column]) for column in (SEEN, VISIBLE))
    off = (told - labels) ** 2
    place = known * off[..., COS : DISTANCE + 1].sum(axis=-1)
    near = off[..., FIRST_SECTOR:].sum(axis=-1) * (4.0 / SECTORS)
    return is_or_not + place + near


def _entropy(logit: Float[Array, "*rows"], truth: Float[Array, "*rows"]) -> Float[Array, "*rows"]:
    return jnp.maximum(logit, 0.0) - logit * truth + jax.nn.softplus(-jnp.abs(logit))
