"""Starting from what was experienced: the remembered movement that came closest, and the slope of its neighbours.

A learned inverse answers with one posture for each place, and is worst where it was last or seldom. The movements
themselves are not forgotten: the one that came closest to the target is a start whose outcome is known without moving,
and the remembered movements around it in joint space tell how the tip moves there, whatever the learner.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

_NEIGHBOURS = 40
_NEAR = 0.02  # of a joint's range: neighbours closer than this count alike
_RIDGE, _DAMPING = 1e-3, 1e-4


class Memory(NamedTuple):
    """Remembered movements: joint values and where they brought the tip (unit box)."""

    q: Float[Array, "movements joints"]
    x: Float[Array, "movements space"]


class Start(NamedTuple):
    """Where to correct from: joint values, where the tip is with them, and how the joints move it."""

    q: Float[Array, "points joints"]
    x: Float[Array, "points space"]
    slope: Float[Array, "points joints space"]


@jax.jit
def recall(
    memory: Memory,
    q: Float[Array, "points joints"],
    x: Float[Array, "points space"],
    targets: Float[Array, "points space"],
    edges: Float[Array, "points space"],
) -> Start:
    """For each target the better of a first answer and of what is remembered.

    Args:
        memory: the remembered movements, at least one.
        q, x: the first answers, and where they brought the tip.
        targets: where it should be.
        edges: lengths of the box's edges [m], so that distances are those of space.
    """

    def one(answered: tuple[Array, Array, Array, Array]) -> Start:
        first_q, first_x, target, edge = answered
        missed = jnp.sum(((memory.x - target[None]) * edge[None]) ** 2, axis=1)
        nearest = jnp.argmin(missed)
        better = missed[nearest] < jnp.sum(((first_x - target) * edge) ** 2)
        start_q = jnp.where(better, memory.q[nearest], first_q)
        start_x = jnp.where(better, memory.x[nearest], first_x)
        return Start(start_q, start_x, _slope(memory, start_q, start_x))

    return jax.lax.map(one, (q, x, targets, edges), batch_size=min(64, len(targets)))


def _slope(memory: Memory, q: Float[Array, " joints"], x: Float[Array, " space"]) -> Float[Array, "joints space"]:
    """The damped inverse of dx/dq at a posture, by weighted ridge regression over its neighbours in joint space."""
    count = min(_NEIGHBOURS, len(memory.q))
    distance = jnp.linalg.norm(memory.q - q[None], axis=1)
    near = jax.lax.top_k(-distance, count)[1]
    weight = 1.0 / (distance[near] + _NEAR)
    moved = (memory.q[near] - q[None]) * weight[:, None]
    led = (memory.x[near] - x[None]) * weight[:, None]
    normal = moved.T @ moved
    ridge = (_RIDGE * jnp.trace(normal) / len(q) + 1e-12) * jnp.eye(len(q))
    forward = jnp.linalg.solve(normal + ridge, moved.T @ led).T
    return forward.T @ jnp.linalg.inv(forward @ forward.T + _DAMPING * jnp.eye(len(x)))
