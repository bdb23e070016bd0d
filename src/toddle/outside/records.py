"""Values made of dataclasses, named tuples and arrays, taken apart for a pair of JSON and safetensors, and rebuilt.

Only the classes that the reader names are ever made again: what a file says can't run anything.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

Tensors = dict[str, np.ndarray]


def taken_apart(value: Any, name: str, tensors: Tensors) -> Any:
    """What JSON can hold of a value; its arrays go into ``tensors`` under names that begin with ``name``.

    Args:
        value: numbers, texts, arrays, and tuples, mappings, named tuples and dataclasses of them.
        name: of the value.
        tensors: where its arrays are put.

    Raises:
        TypeError: it holds something else.
    """
    if isinstance(value, np.ndarray):
        tensors[name] = value
        return {"tensor": name}
    if dataclasses.is_dataclass(value) or hasattr(value, "_fields"):
        inner = {key: taken_apart(getattr(value, key), f"{name}.{key}", tensors) for key in _fields(type(value))}
        return {"class": type(value).__name__, "fields": inner}
    if isinstance(value, Mapping):
        return {"mapping": {key: taken_apart(inner, f"{name}.{key}", tensors) for key, inner in value.items()}}
    if isinstance(value, tuple | list):
        return [taken_apart(inner, f"{name}.{i}", tensors) for i, inner in enumerate(value)]
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Path):
        return str(value)
    if value is None or isinstance(value, str | bool | int | float):
        return value
    raise TypeError(f"{name} is a {type(value).__name__}")


def put_together(facts: Any, tensors: Mapping[str, np.ndarray], classes: Mapping[str, type]) -> Any:
    """The value that was taken apart; lists come back as tuples.

    Raises:
        LookupError, TypeError, ValueError: it doesn't hold together, or names a class that isn't among ``classes``.
    """
    if isinstance(facts, list):
        return tuple(put_together(inner, tensors, classes) for inner in facts)
    if not isinstance(facts, dict):
        return facts
    if set(facts) == {"tensor"}:
        return tensors[facts["tensor"]]
    if set(facts) == {"mapping"}:
        return {key: put_together(inner, tensors, classes) for key, inner in facts["mapping"].items()}
    made = classes[facts["class"]]
    if set(facts["fields"]) != set(_fields(made)):
        raise ValueError(f"{facts['class']} has fields {', '.join(facts['fields'])}")
    return made(**{key: put_together(inner, tensors, classes) for key, inner in facts["fields"].items()})


def _fields(kind: type) -> tuple[str, ...]:
    if dataclasses.is_dataclass(kind):
        return tuple(field.name for field in dataclasses.fields(kind) if field.init)
    return tuple(getattr(kind, "_fields", ()))
