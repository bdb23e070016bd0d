"""A network that steers by what it sees as a file that answers without toddle: an ONNX graph, or `jax.export`.

The file holds the whole way from a look to a velocity, the pictures' scale inside. Inputs: ``picture`` (batch, 60, 80,
3), bytes; ``depth`` (batch, 60, 80) [m], 0 where it is not known; ``velocity`` (batch, 2): ahead [m/s] and turning
[rad/s] that the robot walks at; ``memory``, zero at the start of an episode. Outputs: ``command`` (batch, 2), as
``velocity``, every 0.2 s; ``next_memory``. All of them are float32 but the picture; for any batch.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import export

from toddle.navigate.cloning import commands
from toddle.navigate.cloning.frames import NEAREST
from toddle.navigate.cloning.light import SQUARE, LightEyes
from toddle.navigate.cloning.policy import Cloned
from toddle.navigate.cloning.unet import UNetEyes
from toddle.navigate.sight import COLUMNS, PERIOD, ROWS
from toddle.outside.export_file import write_export
from toddle.outside.export_jax import PLATFORMS
from toddle.outside.export_onnx import Graph, Port, Value, model_bytes
from toddle.outside.navigation.export_policy import lstm
from toddle.outside.versions import versions


def export_cloned(policy: Cloned, path: Path) -> None:
    """Write a policy as a file that answers without toddle; its ending says in which format.

    Args:
        policy: what was learned.
        path: ``.onnx`` for ONNX, ``.jax`` for `jax.export`.

    Raises:
        BadInput: the ending names no format, or the folder isn't there.
        MissingExtra: ONNX isn't installed.
    """
    write_export(path, lambda: _onnx_bytes(policy), lambda: _jax_bytes(policy))


def about(policy: Cloned) -> dict[str, Any]:
    """What a user of the file should know."""
    return {
        "format": "toddle exported cloned policy 1",
        "toddle": versions()["toddle"],
        "picture": [ROWS, COLUMNS, 3],
        "memory": list(policy.start().shape),
        "period_s": PERIOD,
        "source": dict(policy.source),
        "figures": dict(policy.figures),
    }


def _jax_bytes(policy: Cloned) -> bytes:
    """The policy itself, mapped over a batch."""
    (batch,) = export.symbolic_shape("batch")
    given = [
        jax.ShapeDtypeStruct((batch, ROWS, COLUMNS, 3), jnp.uint8),
        jax.ShapeDtypeStruct((batch, ROWS, COLUMNS), jnp.float32),
        jax.ShapeDtypeStruct((batch, 2), jnp.float32),
        jax.ShapeDtypeStruct((batch, *policy.start().shape), jnp.float32),
    ]

    def answered(picture: Any, depth: Any, velocity: Any, memory: Any) -> dict[str, Any]:
        command, following = jax.vmap(policy)(picture, depth, velocity, memory)
        return {"command": command, "next_memory": following}

    # accelerators would round the factors of products to ten bits unless told
    with jax.default_matmul_precision("highest"), jax.enable_x64(False):
        exported = export.export(jax.jit(answered), platforms=PLATFORMS)(*given)
    return bytes(replace(exported, fun_name=json.dumps(about(policy))).serialize())


def _onnx_bytes(policy: Cloned) -> bytes:
    """A graph of the standard operators."""
    graph, memory = Graph(), Port(policy.start().shape)
    ports = {"command": Port((2,)), "next_memory": memory}
    given = {
        "picture": Port((ROWS, COLUMNS, 3), "uint8"),
        "depth": Port((ROWS, COLUMNS)),
        "velocity": Port((2,)),
        "memory": memory,
    }
    found = {name: (value, ports[name]) for name, value in _answer(policy, graph).items()}
    return model_bytes(graph, given, found, about(policy))


def _answer(policy: Cloned, graph: Graph) -> dict[str, Value]:
    """`toddle.navigate.cloning.policy.Cloned.__call__` in ONNX."""
    net, memory = policy.network, Value(graph, "memory")
    seen = _seen(policy, graph)
    if isinstance(net.eyes, UNetEyes):
        return _from_window(policy, graph, _unet(graph, net.eyes, seen), memory)
    felt = Value(graph, "velocity") / np.array([policy.config.ahead[1], policy.config.turning], np.float32)
    features = graph.node("Concat", _light(graph, net.eyes, seen), felt, axis=-1)
    if not policy.config.memory:
        memory = memory * 0.0
    before, inside = (_part(graph, memory, row) for row in (0, 1))
    before, inside = lstm(graph, net.cell, features, before, inside)
    both = [graph.node("Unsqueeze", part, graph.whole(1)) for part in (before, inside)]
    return {"command": _command(policy, graph, _said(policy, graph, before)), "next_memory": _joined(graph, both)}


def _seen(policy: Cloned, graph: Graph) -> Value:
    """`toddle.navigate.cloning.frames.frames`; without depth, zeros."""
    mean, deviation = (np.asarray(part) for part in policy.scale)
    colours = graph.node("Cast", Value(graph, "picture"), to=1) / 255.0
    colours = (colours - mean[:3]) / deviation[:3]
    depth = graph.node("Unsqueeze", Value(graph, "depth"), graph.whole(-1))
    known = graph.node("Cast", depth > 0.0, to=1)
    if not policy.network.depth:
        known = known * 0.0
    near = known * ((1.0 / graph.node("Max", depth, NEAREST)) - float(mean[3])) / float(deviation[3])
    parts = (colours, near) if isinstance(policy.network.eyes, UNetEyes) else (colours, near, known)
    return graph.node("Concat", *parts, axis=-1)


def _light(graph: Graph, eyes: LightEyes, x: Value) -> Value:
    """`toddle.navigate.cloning.light.LightEyes.__call__` in ONNX."""
    down, across = ROWS // SQUARE, COLUMNS // SQUARE
    parts = len(eyes.first) // SQUARE**2
    x = graph.node("Reshape", x, graph.whole(-1, down, SQUARE, across, SQUARE * parts))
    x = graph.node("Transpose", x, perm=[0, 1, 3, 2, 4])
    x = graph.node("Reshape", x, graph.whole(-1, down, across, len(eyes.first)))
    x = graph.node("Relu", graph.node("MatMul", x, np.asarray(eyes.first)) + np.asarray(eyes.biases[0]))
    x = graph.node("Transpose", x, perm=[0, 3, 1, 2])
    for kernel, bias in zip(eyes.kernels, eyes.biases[1:-1], strict=True):
        x = graph.node("Relu", _convolved(graph, x, kernel, bias, 2))
    x = graph.node("Flatten", graph.node("Transpose", x, perm=[0, 2, 3, 1]))
    return graph.node("Relu", graph.node("MatMul", x, np.asarray(eyes.last)) + np.asarray(eyes.biases[-1]))


def _unet(graph: Graph, eyes: UNetEyes, x: Value) -> Value:
    """`toddle.navigate.cloning.unet.UNetEyes.__call__` in ONNX."""
    into, down, lowest, up, top = eyes.pairs

    def pair(one: Any, x: Value) -> Value:
        for kernel, bias in zip(one.kernels, one.biases, strict=True):
            x = graph.node("Relu", _convolved(graph, x, kernel, bias, 1))
        return x

    def halved(x: Value) -> Value:
        return graph.node("MaxPool", x, kernel_shape=[2, 2], strides=[2, 2])

    def beside(fine: Value, coarse: Value) -> Value:
        twice, empty = graph.kept(np.array([1, 1, 2, 2], np.float32)), graph.kept(np.zeros(0, np.float32))
        return graph.node("Concat", fine, graph.node("Resize", coarse, empty, twice, mode="linear"), axis=1)

    fine = pair(into, graph.node("Transpose", x, perm=[0, 3, 1, 2]))
    middle = pair(down, halved(fine))
    x = pair(up, beside(middle, pair(lowest, halved(middle))))
    x = graph.node("Tanh", _convolved(graph, pair(top, beside(fine, x)), eyes.out, eyes.biases[0], 1))
    x = graph.node("Flatten", graph.node("Transpose", x, perm=[0, 2, 3, 1]))
    for weight, bias in zip(eyes.weights, eyes.biases[1:], strict=True):
        x = graph.node("Relu", graph.node("MatMul", x, np.asarray(weight)) + np.asarray(bias))
    return x


def _from_window(policy: Cloned, graph: Graph, features: Value, memory: Value) -> dict[str, Value]:
    """`toddle.navigate.cloning.policy.Cloned._from_window` in ONNX."""
    rows = memory.graph
    steps, units = policy.config.steps, policy.config.units
    filled = graph.node("Concat", features, _part(graph, features * 0.0 + 1.0, 0, keep=True), axis=-1)
    older = graph.node("Slice", memory, rows.whole(1), rows.whole(steps), rows.whole(1))
    window = _joined(graph, [older, graph.node("Unsqueeze", filled, graph.whole(1))])
    output = inside = _part(graph, features, 0, keep=True) * np.zeros((1, units), np.float32)
    known: Any = 0.0
    for step in range(steps):
        row = _part(graph, window, step)
        last = row.graph.whole(-1)
        here = graph.node("Slice", row, last, graph.whole(2**31), last)
        seen = graph.node("Slice", row, graph.whole(0), last, last)
        follows = known * here if policy.config.memory else here * 0.0
        output, inside = lstm(graph, policy.network.cell, seen, output * follows, inside * follows)
        known = here
    return {"command": _command(policy, graph, _said(policy, graph, output)), "next_memory": window}


def _said(policy: Cloned, graph: Graph, remembered: Value) -> Value:
    return graph.node("MatMul", remembered, np.asarray(policy.network.steer)) + np.asarray(policy.network.bias[0])


def _command(policy: Cloned, graph: Graph, said: Value) -> Value:
    """`toddle.navigate.cloning.network.velocity` in ONNX."""
    config = policy.config
    if config.network == "document":
        return graph.node("Tanh", said) * np.array([config.ahead[1], config.turning], np.float32)
    ahead, turning = (np.asarray(one) for one in commands.levels(config))
    first, second = graph.node("Split", said, graph.whole(len(ahead), len(turning)), outputs=2, axis=-1)
    best = graph.node("ArgMax", second, axis=-1, keepdims=1)
    away = graph.node("Abs", graph.node("Cast", best, to=1) - np.arange(len(turning), dtype=np.float32))
    second = graph.node("Where", away > 1.5, -1e9, second)
    both = [
        graph.node("MatMul", graph.node("Softmax", logits, axis=-1), levels[:, None])
        for logits, levels in ((first, ahead), (second, turning))
    ]
    return graph.node("Concat", *both, axis=-1)


def _convolved(graph: Graph, x: Value, kernel: Any, bias: Any, stride: int) -> Value:
    shape = {"strides": [stride, stride], "auto_pad": "SAME_UPPER"}
    return graph.node("Conv", x, np.asarray(kernel).transpose(3, 2, 0, 1), np.asarray(bias), **shape)


def _part(graph: Graph, x: Value, place: int, *, keep: bool = False) -> Value:
    """One place of the axis behind the batch."""
    return graph.node("Gather", x, graph.kept(np.array([place] if keep else place)), axis=1)


def _joined(graph: Graph, parts: list[Value]) -> Value:
    return graph.node("Concat", *parts, axis=1)
