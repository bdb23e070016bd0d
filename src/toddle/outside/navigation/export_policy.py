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

from toddle.navigate.policy import Policy
from toddle.navigate.ppo.network import Layers
from toddle.navigate.task import Continuous
from toddle.outside.export_file import write_export
from toddle.outside.export_jax import PLATFORMS
from toddle.outside.export_onnx import Graph, Port, Value, model_bytes
from toddle.outside.navigation.policy_files import actions_facts
from toddle.outside.versions import versions


def export_policy(policy: Policy, path: Path) -> None:
    """Write a policy as a file that answers without toddle; its ending says in which format.

    Args:
        policy: what was learned.
        path: ``.onnx`` for ONNX, ``.jax`` for `jax.export`.

    Raises:
        BadInput: the ending names no format, or the folder isn't there.
        MissingExtra: ONNX isn't installed.
    """
    write_export(path, lambda: _onnx_bytes(policy), lambda: _jax_bytes(policy))


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
    units, graph = policy.config.memory, Graph()
    outputs, memory = _answer(policy, graph), Port((2, units))
    action = Port((policy.actions.size,)) if isinstance(policy.actions, Continuous) else Port((), "int32")
    ports = {"action": action, "next_memory": memory}
    given = {"observation": Port((policy.observations,))} | ({"memory": memory} if units else {})
    found = {name: (value, ports[name]) for name, value in outputs.items()}
    return model_bytes(graph, given, found, about(policy))


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
