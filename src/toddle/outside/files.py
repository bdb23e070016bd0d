"""Run folders on disk: JSON and safetensors, written whole or not at all, and read with suspicion.

A skill or a checkpoint is a pair ``NAME.json`` + ``NAME.safetensors``. The JSON names every tensor with its type and
shape, and carries a digest of the tensors and one of itself, so that a truncated, altered or foreign file is refused
before anything of it is used. Nothing here loads pickles or runs what it reads.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import stat
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load as tensors_from_bytes
from safetensors.numpy import save as tensors_to_bytes

from toddle.failures import BadInput, ToddleError

_LARGEST = 2**30  # bytes; a skill is a few kilobytes


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file whole: it is complete under its name, or it isn't there."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_bytes(content)
        os.replace(part, path)
    except OSError as fault:
        raise ToddleError(f"it can't be written ({fault.strerror})", where=str(path)) from fault
    finally:  # also when Ctrl-C comes in the middle
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def write_json(path: Path, value: Mapping[str, Any]) -> None:
    """Write a JSON object, keys in their order; a number that isn't finite becomes null."""
    write_bytes(path, (json.dumps(finite(value), indent=2) + "\n").encode())


def finite(value: Any) -> Any:
    """The same value with null for what JSON has no word for."""
    if isinstance(value, Mapping):
        return {str(key): finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [finite(inner) for inner in value]
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value


def make_folder(path: Path) -> Path:
    """Make a folder that files can be written into, and those above it.

    Raises:
        BadInput: something else is there, or it can't be made or written into; nothing is left behind.
    """
    made: list[Path] = []
    try:
        for folder in [*reversed(path.parents), path]:
            if not folder.is_dir():
                folder.mkdir()
                made.append(folder)
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as fault:
        for folder in reversed(made):
            folder.rmdir()
        raise BadInput(
            f"no folder can be made or written into here ({fault.strerror})",
            where=str(path),
            remedy="name another",
        ) from fault
    return path


def write_record(
    folder: Path, name: str, kind: str, facts: Mapping[str, Any], tensors: Mapping[str, np.ndarray]
) -> None:
    """Write a pair of files: facts and tensors.

    Args:
        folder: where; it must exist.
        name: of the pair, without an ending.
        kind: what the record is; reading it as another kind is refused.
        facts: what isn't a tensor.
        tensors: the arrays by name.
    """
    content = tensors_to_bytes({key: np.asarray(value, order="C") for key, value in tensors.items()})
    record = {
        "format": f"toddle {kind}",
        "version": 1,
        "facts": finite(facts),
        "tensors": {key: [str(value.dtype), list(value.shape)] for key, value in sorted(tensors.items())},
        "tensors_sha256": hashlib.sha256(content).hexdigest(),
    }
    record["sha256"] = _digest(record)
    write_bytes(folder / f"{name}.safetensors", content)
    write_bytes(folder / f"{name}.json", _text(record))


def read_record(folder: Path, name: str, kind: str) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Read a pair of files that `write_record` wrote.

    Returns:
        The facts, and the tensors by name.

    Raises:
        BadInput: a file is missing, truncated, altered, or of another kind.
    """
    record = _read_json(folder / f"{name}.json", kind)
    path = folder / f"{name}.safetensors"
    content = _read(path, kind)
    if hashlib.sha256(content).hexdigest() != record.get("tensors_sha256"):
        raise BadInput("it was altered or cut short since it was written", where=str(path), remedy="learn it again")
    try:
        tensors = tensors_from_bytes(content)
    except SafetensorError as fault:
        raise BadInput(f"it is no safetensors file ({fault})", where=str(path)) from fault
    if {key: [str(value.dtype), list(value.shape)] for key, value in tensors.items()} != record.get("tensors"):
        raise BadInput("its tensors aren't those that its JSON names", where=str(path), remedy="learn it again")
    facts = record.get("facts")
    if not isinstance(facts, dict):
        raise BadInput("it holds no facts", where=str(folder / f"{name}.json"), remedy="learn it again")
    return facts, tensors


def _read_json(path: Path, kind: str) -> dict[str, Any]:
    content = _read(path, kind)
    try:
        record = json.loads(content.decode("utf-8"))
    except (ValueError, RecursionError) as fault:
        raise BadInput("it is not JSON, or was cut short", where=str(path), remedy="learn it again") from fault
    if not isinstance(record, dict) or not str(record.get("format", "")).startswith("toddle "):
        raise BadInput("toddle did not write it", where=str(path), remedy=f"name the folder of a {kind}")
    if record["format"] != f"toddle {kind}":
        raise BadInput(f"it is a {record['format']}, not a toddle {kind}", where=str(path))
    if record.get("version") != 1:
        raise BadInput(f"it has version {record.get('version')!r}", where=str(path), remedy="update toddle")
    digest = _digest({key: value for key, value in record.items() if key != "sha256"})
    if record.get("sha256") != digest or content != _text(record):
        raise BadInput("it was altered since it was written", where=str(path), remedy="learn it again")
    return record


def _read(path: Path, kind: str) -> bytes:
    remedy = f"name the folder of a {kind}"
    try:
        found = path.stat()
        if not stat.S_ISREG(found.st_mode):  # a pipe would wait for ever, a device never end
            raise BadInput("it is no file", where=str(path), remedy=remedy)
        if found.st_size > _LARGEST:
            raise BadInput(f"it is larger than any {kind}", where=str(path), remedy=remedy)
        return path.read_bytes()
    except FileNotFoundError:
        raise BadInput(f"there is no {kind} here", where=str(path), remedy=remedy) from None
    except NotADirectoryError:
        raise BadInput("it is no folder", where=str(path.parent), remedy=remedy) from None
    except OSError as fault:
        raise BadInput(f"it can't be read ({fault.strerror})", where=str(path), remedy=remedy) from fault


def _text(record: Mapping[str, Any]) -> bytes:
    """The one way in which a record is written, so that any altered byte can be told."""
    return (json.dumps(record, indent=2) + "\n").encode()


def _digest(record: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()
