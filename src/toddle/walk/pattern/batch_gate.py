"""The safety gate for one walker of many, in array operations: `walk.gate.gate` without its timeout."""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float

from toddle.robots.gait import Gait
from toddle.walk.gate import ACCELERATION, BACKWARDS, TURNING


def gate(gait: Gait, last: Float[Array, "3"], asked: Float[Array, "3"], dt: float) -> Float[Array, "3"]:
    """The velocity that is passed on: vx, vy [m/s], omega [rad/s].

    Args:
        gait: its ``fastest`` is the range; `BACKWARDS` of it backwards.
        last: what was passed on before.
        asked: now; a number that isn't finite asks to stand.
        dt: time since ``last`` [s].
    """
    most, dtype = jnp.array(gait.fastest, last.dtype), last.dtype
    asked = jnp.where(jnp.isfinite(asked).all(), asked, 0.0).astype(dtype)
    wanted = jnp.clip(asked, jnp.array([-BACKWARDS, -1.0, -1.0], dtype) * most, most)
    ahead = jnp.where(wanted[0] > 0, most[0], BACKWARDS * most[0])
    reach = jnp.stack([ahead, most[1]])
    parts = jnp.where(reach > 0, wanted[:2] / jnp.where(reach > 0, reach, 1.0), 0.0)
    far = jnp.maximum(jnp.hypot(parts[0], parts[1]), 1.0)
    wanted = wanted / jnp.stack([far, far, jnp.ones_like(far)])
    change = jnp.array([ACCELERATION, ACCELERATION, TURNING], dtype) * dt
    return last + jnp.clip(wanted - last, -change, change)
