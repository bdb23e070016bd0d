"""What the arm has seen so far: a uniform sample of all visited positions, and the cells of space they fill.

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

CAPACITY = 4096


class Seen(NamedTuple):
    """Visited positions in the unit box.

    Attributes:
        positions: the kept ones; rows at and after `total` are not filled yet.
        total: how many positions were visited in all.
        visited: which cells of a regular grid over the unit box were entered.
    """

    positions: Float[Array, "capacity space"]
    total: Int[Array, ""]
    visited: Bool[Array, " cells"]


def cells_per_axis(space: int) -> int:
    """The grid's resolution: 40 x 40 in the plane, 16 x 16 x 16 in space."""
    return 40 if space == 2 else 16


def nothing_seen(space: int) -> Seen:
    """The record before the first movement."""
    cells = cells_per_axis(space) ** space
    return Seen(jnp.zeros((CAPACITY, space)), jnp.int32(0), jnp.zeros(cells, bool))


def cell_of(x: Float[Array, "*batch space"]) -> Int[Array, "*batch"]:
    """The flat index of the grid cell that a unit-box position lies in (edge cells take what is outside)."""
    resolution = cells_per_axis(x.shape[-1])
    index = jnp.clip(jnp.floor(x * resolution).astype(jnp.int32), 0, resolution - 1)
    strides = jnp.array([resolution**axis for axis in range(x.shape[-1])], jnp.int32)
    return index @ strides


def remember(seen: Seen, key: jax.Array, x: Float[Array, "chunk space"]) -> Seen:
    """The record after a chunk of visited positions."""
    order = seen.total + jnp.arange(len(x))
    slot = jnp.where(order < CAPACITY, order, jax.random.randint(key, (len(x),), 0, jnp.maximum(order + 1, 1)))
    positions = seen.positions.at[slot].set(x, mode="drop")
    return Seen(positions, seen.total + len(x), seen.visited.at[cell_of(x)].set(True))


def draw_seen(seen: Seen, key: jax.Array, count: int) -> Float[Array, "count space"]:
    """Positions drawn from those seen so far, with replacement; there must be at least one."""
    filled = jnp.minimum(seen.total, CAPACITY)
    return seen.positions[jax.random.randint(key, (count,), 0, jnp.maximum(filled, 1))]


def coverage(seen: Seen, reachable_cells: Bool[Array, " cells"]) -> Float[Array, ""]:
    """The share of the reachable cells that were visited, 0 to 1."""
    return jnp.sum(seen.visited & reachable_cells) / jnp.maximum(jnp.sum(reachable_cells), 1)


def kept(seen: Seen) -> Float[np.ndarray, "kept space"]:
    """The kept positions that are filled (unit box)."""
    return np.asarray(seen.positions[: min(int(seen.total), CAPACITY)])
