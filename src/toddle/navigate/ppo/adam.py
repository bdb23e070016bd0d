"""Adam (Kingma and Ba 2015, algorithm 1), on any pytree of arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

BETA1, BETA2 = 0.9, 0.999
EPSILON = 1e-5
"""Larger than Adam's 1e-8: usual for proximal policy optimization (Engstrom et al. 2020)."""


class Adam(NamedTuple):
    """Between two steps.

    Attributes:
        first: running mean of the gradients (m).
        second: of their squares (v).
        steps: made so far (t).
    """

    first: Any
    second: Any
    steps: Int[Array, ""]


def at_rest(parameters: Any) -> Adam:
    """Before the first step."""
    zeros = jax.tree.map(jnp.zeros_like, parameters)
    return Adam(zeros, zeros, jnp.zeros((), jnp.int32))


def moved(parameters: Any, adam: Adam, gradient: Any, rate: Float[Array, ""]) -> tuple[Any, Adam]:
    """Parameters and state after one step downhill."""
    first = jax.tree.map(lambda m, g: BETA1 * m + (1 - BETA1) * g, adam.first, gradient)
    second = jax.tree.map(lambda v, g: BETA2 * v + (1 - BETA2) * g**2, adam.second, gradient)
    steps = adam.steps + 1
    grown1, grown2 = (1 - jnp.float32(beta) ** steps.astype(jnp.float32) for beta in (BETA1, BETA2))

    def move(p: Array, m: Array, v: Array) -> Array:
        return p - rate * (m / grown1) / (jnp.sqrt(v / grown2) + EPSILON)

    return jax.tree.map(move, parameters, first, second), Adam(first, second, steps)


def shortened(gradient: Any, longest: float) -> tuple[Any, Float[Array, ""]]:
    """A gradient of at most this norm, and the norm that it had."""
    norm = jnp.sqrt(sum((g**2).sum() for g in jax.tree.leaves(gradient)))
    by = jnp.minimum(1.0, longest / (norm + 1e-6))
    return jax.tree.map(lambda g: g * by, gradient), norm
