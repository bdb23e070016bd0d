"""A driver by script: turns to the goal, walks there, slows down. It sees no obstacles: the baseline without them."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float

_TURNS = 2.0  # share of the fastest turn for each radian of bearing [1/rad]
_NARROW = 0.7  # from this bearing on it turns in place [rad]
_SLOWS = 0.4  # nearer than this it walks slower [m]


def drive(goal: Float[Array, "2"]) -> Float[Array, "2"]:
    """What to do about a goal.

    Args:
        goal: in the robot's frame: ahead, to the left [m].

    Returns:
        Ahead and turning left, as shares of the fastest: an action of the walker's task without vy.
    """
    off = jnp.arctan2(goal[1], goal[0])
    ahead = jnp.maximum(1.0 - jnp.abs(off) / _NARROW, 0.0) * jnp.minimum(jnp.hypot(goal[0], goal[1]) / _SLOWS, 1.0)
    return jnp.stack([ahead, jnp.clip(_TURNS * off, -1.0, 1.0)])
