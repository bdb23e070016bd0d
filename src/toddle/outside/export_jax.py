"""Answers as a `jax.export` file: serialised StableHLO that `jax.export.deserialize` reads, for any batch.

The facts about the skill (joints, limits, units, expected error) are JSON in `jax.export.Exported.fun_name`, the one
place of the format that carries words.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import export, lax

from toddle.outside.export_ops import Ops, State, Tensor

PLATFORMS = "cpu", "cuda", "tpu"


class JaxOps:
    """`toddle.outside.export_ops.Ops` in JAX."""

    def constant(self, value: np.ndarray | float) -> Tensor:
        """Numbers, in float32."""
        return jnp.asarray(value, jnp.float32)

    def cos(self, x: Tensor) -> Tensor:
        """Cosine."""
        return jnp.cos(x)

    def sin(self, x: Tensor) -> Tensor:
        """Sine."""
        return jnp.sin(x)

    def atan(self, x: Tensor) -> Tensor:
        """Arc tangent."""
        return jnp.arctan(x)

    def sqrt(self, x: Tensor) -> Tensor:
        """Root."""
        return jnp.sqrt(x)

    def minimum(self, x: Tensor, y: Tensor) -> Tensor:
        """The lesser of each two."""
        return jnp.minimum(x, y)

    def maximum(self, x: Tensor, y: Tensor) -> Tensor:
        """The greater of each two."""
        return jnp.maximum(x, y)

    def where(self, mask: Tensor, x: Tensor, y: Tensor) -> Tensor:
        """``x`` where the mask is true."""
        return jnp.where(mask, x, y)

    def matmul(self, x: Tensor, y: Tensor) -> Tensor:
        """Matrix products; accelerators would round their factors to ten bits unless told."""
        return jnp.matmul(x, y, precision=lax.Precision.HIGHEST)

    def turned(self, x: Tensor) -> Tensor:
        """The last two axes exchanged."""
        return jnp.swapaxes(x, -1, -2)

    def sum(self, x: Tensor, axis: int) -> Tensor:
        """Sums along an axis."""
        return jnp.sum(x, axis=axis, keepdims=True)

    def least(self, x: Tensor, axis: int) -> Tensor:
        """Least numbers along an axis."""
        return jnp.min(x, axis=axis, keepdims=True)

    def greatest(self, x: Tensor, axis: int) -> Tensor:
        """Greatest numbers along an axis."""
        return jnp.max(x, axis=axis, keepdims=True)

    def take(self, x: Tensor, places: Sequence[int], axis: int) -> Tensor:
        """Some places along an axis; neighbours as a slice, which is quicker."""
        first = places[0]
        if list(places) == list(range(first, first + len(places))):
            return lax.slice_in_dim(x, first, first + len(places), axis=axis % x.ndim)
        return jnp.concatenate([lax.slice_in_dim(x, i, i + 1, axis=axis % x.ndim) for i in places], axis)

    def at(self, x: Tensor, place: Tensor, axis: int) -> Tensor:
        """One place along an axis."""
        return lax.dynamic_index_in_dim(x, place, axis, keepdims=False)

    def join(self, parts: Sequence[Tensor], axis: int) -> Tensor:
        """Arrays put together along an axis."""
        return jnp.concatenate(parts, axis)

    def shape(self, x: Tensor, lengths: Sequence[int]) -> Tensor:
        """The same numbers in another shape behind the batch."""
        return jnp.reshape(x, (x.shape[0], *lengths))

    def rows(self, table: np.ndarray, cost: Tensor, count: int) -> Tensor:
        """Rows of least cost."""
        return self.constant(table)[lax.top_k(-cost, count)[1]]

    def first_least(self, x: Tensor, count: int, axis: int) -> Tensor:
        """1.0 at the first of the least numbers along an axis."""
        return jax.nn.one_hot(jnp.argmin(x, axis=axis), count, axis=axis, dtype=jnp.float32)

    def repeat(self, count: int, step: Callable[[Tensor, State], tuple[State, Tensor]], state: State) -> State:
        """Go on stepping until nothing is left to do."""

        def following(carry: tuple) -> tuple:
            now, left = step(carry[0], carry[2])
            return carry[0] + 1, jnp.any(left), now

        start = jnp.zeros((), jnp.int32), jnp.ones((), bool), state
        return lax.while_loop(lambda carry: carry[1] & (carry[0] < count), following, start)[2]


def jax_bytes(
    answer: Callable[..., dict[str, Tensor]], inputs: Mapping[str, int], about: Mapping[str, object]
) -> bytes:
    """The file's content.

    Args:
        answer: from operations and the inputs to the outputs by name.
        inputs: how many numbers each has, beside the batch.
        about: facts about the skill.
    """
    ops: Ops = JaxOps()
    (batch,) = export.symbolic_shape("batch")
    specs = [jax.ShapeDtypeStruct((batch, count), jnp.float32) for count in inputs.values()]

    def answered(*given: Any) -> dict[str, Tensor]:
        return answer(ops, *given)

    with jax.numpy_rank_promotion("allow"), jax.numpy_dtype_promotion("standard"), jax.enable_x64(False):
        exported = export.export(jax.jit(answered), platforms=PLATFORMS)(*specs)
    return bytes(replace(exported, fun_name=json.dumps(about)).serialize())
