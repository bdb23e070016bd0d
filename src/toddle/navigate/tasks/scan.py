"""A range scan: how far it is to the nearest upright cylinder along beams around the robot, exactly.

The scan goes all around, the first ray ahead: the robot also walks backwards and aside, and people come from behind.
Each ray is the nearest of a few beams side by side, so that a thin cylinder far away does not slip between two rays.
"""

from __future__ import annotations

import math

import jax.numpy as jnp
from jaxtyping import Array, Float

BEAMS = 3
"""Of one ray, spread evenly over its sector; the middle one along it."""


def scan(
    place: Float[Array, "3"], circles: Float[Array, "circles 3"], rays: int, reach: float, beams: int = BEAMS
) -> Float[Array, " {rays}"]:
    """Distances to the nearest circle, from the robot's middle.

    A beam from the robot along the unit vector u meets a circle with its middle at c and radius r at
    u.c - sqrt(r^2 - (u x c)^2); from inside a circle the distance is 0.

    Args:
        place: x, y [m] and yaw [rad] of the robot.
        circles: x, y, radius [m] of each obstacle, in the same frame; a negative radius for none.
        rays: how many, evenly all around, to the left from straight ahead.
        reach: the scan sees no farther [m].
        beams: of each ray, an odd number; the nearest counts.

    Returns:
        Shares of ``reach``; 1 where nothing is within it.
    """
    numbers = jnp.arange(rays * beams, dtype=place.dtype) - beams // 2
    angles = place[2] + 2 * math.pi / max(rays * beams, 1) * numbers
    ux, uy = jnp.cos(angles)[:, None], jnp.sin(angles)[:, None]
    x, y, radius = (circles - jnp.append(place[:2], 0.0)[None]).T[:, None]
    ahead, aside = ux * x + uy * y, ux * y - uy * x
    half = jnp.sqrt(jnp.maximum(radius**2 - aside**2, 0.0))
    hit = (radius >= 0) & (jnp.abs(aside) <= radius) & (ahead + half >= 0)
    far = jnp.where(hit, jnp.maximum(ahead - half, 0.0), reach)
    return jnp.min(far.reshape(rays, beams, len(circles)), axis=(1, 2), initial=reach) / reach
