"""Answers as an ONNX file, built node by node: float32, any batch, the standard operators alone.

The facts about the skill (joints, limits, units, expected error) are the model's metadata, each as JSON.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from toddle.failures import MissingExtra
from toddle.outside.export_ops import State, Tensor

_OPSET, _IR = 18, 9  # read by every ONNX Runtime since 1.14 (2023)
_FLOAT, _INT64, _BOOL = 1, 7, 9  # TensorProto.DataType


def _onnx() -> Any:
    try:
        import onnx
    except ImportError:
        raise MissingExtra("onnx", "export", what_for="an .onnx file") from None
    return onnx


@dataclass(frozen=True, eq=False)
class Value:
    """An array of the graph, by name."""

    graph: Graph
    name: str
    __array_ufunc__ = None

    def __add__(self, other: Any) -> Value:
        return self.graph.node("Add", self, other)

    def __radd__(self, other: Any) -> Value:
        return self.graph.node("Add", other, self)

    def __sub__(self, other: Any) -> Value:
        return self.graph.node("Sub", self, other)

    def __rsub__(self, other: Any) -> Value:
        return self.graph.node("Sub", other, self)

    def __mul__(self, other: Any) -> Value:
        return self.graph.node("Mul", self, other)

    def __rmul__(self, other: Any) -> Value:
        return self.graph.node("Mul", other, self)

    def __truediv__(self, other: Any) -> Value:
        return self.graph.node("Div", self, other)

    def __rtruediv__(self, other: Any) -> Value:
        return self.graph.node("Div", other, self)

    def __neg__(self) -> Value:
        return self.graph.node("Neg", self)

    def __lt__(self, other: Any) -> Value:
        return self.graph.node("Less", self, other)

    def __le__(self, other: Any) -> Value:
        return self.graph.node("LessOrEqual", self, other)

    def __gt__(self, other: Any) -> Value:
        return self.graph.node("Greater", self, other)

    def __and__(self, other: Any) -> Value:
        return self.graph.node("And", self, other)

    def __invert__(self) -> Value:
        return self.graph.node("Not", self)


@dataclass(frozen=True)
class Graph:
    """`toddle.outside.export_ops.Ops` that write themselves down as they are called.

    Attributes:
        scopes: nodes of the graph, and of the loop bodies that are being written within it.
        constants: by type, shape and bytes.
    """

    scopes: list[list[Any]] = field(default_factory=lambda: [[]])
    constants: dict[tuple[str, tuple[int, ...], bytes], Any] = field(default_factory=dict)
    names: list[None] = field(default_factory=list)

    def fresh(self) -> Value:
        """A value that has no name yet."""
        self.names.append(None)
        return Value(self, f"v{len(self.names)}")

    def node(self, kind: str, *inputs: Any, outputs: int = 1, **attributes: Any) -> Any:
        """What an operator of ONNX makes of values and numbers; several outputs as a tuple."""
        given = [part if isinstance(part, Value) else self.constant(part) for part in inputs]
        made = tuple(self.fresh() for _ in range(outputs))
        names = [value.name for value in given], [value.name for value in made]
        self.scopes[-1].append(_onnx().helper.make_node(kind, *names, **attributes))
        return made if outputs > 1 else made[0]

    def constant(self, value: np.ndarray | float) -> Value:
        """Numbers, in float32."""
        return self.kept(np.asarray(value, np.float32))

    def whole(self, *numbers: int) -> Value:
        """Places and lengths."""
        return self.kept(np.array(numbers, np.int64))

    def kept(self, array: np.ndarray) -> Value:
        """An array in the file, once however often it is used."""
        key = str(array.dtype), array.shape, array.tobytes()
        if key not in self.constants:
            self.constants[key] = _onnx().numpy_helper.from_array(array, f"c{len(self.constants)}")
        return Value(self, self.constants[key].name)

    def cos(self, x: Tensor) -> Tensor:
        """Cosine."""
        return self.node("Cos", x)

    def sin(self, x: Tensor) -> Tensor:
        """Sine."""
        return self.node("Sin", x)

    def atan(self, x: Tensor) -> Tensor:
        """Arc tangent."""
        return self.node("Atan", x)

    def sqrt(self, x: Tensor) -> Tensor:
        """Root."""
        return self.node("Sqrt", x)

    def minimum(self, x: Tensor, y: Tensor) -> Tensor:
        """The lesser of each two."""
        return self.node("Min", x, y)

    def maximum(self, x: Tensor, y: Tensor) -> Tensor:
        """The greater of each two."""
        return self.node("Max", x, y)

    def where(self, mask: Tensor, x: Tensor, y: Tensor) -> Tensor:
        """``x`` where the mask is true."""
        return self.node("Where", mask, x, y)

    def matmul(self, x: Tensor, y: Tensor) -> Tensor:
        """Matrix products."""
        return self.node("MatMul", x, y)

    def turned(self, x: Tensor) -> Tensor:
        """The last two of four axes exchanged."""
        return self.node("Transpose", x, perm=[0, 1, 3, 2])

    def sum(self, x: Tensor, axis: int) -> Tensor:
        """Sums along an axis."""
        return self.node("ReduceSum", x, self.whole(axis), keepdims=1)

    def least(self, x: Tensor, axis: int) -> Tensor:
        """Least numbers along an axis."""
        return self.node("ReduceMin", x, self.whole(axis), keepdims=1)

    def greatest(self, x: Tensor, axis: int) -> Tensor:
        """Greatest numbers along an axis."""
        return self.node("ReduceMax", x, self.whole(axis), keepdims=1)

    def take(self, x: Tensor, places: Sequence[int], axis: int) -> Tensor:
        """Some places along an axis."""
        return self.node("Gather", x, self.whole(*places), axis=axis)

    def at(self, x: Tensor, place: Tensor, axis: int) -> Tensor:
        """One place along an axis."""
        return self.node("Gather", x, place, axis=axis)

    def join(self, parts: Sequence[Tensor], axis: int) -> Tensor:
        """Arrays put together along an axis."""
        return self.node("Concat", *parts, axis=axis)

    def shape(self, x: Tensor, lengths: Sequence[int]) -> Tensor:
        """The same numbers in another shape behind the batch."""
        return self.node("Reshape", x, self.whole(0, *lengths))

    def rows(self, table: np.ndarray, cost: Tensor, count: int) -> Tensor:
        """Rows of least cost."""
        _, places = self.node("TopK", cost, self.whole(count), axis=-1, largest=0, sorted=1, outputs=2)
        return self.node("Gather", self.constant(table), places, axis=0)

    def first_least(self, x: Tensor, count: int, axis: int) -> Tensor:
        """1.0 at the first of the least numbers along an axis."""
        place = self.node("ArgMin", x, axis=axis, keepdims=0)
        return self.node("OneHot", place, self.whole(count), np.array([0.0, 1.0]), axis=axis)

    def repeat(self, count: int, step: Callable[[Tensor, State], tuple[State, Tensor]], state: State) -> State:
        """Go on stepping until nothing is left to do, as a Loop."""
        make = _onnx().helper
        number, going, *carried = (self.fresh() for _ in range(2 + len(state)))
        self.scopes.append([])
        now, left = step(number, tuple(carried))
        some = self.node("ReduceSum", self.node("Cast", left, to=_FLOAT), keepdims=0) > 0.0
        # outputs must be made in the body, each under a name of its own
        ends = [self.node("Identity", value) for value in (some, *now)]
        inside = [make.make_tensor_value_info(v.name, _FLOAT, None) for v in (*carried, *ends[1:])]
        body = make.make_graph(
            self.scopes.pop(),
            "step",
            [_scalar(number, _INT64), _scalar(going, _BOOL), *inside[: len(carried)]],
            [_scalar(ends[0], _BOOL), *inside[len(carried) :]],
        )
        found = self.node("Loop", self.whole(count), self.kept(np.array(True)), *state, outputs=len(state), body=body)
        return found if len(state) > 1 else (found,)


def _scalar(value: Value, kind: int) -> Any:
    return _onnx().helper.make_tensor_value_info(value.name, kind, [])


class Port(NamedTuple):
    """An input or an output of a file.

    Attributes:
        shape: behind the batch.
        dtype: of its numbers.
    """

    shape: tuple[int, ...]
    dtype: str = "float32"


def onnx_bytes(
    answer: Callable[..., dict[str, Tensor]], inputs: Mapping[str, int], about: Mapping[str, object]
) -> bytes:
    """The content of a skill's file.

    Args:
        answer: from operations and the inputs to the outputs by name; the last axis of each but ``joints`` has gone.
        inputs: how many numbers each has, beside the batch.
        about: facts about the skill.

    Raises:
        MissingExtra: ONNX isn't installed.
    """
    graph = Graph()
    outputs = answer(graph, *(Value(graph, name) for name in inputs))
    joints = len(about["joints"])  # pyright: ignore[reportArgumentType]
    given = {name: Port((count,)) for name, count in inputs.items()}
    found = {name: (value, Port((joints,) if name == "joints" else ())) for name, value in outputs.items()}
    return model_bytes(graph, given, found, about)


def model_bytes(
    graph: Graph, inputs: Mapping[str, Port], outputs: Mapping[str, tuple[Value, Port]], about: Mapping[str, object]
) -> bytes:
    """A file's content.

    Args:
        graph: that leads from the inputs, by their names, to the outputs.
        inputs: for any batch.
        outputs: likewise.
        about: facts, kept in the file; ``toddle`` is the version.

    Raises:
        MissingExtra: ONNX isn't installed.
    """
    onnx = _onnx()
    make = onnx.helper
    for name, (value, _) in outputs.items():
        graph.scopes[-1].append(make.make_node("Identity", [value.name], [name]))

    def told(name: str, port: Port) -> Any:
        kind = make.np_dtype_to_tensor_dtype(np.dtype(port.dtype))
        return make.make_tensor_value_info(name, kind, ["batch", *port.shape])

    model = make.make_model(
        make.make_graph(
            graph.scopes[-1],
            "toddle",
            [told(name, port) for name, port in inputs.items()],
            [told(name, port) for name, (_, port) in outputs.items()],
            list(graph.constants.values()),
        ),
        opset_imports=[make.make_opsetid("", _OPSET)],
        ir_version=_IR,
        producer_name="toddle",
        producer_version=str(about["toddle"]),
    )
    make.set_model_props(model, {key: json.dumps(value) for key, value in about.items()})
    onnx.checker.check_model(model)
    return model.SerializeToString()
