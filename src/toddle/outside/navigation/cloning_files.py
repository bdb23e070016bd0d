"""Networks that learned by watching on disk: the finished ones, and runs that can go on bit for bit.

A policy is a pair ``policy.json`` + ``policy.safetensors``. A run keeps two checkpoints in turn, each with a count; the
newest whole one is taken up, so that whatever is cut off while it is written costs nothing but what came since.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_type_hints

import jax
import numpy as np

from toddle.failures import BadInput
from toddle.navigate.cloning.config import CloningConfig
from toddle.navigate.cloning.network import network
from toddle.navigate.cloning.policy import Cloned
from toddle.navigate.cloning.training import Training, blank
from toddle.outside.files import make_folder, read_record, write_record
from toddle.outside.navigation.policy_files import filled, flat, flat_names, is_a

KIND = "cloned"
_RUN, _NAMES = "cloning run", ("checkpoint-a", "checkpoint-b")
_AGAIN = "learn it again"
_UNLIKE = (LookupError, TypeError, ValueError, AttributeError, OverflowError, BadInput)


def save_cloned(policy: Cloned, folder: str | os.PathLike[str]) -> Path:
    """Save a policy; returns the folder.

    Raises:
        BadInput: the folder can't be made, or a weight is not finite; nothing is written then.
    """
    tensors = flat("network", policy.network) | flat("scale", policy.scale)
    if wrong := _not_finite(tensors):
        raise BadInput(f"the policy is broken ({wrong} is not finite)", where=str(folder), remedy=_AGAIN)
    path = make_folder(Path(folder))
    facts = {
        "config": dataclasses.asdict(policy.config),
        "source": dict(policy.source),
        "figures": dict(policy.figures),
    }
    write_record(path, "policy", KIND, facts, tensors)
    return path


def load_cloned(folder: str | os.PathLike[str]) -> Cloned:
    """Load a saved policy; it steers as it did before, bit for bit.

    Raises:
        BadInput: there is none, or it is truncated, altered, not finite, or not a policy.
    """
    path = Path(folder)
    facts, tensors = read_record(path, "policy", KIND)
    try:
        config = _config_from(facts["config"])
        shapes = jax.eval_shape(lambda: (network(config, jax.random.key(0)), blank(config).scale))
        net, scale = filled("network", shapes[0], tensors), filled("scale", shapes[1], tensors)
        wanted = flat_names("network", shapes[0]) | flat_names("scale", shapes[1])
        if more := sorted(set(tensors) - wanted):
            raise ValueError(f"{more[0]} belongs to no policy like this")
        if wrong := _not_finite(tensors):
            raise ValueError(f"{wrong} is not finite")
        if float(np.min(tensors["scale.deviation"])) <= 0:
            raise ValueError("a deviation is not positive")
        return Cloned(net, scale, config, dict(facts["source"]), dict(facts["figures"]))
    except _UNLIKE as fault:
        raise BadInput(f"it is not a policy of this version ({fault})", where=str(path), remedy=_AGAIN) from fault


@dataclass(frozen=True, eq=False)
class Saved:
    """A run as it was saved.

    Attributes:
        config: how it learns.
        training: where it is.
        best: the network and scale that did best so far; None: none was judged.
        history: its course: columns of numbers by name.
        facts: plain values of whoever runs it.
    """

    config: CloningConfig
    training: Training
    best: Training | None
    history: Mapping[str, np.ndarray]
    facts: Mapping[str, Any]


def save_run(folder: Path, saved: Saved, count: int) -> None:
    """Save a run so that it can go on bit for bit.

    Args:
        folder: of the run.
        saved: all that it needs.
        count: of this checkpoint, greater than those before.
    """
    facts = {
        "count": count,
        "config": dataclasses.asdict(saved.config),
        "best": saved.best is not None,
        "facts": dict(saved.facts),
    }
    tensors = flat("training", saved.training) | {f"history.{name}": rows for name, rows in saved.history.items()}
    if saved.best is not None:
        tensors |= flat("best", saved.best)
    write_record(make_folder(folder), _NAMES[count % 2], _RUN, facts, tensors)


def load_run(folder: Path) -> tuple[Saved, int]:
    """Take up a saved run: the newest checkpoint that is whole, and its count.

    Raises:
        BadInput: there is none, or it is not a run of this version.
    """
    found, faults = [], []
    for name in _NAMES:
        if not (folder / f"{name}.json").exists():
            continue
        try:
            found.append(read_record(folder, name, _RUN))
        except BadInput as fault:
            faults.append(fault)
    if not found:
        raise faults[0] if faults else BadInput("there is no run here", where=str(folder), remedy="name one's folder")
    facts, tensors = max(found, key=lambda one: int(one[0].get("count", -1)))
    try:
        config = _config_from(facts["config"])
        template = jax.eval_shape(lambda: blank(config))
        streams = tensors["training.order.episode"], tensors["training.order.at"]
        order = template.order._replace(episode=streams[0], at=streams[1])
        order = jax.tree.map(np.asarray, order._replace(seed=np.array(0), epoch=np.array(0), taken=np.array(0)))
        template = template._replace(order=order)
        training = filled("training", template, tensors)
        best = filled("best", template, tensors) if facts["best"] else None
        history = {name[8:]: rows for name, rows in tensors.items() if name.startswith("history.")}
        return Saved(config, training, best, history, dict(facts["facts"])), int(facts["count"])
    except _UNLIKE as fault:
        raise BadInput(
            f"it is not a run of this version ({fault})", where=str(folder), remedy="start anew in another folder"
        ) from fault


def _config_from(facts: Mapping[str, Any]) -> CloningConfig:
    """A configuration from its saved form.

    Raises:
        ValueError, BadInput: it is none.
    """
    hints = get_type_hints(CloningConfig)
    given: dict[str, Any] = {name: tuple(value) if isinstance(value, list) else value for name, value in facts.items()}
    for name, value in given.items():
        fits = name in hints and (_two_numbers(value) if name == "ahead" else is_a(hints[name], value))
        if not fits:
            raise ValueError(f"{name} is {value!r}")
    return CloningConfig(**given)


def _two_numbers(value: Any) -> bool:
    return isinstance(value, tuple) and len(value) == 2 and all(is_a(float, one) for one in value)


def _not_finite(tensors: Mapping[str, np.ndarray]) -> str | None:
    """The name of a tensor that is broken."""
    return next((name for name, tensor in tensors.items() if not np.isfinite(tensor).all()), None)
