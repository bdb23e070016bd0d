"""The few operations on arrays that exported answers are made of: what JAX and ONNX both can do.

What is exported is written once, against these; `toddle.outside.export_jax` traces it by JAX,
`toddle.outside.export_onnx` builds a graph of it. Arrays are float32 of fixed rank and any batch; they broadcast by
NumPy's rules and understand ``+ - * /``, comparisons, ``&`` and ``~``. Axes count from the end.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np

Tensor = Any  # a jax.Array, or a value of an ONNX graph
State = tuple[Tensor, ...]


@runtime_checkable
class Ops(Protocol):
    """A namespace of operations."""

    def constant(self, value: np.ndarray | float) -> Tensor:
        """Numbers, in float32."""
        ...

    def cos(self, x: Tensor) -> Tensor:
        """Cosine of each number [rad]."""
        ...

    def sin(self, x: Tensor) -> Tensor:
        """Sine of each number [rad]."""
        ...

    def atan(self, x: Tensor) -> Tensor:
        """Arc tangent of each number [rad]."""
        ...

    def sqrt(self, x: Tensor) -> Tensor:
        """Root of each number."""
        ...

    def minimum(self, x: Tensor, y: Tensor) -> Tensor:
        """The lesser of each two numbers."""
        ...

    def maximum(self, x: Tensor, y: Tensor) -> Tensor:
        """The greater of each two numbers."""
        ...

    def where(self, mask: Tensor, x: Tensor, y: Tensor) -> Tensor:
        """``x`` where the mask is true, else ``y``."""
        ...

    def matmul(self, x: Tensor, y: Tensor) -> Tensor:
        """Matrix products over the last two axes, in full float32."""
        ...

    def turned(self, x: Tensor) -> Tensor:
        """The last two axes exchanged, of four."""
        ...

    def sum(self, x: Tensor, axis: int) -> Tensor:
        """Sums along an axis, which stays with length one."""
        ...

    def least(self, x: Tensor, axis: int) -> Tensor:
        """Least numbers along an axis, which stays with length one."""
        ...

    def greatest(self, x: Tensor, axis: int) -> Tensor:
        """Greatest numbers along an axis, which stays with length one."""
        ...

    def take(self, x: Tensor, places: Sequence[int], axis: int) -> Tensor:
        """Some places along an axis."""
        ...

    def at(self, x: Tensor, place: Tensor, axis: int) -> Tensor:
        """One place along an axis, known only when it runs; the axis goes."""
        ...

    def join(self, parts: Sequence[Tensor], axis: int) -> Tensor:
        """Arrays put together along an axis."""
        ...

    def shape(self, x: Tensor, lengths: Sequence[int]) -> Tensor:
        """The same numbers in another shape behind the batch, which is the first axis."""
        ...

    def rows(self, table: np.ndarray, cost: Tensor, count: int) -> Tensor:
        """(batch, count, columns) rows of a table, those of least cost (batch, rows) first."""
        ...

    def first_least(self, x: Tensor, count: int, axis: int) -> Tensor:
        """1.0 at the first of the least of so many numbers along an axis, 0.0 elsewhere."""
        ...

    def repeat(self, count: int, step: Callable[[Tensor, State], tuple[State, Tensor]], state: State) -> State:
        """Go on stepping until nothing is left to do.

        Args:
            count: steps at most.
            step: from the step's number and the state to the next state, and a mask of what is left to do.
            state: where to start from.
        """
        ...
