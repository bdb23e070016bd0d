"""Velocities as levels: each lies between two, and is told by how much of either; their mean is the velocity again."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from toddle.navigate.cloning.config import CloningConfig


def levels(config: CloningConfig) -> tuple[Float[Array, " ahead"], Float[Array, " turning"]]:
    """Velocities ahead [m/s] and turning [rad/s] that commands are put together from; 0 is one of each."""
    low, high = config.ahead
    ahead, turning = config.levels
    evenly = jnp.linspace(low, high, ahead)
    still = jnp.argmin(jnp.abs(evenly))
    return evenly.at[still].set(0.0), jnp.linspace(-config.turning, config.turning, turning)


def shares(velocity: Float[Array, "*rows"], steps: Float[Array, " levels"]) -> Float[Array, "*rows levels"]:
    """How much of each level a velocity is made of: of two neighbours, adding up to 1."""
    inside = jnp.clip(velocity, steps[0], steps[-1])
    place = jnp.interp(inside, steps, jnp.arange(len(steps), dtype=steps.dtype))
    numbers = jnp.broadcast_to(jnp.arange(len(steps), dtype=steps.dtype), (*place.shape, len(steps)))
    return jnp.maximum(1.0 - jnp.abs(place[..., None] - numbers), 0.0)


def mean(logits: Float[Array, "*rows levels"], steps: Float[Array, " levels"]) -> Float[Array, "*rows"]:
    """The velocity to expect."""
    return jax.nn.softmax(logits) @ steps


def likeliest(logits: Float[Array, "*rows levels"], steps: Float[Array, " levels"]) -> Float[Array, "*rows"]:
    """The mean over the likeliest level and its neighbours: no compromise between left and right."""
    best = jnp.argmax(logits, axis=-1, keepdims=True)
    numbers = jnp.broadcast_to(jnp.arange(len(steps)), logits.shape)
    return mean(jnp.where(jnp.abs(numbers - best) <= 1, logits, -1e9), steps)
