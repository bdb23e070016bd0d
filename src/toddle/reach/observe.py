"""Looking where the tip goes: one function for bodies that compute it and plants that move there."""

from __future__ import annotations

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from toddle.robots.body import Body, Plant

Observe = Callable[[Float[np.ndarray, "batch joints"]], Float[np.ndarray, "batch space"]]


def observer(body: Body | Plant) -> Observe:
    """Where joint values [rad or m] bring the tip [m]; a plant moves there, one row after the other."""
    if isinstance(body, Body):
        return lambda q: np.asarray(_forward_all(body, jnp.asarray(q, jnp.float32)), float)
    return lambda q: np.stack([np.asarray(body.move(row), float) for row in np.asarray(q, float)])


@eqx.filter_jit
def _forward_all(body: Body, q: Float[Array, "batch joints"]) -> Float[Array, "batch space"]:
    return jax.vmap(body.forward)(q)
