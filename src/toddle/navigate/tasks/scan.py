"""A range scan: how far it is to the nearest upright cylinder along rays around the robot, exactly.

The rays go all around, the first one ahead: the robot also walks backwards and aside, and people come from behind.
"""

from __future__ import annotations

import math

import jax.numpy as jnp
from jaxtyping import Array, Float


def scan(
    place: Float[Array, "3"], circles: Float[Array, "circles 3"], rays: int, reach: float
) -> Float[Array, " {rays}"]:
    """Distances to the nearest circle, from the robot's middle.

    A ray from the robot along the unit vector u meets a circle with its middle at c and radius r at
    u.c - sqrt(r^2 - (u x c)^2); from inside a circle the distance is 0.

    Args:
        place: x, y [m] and yaw [rad] of the robot.
        circles: x, y, radius [m] of each obstacle, in the same frame; a negative radius for none.
        rays: how many, evenly all around, to the left from straight ahead.
        reach: the scan sees no farther [m].

    Returns:
        Shares of ``reach``; 1 where nothing is within it.
    """
    angles = place[2] + 2 * math.pi / max(rays, 1) * jnp.arange(rays, dtype=place.dtype)
    ux, uy = jnp.cos(angles)[:, None], jnp.sin(angles)[:, None]
    x, y, radius = (circles - jnp.append(place[:2], 0.0)[None]).T[:, None]
    ahead, aside = ux * x + uy * y, ux * y - uy * x
    half = jnp.sqrt(jnp.maximum(radius**2 - aside**2, 0.0))
    hit = (radius >= 0) & (jnp.abs(aside) <= radius) & (ahead + half >= 0)
    far = jnp.where(hit, jnp.maximum(ahead - half, 0.0), reach)
    return jnp.min(far, axis=1, initial=reach) / reach
