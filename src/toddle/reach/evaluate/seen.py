"""What the arm has seen so far: a uniform sample of all its movements, and the cells of space they filled.

The thesis draws its "seen test set" from the positions visited so far (Mahboob 2015, section 4.3); keeping all of them
would grow without end, so a fixed number is kept, each visited position with equal chance (reservoir sampling,
Vitter's algorithm R).
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

CAPACITY = 8192


class Seen(NamedTuple):
    """Movements made, in the unit box.

    Attributes:
        postures: the joint values of the kept ones.
        positions: where they brought the tip; rows of both at and after `total` are not filled yet.
        total: how many positions were visited in all.
        visited: which cells of a regular grid over the unit box were entered.
    """

    postures: Float[Array, "capacity joints"]
    positions: Float[Array, "capacity space"]
    total: Int[Array, ""]
    visited: Bool[Array, " cells"]


def cells_per_axis(space: int) -> int:
    """The grid's resolution: 40 x 40 in the plane, 16 x 16 x 16 in space."""
    return 40 if space == 2 else 16


def nothing_seen(joints: int, space: int) -> Seen:
    """The record before the first movement."""
    cells = cells_per_axis(space) ** space
    return Seen(jnp.zeros((CAPACITY, joints)), jnp.zeros((CAPACITY, space)), jnp.int32(0), jnp.zeros(cells, bool))


def cell_of(x: Float[Array, "*batch space"]) -> Int[Array, "*batch"]:
    """The flat index of the grid cell that a unit-box position lies in (edge cells take what is outside)."""
    resolution = cells_per_axis(x.shape[-1])
    index = jnp.clip(jnp.floor(x * resolution).astype(jnp.int32), 0, resolution - 1)
    strides = jnp.array([resolution**axis for axis in range(x.shape[-1])], jnp.int32)
    return index @ strides


def remember(seen: Seen, key: jax.Array, q: Float[Array, "chunk joints"], x: Float[Array, "chunk space"]) -> Seen:
    """The record after a chunk of movements."""
    order = seen.total + jnp.arange(len(x))
    slot = jnp.where(order < CAPACITY, order, jax.random.randint(key, (len(x),), 0, jnp.maximum(order + 1, 1)))
    # of two movements for one slot the later one stays, on every device
    latest = jnp.full(CAPACITY, -1).at[slot].max(jnp.arange(len(x)), mode="drop")
    stays = (latest < 0)[:, None]
    return Seen(
        jnp.where(stays, seen.postures, q[latest]),
        jnp.where(stays, seen.positions, x[latest]),
        seen.total + len(x),
        seen.visited.at[cell_of(x)].set(True),
    )


def draw_seen(seen: Seen, key: jax.Array, count: int) -> Float[Array, "count space"]:
    """Positions drawn from those seen so far, with replacement; there must be at least one."""
    filled = jnp.minimum(seen.total, CAPACITY)
    return seen.positions[jax.random.randint(key, (count,), 0, jnp.maximum(filled, 1))]


def coverage(seen: Seen, reachable_cells: Bool[Array, " cells"]) -> Float[Array, ""]:
    """The share of the reachable cells that were visited, 0 to 1."""
    return jnp.sum(seen.visited & reachable_cells) / jnp.maximum(jnp.sum(reachable_cells), 1)


def kept(seen: Seen) -> tuple[Float[np.ndarray, "kept joints"], Float[np.ndarray, "kept space"]]:
    """The kept postures and positions that are filled (unit box)."""
    filled = min(int(seen.total), CAPACITY)
    return np.asarray(seen.postures)[:filled], np.asarray(seen.positions)[:filled]
