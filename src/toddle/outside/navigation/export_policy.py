"""A policy as a file that answers without toddle: an ONNX graph, or StableHLO for `jax.export`.

The file holds the whole way from an observation to an action: the normaliser, the networks, the bound. Its input is
``observation`` (batch, numbers), as the task gives it, and for a policy that remembers ``memory`` (batch, 2, units),
zero at the start of an episode. Outputs are ``action`` (batch, size), -1 to 1 each, or (batch) whole numbers, and
``next_memory``. All of them are float32 but whole numbers, which are int32; for any batch.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import export

from toddle.failures import BadInput, MissingExtra
from toddle.navigate.policy import Policy
from toddle.navigate.ppo.network import Layers
from toddle.navigate.task import Continuous
from toddle.outside.export_jax import PLATFORMS
from toddle.outside.export_onnx import OPSET, Graph, Value
from toddle.outside.files import write_bytes
from toddle.outside.navigation.policy_files import actions_facts
from toddle.outside.versions import versions

_IR = 9  # read by every ONNX Runtime since 1.14 (2023)


def export_policy(policy: Policy, path: Path) -> None:
    """Write a policy as a file that answers without toddle; its ending says in which format.

    Args:
        policy: what was learned.
        path: ``.onnx`` for ONNX, ``.jax`` for `jax.export`.

    Raises:
        BadInput: the ending names no format, or the folder isn't there.
        MissingExtra: ONNX isn't installed.
    """
    writers = {".onnx": _onnx_bytes, ".jax": _jax_bytes}
    if path.suffix not in writers:
        found = path.suffix or "no ending"
        raise BadInput(f"{found} is no format", where=str(path), remedy="end it in .onnx or .jax")
    if not path.parent.is_dir():
        raise BadInput("its folder isn't there", where=str(path), remedy="make it, or name another")
    write_bytes(path, writers[path.suffix](policy))


def about(policy: Policy) -> dict[str, Any]:
    """What a user of the file should know."""
    return {
        "format": "toddle exported policy 1",
        "toddle": versions()["toddle"],
        "observations": policy.observations,
        "actions": actions_facts(policy.actions),
        "memory": policy.config.memory,
        "source": dict(policy.source),
        "figures": dict(policy.figures),
    }


def _jax_bytes(policy: Policy) -> bytes:
    """The policy itself, mapped over a batch."""
    (batch,) = export.symbolic_shape("batch")
    units = policy.config.memory
    seen = jax.ShapeDtypeStruct((batch, policy.observations), jnp.float32)
    known = jax.ShapeDtypeStruct((batch, 2, units), jnp.float32)

    def remembering(observation: Any, memory: Any) -> dict[str, Any]:
        action, following = jax.vmap(policy)(observation, memory)
        return {"action": action, "next_memory": following}

    def forgetful(observation: Any) -> dict[str, Any]:
        return {"action": jax.vmap(policy, in_axes=(0, None))(observation, policy.start())[0]}

    # accelerators would round the factors of products to ten bits unless told
    with jax.default_matmul_precision("highest"), jax.enable_x64(False):
        if units:
            exported = export.export(jax.jit(remembering), platforms=PLATFORMS)(seen, known)
        else:
            exported = export.export(jax.jit(forgetful), platforms=PLATFORMS)(seen)
    return bytes(replace(exported, fun_name=json.dumps(about(policy))).serialize())


def _onnx_bytes(policy: Policy) -> bytes:
    """A graph of the standard operators."""
    try:
        import onnx
    except ImportError:
        raise MissingExtra("onnx", "export", what_for="an .onnx file") from None
    make, units, graph = onnx.helper, policy.config.memory, Graph()
    outputs = _answer(policy, graph)
    for name, value in outputs.items():
        graph.scopes[-1].append(make.make_node("Identity", [value.name], [name]))
    number, whole = onnx.TensorProto.FLOAT, onnx.TensorProto.INT32
    given = [make.make_tensor_value_info("observation", number, ["batch", policy.observations])]
    size = [policy.actions.size] if isinstance(policy.actions, Continuous) else []
    found = [make.make_tensor_value_info("action", number if size else whole, ["batch", *size])]
    if units:
        given.append(make.make_tensor_value_info("memory", number, ["batch", 2, units]))
        found.append(make.make_tensor_value_info("next_memory", number, ["batch", 2, units]))
    model = make.make_model(
        make.make_graph(graph.scopes[-1], "toddle", given, found, list(graph.constants.values())),
        opset_imports=[make.make_opsetid("", OPSET)],
        ir_version=_IR,
        producer_name="toddle",
        producer_version=versions()["toddle"],
    )
    make.set_model_props(model, {key: json.dumps(value) for key, value in about(policy).items()})
    onnx.checker.check_model(model)
    return model.SerializeToString()


def _answer(policy: Policy, graph: Graph) -> dict[str, Value]:
    """`toddle.navigate.policy.Policy.__call__` in ONNX."""
    x, network = Value(graph, "observation"), policy.network
    if policy.config.normalise_observations:
        deviation = np.sqrt(np.asarray(policy.moments.variance) + np.float32(1e-8))
        x = graph.node(
            "Clip", (x - np.asarray(policy.moments.mean)) / deviation, -10.0, 10.0
        )  # see `Moments.normalised`
    answer, outputs = _layers(graph, network.actor, x)
    if not isinstance(policy.actions, Continuous):
        likeliest = graph.node("ArgMax", answer, axis=-1, keepdims=0)
        return {"action": graph.node("Cast", likeliest, to=6), **outputs}  # int32
    if policy.config.bound == "clip":
        return {"action": graph.node("Clip", answer, -1.0, 1.0), **outputs}
    return {"action": graph.node("Tanh", answer), **outputs}


def _layers(graph: Graph, layers: Layers, x: Value) -> tuple[Value, Mapping[str, Value]]:
    """`toddle.navigate.ppo.network.Layers.__call__` in ONNX."""
    squash = "Tanh" if layers.activation == "tanh" else "Relu"
    for weight, bias in zip(layers.weights[:-1], layers.biases[:-1], strict=True):
        x = graph.node(squash, _linear(graph, x, weight, bias))
    outputs = {}
    if layers.cell is not None:
        memory = Value(graph, "memory")
        before, inside = (graph.node("Gather", memory, graph.kept(np.array(part)), axis=1) for part in (0, 1))
        x, inside = lstm(graph, layers.cell, x, before, inside)
        both = [graph.node("Unsqueeze", part, graph.whole(1)) for part in (x, inside)]
        outputs["next_memory"] = graph.node("Concat", *both, axis=1)
    return _linear(graph, x, layers.weights[-1], layers.biases[-1]), outputs


def lstm(graph: Graph, cell: Any, x: Value, before: Value, inside: Value) -> tuple[Value, Value]:
    """Output and cell of an LSTM (Hochreiter and Schmidhuber 1997), its gates as Equinox has them."""
    gates = graph.node("MatMul", x, np.asarray(cell.weight_ih).T) + _linear(
        graph, before, np.asarray(cell.weight_hh).T, cell.bias
    )
    into, keep, new, out = graph.node("Split", gates, outputs=4, axis=-1, num_outputs=4)
    into, keep, out = (graph.node("Sigmoid", gate) for gate in (into, keep, out))
    inside = keep * inside + into * graph.node("Tanh", new)
    return out * graph.node("Tanh", inside), inside


def _linear(graph: Graph, x: Value, weight: Any, bias: Any) -> Value:
    return graph.node("MatMul", x, np.asarray(weight)) + np.asarray(bias)
