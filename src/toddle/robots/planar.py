"""The planar arm of the goal-babbling literature: N equal links in the plane, one metre long altogether.

Rolf (2013) uses 5, 20 and 50 joints; Mahboob (2015), appendix A, uses 5.
"""

from __future__ import annotations

import math

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from toddle.failures import BadInput
from toddle.robots.chain import Chain

MAX_JOINTS = 200


def planar(n: int, *, limit: float = math.pi / 2, length: float = 1.0) -> Chain:
    """N equal revolute links in the plane.

    Args:
        n: how many joints.
        limit: each joint turns by plus or minus this [rad].
        length: of the whole arm [m].

    Returns:
        A chain whose tip has two coordinates. Its home is an arc: the base turned by -1.1 rad and the other joints
        bent by 2.2 rad together (less where the limits are narrow), so that the tip points ahead and can move in
        every direction. Goal babbling keeps to the way of bending that its home shows: from a nearly straight home it
        is much worse.

    Raises:
        BadInput: n is not from 1 to 200, or the limit or length is not positive.
    """
    if not 1 <= n <= MAX_JOINTS:
        raise BadInput(f"N is {n}", where=f"planar:{n}", remedy=f"give from 1 to {MAX_JOINTS} joints")
    for what, value in (("limit", limit), ("length", length)):
        if not 0 < value < math.inf:
            raise BadInput(f"the {what} is {value}", where=f"planar:{n}", remedy="give a positive number")
    link = np.eye(4, dtype=np.float32)
    link[0, 3] = length / n
    before = np.broadcast_to(link, (n, 4, 4)).copy()
    before[0] = np.eye(4)
    return Chain(
        name=f"planar:{n}",
        joints=tuple(f"joint_{i + 1}" for i in range(n)),
        lower=jnp.full(n, -limit, jnp.float32),
        upper=jnp.full(n, limit, jnp.float32),
        home=_arc(n, limit),
        before=jnp.asarray(before),
        slides=jnp.zeros(n, jnp.float32),
        gain=jnp.eye(n, dtype=jnp.float32),
        offset=jnp.zeros(n, jnp.float32),
        tip=jnp.asarray(link),
        coordinates=(0, 1),
    )


def _arc(n: int, limit: float) -> Float[Array, " joints"]:
    bend = min(2.2 / max(n - 1, 1), limit / 2)
    return jnp.full(n, bend, jnp.float32).at[0].set(-min(1.1, limit / 2))
