"""Policies on disk: a pair ``policy.json`` + ``policy.safetensors``; what was saved comes back bit for bit.

The networks are rebuilt from their configuration first, as shapes without values; the tensors must then fit exactly.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import jax
import jax.numpy as jnp
import numpy as np

from toddle.failures import BadInput
from toddle.navigate.policy import Policy
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.moments import Moments, unseen
from toddle.navigate.ppo.network import ActorCritic, actor_critic
from toddle.navigate.task import Actions, Continuous, Discrete
from toddle.outside.files import make_folder, read_record, write_record

_POLICY = "policy"
_AGAIN = "learn it again"
_UNLIKE = (LookupError, TypeError, ValueError, AttributeError, OverflowError, BadInput)


def save_policy(policy: Policy, folder: str | os.PathLike[str]) -> Path:
    """Save a policy; returns the folder.

    Raises:
        BadInput: the folder can't be made, or a weight is not finite; nothing is written then.
    """
    tensors = flat("network", policy.network) | flat("moments", policy.moments)
    try:
        _check(policy.moments, tensors)
    except ValueError as fault:
        raise BadInput(f"the policy is broken ({fault})", where=str(folder), remedy=_AGAIN) from fault
    path = make_folder(Path(folder))
    facts = {
        "config": dataclasses.asdict(policy.config),
        "observations": policy.observations,
        "actions": actions_facts(policy.actions),
        "source": dict(policy.source),
        "figures": dict(policy.figures),
    }
    write_record(path, "policy", _POLICY, facts, tensors)
    return path


def load_policy(folder: str | os.PathLike[str]) -> Policy:
    """Load a saved policy; it acts as it did before, bit for bit.

    Raises:
        BadInput: there is none, or it is truncated, altered, not finite, or not a policy.
    """
    path = Path(folder)
    facts, tensors = read_record(path, "policy", _POLICY)
    try:
        config, actions = config_from(facts["config"]), actions_from(facts["actions"])
        observations = _positive(facts["observations"], "observations")
        network, moments = _shapes(config, observations, actions)
        found = filled("network", network, tensors), filled("moments", moments, tensors)
        _check_names(tensors, flat_names("network", network) | flat_names("moments", moments))
        _check(found[1], tensors)
        return Policy(*found, config, observations, actions, dict(facts["source"]), dict(facts["figures"]))
    except _UNLIKE as fault:
        raise BadInput(f"it is not a policy of this version ({fault})", where=str(path), remedy=_AGAIN) from fault


def config_from(facts: Mapping[str, Any]) -> PpoConfig:
    """A configuration from its saved form.

    Raises:
        BadInput, TypeError, ValueError: it is none.
    """
    hints = get_type_hints(PpoConfig)
    fitting: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in facts.items()
    }
    for name, value in fitting.items():
        if name not in hints or not is_a(hints[name], value):
            raise ValueError(f"{name} is {value!r}")
    return PpoConfig(**fitting)


def actions_facts(actions: Actions) -> dict[str, int]:
    """What may be done, as plain values."""
    return {"continuous": actions.size} if isinstance(actions, Continuous) else {"discrete": actions.count}


def actions_from(facts: Mapping[str, Any]) -> Actions:
    """What may be done, from its saved form.

    Raises:
        ValueError: it is none.
    """
    ((kind, count),) = facts.items()
    if kind not in ("continuous", "discrete"):
        raise ValueError(f"actions are {kind!r}")
    count = _positive(count, "actions")
    return Continuous(count) if kind == "continuous" else Discrete(count)


def flat(name: str, tree: Any) -> dict[str, np.ndarray]:
    """The leaves of a pytree by their path; random keys as their numbers."""
    leaves, _ = jax.tree_util.tree_flatten_with_path(tree)
    return {name + jax.tree_util.keystr(path): _plain(leaf) for path, leaf in leaves}


def flat_names(name: str, tree: Any) -> set[str]:
    """The paths of a pytree's leaves."""
    leaves, _ = jax.tree_util.tree_flatten_with_path(tree)
    return {name + jax.tree_util.keystr(path) for path, _ in leaves}


def filled(name: str, template: Any, tensors: Mapping[str, np.ndarray]) -> Any:
    """The pytree of a template's structure, filled with the tensors of its paths.

    Args:
        name: that the tensors' names begin with.
        template: arrays or their shapes.
        tensors: by path.

    Raises:
        LookupError, ValueError: a tensor is missing, or has another shape or type.
    """
    leaves, structure = jax.tree_util.tree_flatten_with_path(template)
    found = [_like(leaf, name + jax.tree_util.keystr(path), tensors) for path, leaf in leaves]
    return jax.tree_util.tree_unflatten(structure, found)


def _plain(leaf: Any) -> np.ndarray:
    return np.asarray(jax.random.key_data(leaf) if _is_key(leaf) else leaf)


def _like(leaf: Any, name: str, tensors: Mapping[str, np.ndarray]) -> Any:
    """One tensor as the template has it: on the host, on the device, or as a random key."""
    if name not in tensors:
        raise LookupError(f"{name} is missing")
    tensor, wanted = tensors[name], jax.eval_shape(jax.random.key_data, leaf) if _is_key(leaf) else leaf
    if tensor.shape != wanted.shape or tensor.dtype != wanted.dtype:
        raise ValueError(f"{name} is {tensor.dtype}{list(tensor.shape)}")
    if _is_key(leaf):
        kind = jax.random.key_impl(jnp.empty((), leaf.dtype))
        return jax.random.wrap_key_data(jnp.asarray(tensor), impl=kind)
    return tensor if isinstance(leaf, np.ndarray) else jnp.asarray(tensor)


def _is_key(leaf: Any) -> bool:
    return jnp.issubdtype(getattr(leaf, "dtype", np.float32), jax.dtypes.prng_key)


def _shapes(config: PpoConfig, observations: int, actions: Actions) -> tuple[ActorCritic, Moments]:
    """Networks and moments without values."""

    def make() -> tuple[ActorCritic, Moments]:
        return actor_critic(config, observations, actions, jax.random.key(0)), unseen(observations)

    return jax.eval_shape(make)


def _check(moments: Moments, tensors: Mapping[str, np.ndarray]) -> None:
    """Refuse numbers that no policy has."""
    for name, tensor in tensors.items():
        if not np.isfinite(tensor).all():
            raise ValueError(f"{name} is not finite")
    if np.min(moments.variance, initial=0.0) < 0:
        raise ValueError("a variance is negative")


def _check_names(tensors: Mapping[str, np.ndarray], wanted: set[str]) -> None:
    if more := sorted(set(tensors) - wanted):
        raise ValueError(f"{more[0]} belongs to no policy like this")


def _positive(value: Any, name: str) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or value < 1:
        raise ValueError(f"{name} is {value!r}")
    return value


def is_a(hint: Any, value: Any) -> bool:
    """Whether a value is of a field's type: a number, a text, one out of several or none, or whole numbers."""
    if get_origin(hint) in (Union, UnionType):
        return any(is_a(one, value) for one in get_args(hint))
    if get_origin(hint) is Literal:
        return value in get_args(hint)
    if hint is float:
        return isinstance(value, int | float) and not isinstance(value, bool)
    if hint in (int, bool, str, NoneType):
        return type(value) is hint
    return isinstance(value, tuple) and all(type(one) is int for one in value)
