"""Damage to saved skills and runs: what a bad disk, an editor, a stranger or a forger can do to the two files."""

from __future__ import annotations

import hashlib
import json
import os
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from safetensors.numpy import load, save

Damage = Callable[[Path, Path], object]
"""Harms the pair (the JSON, the tensors)."""


def forge(pair: tuple[Path, Path], change: Callable[[dict[str, Any], dict[str, np.ndarray]], object]) -> None:
    """Change facts and tensors and make every digest right again, as somebody who wants to be believed would."""
    facts, tensors = pair
    record, arrays = json.loads(facts.read_text()), load(tensors.read_bytes())
    before = dict(arrays)
    change(record, arrays)
    if any(arrays.get(name) is not value for name, value in before.items()) or len(arrays) != len(before):
        tensors.write_bytes(save(arrays))
        record["tensors_sha256"] = hashlib.sha256(tensors.read_bytes()).hexdigest()
        record["tensors"] = {name: [str(a.dtype), list(a.shape)] for name, a in sorted(arrays.items())}
    record.pop("sha256", None)
    record["sha256"] = hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()
    facts.write_text(json.dumps(record, indent=2) + "\n")


def forged(change: Callable[[dict[str, Any]], object]) -> Damage:
    """Facts that were changed, with right digests."""
    return lambda facts, tensors: forge((facts, tensors), lambda record, _: change(record))


def forged_tensors(change: Callable[[dict[str, np.ndarray]], object]) -> Damage:
    """Tensors that were changed, with right digests."""
    return lambda facts, tensors: forge((facts, tensors), lambda _, arrays: change(arrays))


def _json(content: bytes | str) -> Damage:
    text = content.encode() if isinstance(content, str) else content
    return lambda facts, _: facts.write_bytes(text)


def _tensors(content: bytes) -> Damage:
    return lambda _, tensors: tensors.write_bytes(content)


def _cut(which: int, share: float) -> Damage:
    def harm(*pair: Path) -> None:
        content = pair[which].read_bytes()
        pair[which].write_bytes(content[: int(share * len(content))])

    return harm


def _flip(which: int, share: float) -> Damage:
    return lambda *pair: flip(pair[which], share, 1)


def flip(path: Path, share: float, bits: int) -> None:
    """Change the byte that lies at this share of a file by exclusive or."""
    content = bytearray(path.read_bytes())
    content[min(int(share * len(content)), len(content) - 1)] ^= bits
    path.write_bytes(content)


def _instead(which: int, make: Callable[[Path], object]) -> Damage:
    def harm(*pair: Path) -> None:
        pair[which].unlink()
        make(pair[which])

    return harm


def _edit(old: str, new: str) -> Damage:
    def harm(facts: Path, _: Path) -> None:
        text = facts.read_text()
        assert old in text
        facts.write_text(text.replace(old, new, 1))

    return harm


def _last(arrays: dict[str, np.ndarray]) -> str:
    return next(name for name, array in sorted(arrays.items(), reverse=True) if array.dtype == np.float32)


NOT_JSON, ALTERED, FOREIGN, VERSION = "not JSON", "altered", "toddle did not write it", "of this version"

DAMAGES: dict[str, tuple[Damage, str]] = {
    "no JSON": (_instead(0, lambda path: None), "there is no"),
    "no tensors": (_instead(1, lambda path: None), "there is no"),
    "JSON empty": (_json(""), NOT_JSON),
    "JSON cut in half": (_cut(0, 0.5), NOT_JSON),
    "JSON cut at its end": (_cut(0, 0.999), NOT_JSON),
    "JSON longer": (lambda facts, _: facts.write_bytes(facts.read_bytes() + b" "), ALTERED),
    "JSON twice": (lambda facts, _: facts.write_bytes(2 * facts.read_bytes()), NOT_JSON),
    "JSON binary": (_json(bytes(range(256))), NOT_JSON),
    "JSON in UTF-16": (lambda facts, _: facts.write_text(facts.read_text(), "utf-16"), NOT_JSON),
    "JSON nested without end": (_json("[" * 100_000), NOT_JSON),
    "JSON of a huge number": (_json("1" * 10_000), NOT_JSON),
    "JSON of others": (_json('{"weights": [1, 2, 3]}'), FOREIGN),
    "JSON list": (_json("[]"), FOREIGN),
    "JSON number": (_json("NaN"), FOREIGN),
    "JSON null": (_json("null"), FOREIGN),
    "JSON text": (_json('"toddle skill"'), FOREIGN),
    "JSON format a number": (_json('{"format": 1}'), FOREIGN),
    "JSON pickled": (_json(pickle.dumps({"format": "toddle skill"})), NOT_JSON),
    "JSON a folder": (_instead(0, Path.mkdir), "it is no file"),
    "JSON a pipe": (_instead(0, os.mkfifo), "it is no file"),
    "JSON points to itself": (_instead(0, lambda path: path.symlink_to(path)), "can't be read"),
    "JSON points to a device": (_instead(0, lambda path: path.symlink_to("/dev/zero")), "it is no file"),
    "JSON flipped early": (_flip(0, 0.3), ""),
    "JSON flipped late": (_flip(0, 0.9), ""),
    "a seed edited": (_edit('"seed": 0', '"seed": 1'), ALTERED),
    "a space more": (_edit('"version": 1', '"version":  1'), ALTERED),
    "a key twice": (_edit('"version": 1', '"version": 1,\n  "version": 1'), ALTERED),
    "no digest": (lambda facts, _: facts.write_text(facts.read_text().replace("sha256", "md5")), ALTERED),
    "another version": (_edit('"version": 1', '"version": 2'), "has version 2"),
    "no version": (_edit('"version": 1', '"verse": 1'), "has version None"),
    "tensors empty": (_tensors(b""), ALTERED),
    "tensors cut in half": (_cut(1, 0.5), ALTERED),
    "tensors cut at the end": (_cut(1, 0.999), ALTERED),
    "tensors flipped early": (_flip(1, 0.001), ALTERED),
    "tensors flipped in the middle": (_flip(1, 0.5), ALTERED),
    "tensors flipped at the end": (_flip(1, 1.0), ALTERED),
    "tensors of others": (_tensors(save({"weight": np.zeros(3)})), ALTERED),
    "tensors pickled": (_tensors(pickle.dumps([1, 2])), ALTERED),
    "tensors a folder": (_instead(1, Path.mkdir), "it is no file"),
    "tensors a pipe": (_instead(1, os.mkfifo), "it is no file"),
    "forged: no facts": (forged(lambda record: record.pop("facts")), "no facts"),
    "forged: facts a list": (forged(lambda record: record.update(facts=[])), "no facts"),
    "forged: facts empty": (forged(lambda record: record.update(facts={})), VERSION),
    "forged: no tensor list": (forged(lambda record: record.pop("tensors")), "aren't those"),
    "forged: no tensor digest": (forged(lambda record: record.pop("tensors_sha256")), ALTERED),
    "forged: other tensors listed": (forged(lambda record: record["tensors"].popitem()), "aren't those"),
    "forged: configuration a text": (forged(lambda record: record["facts"].update(config="x")), VERSION),
    "forged: samples below zero": (forged(lambda record: record["facts"]["config"].update(samples=-1)), VERSION),
    "forged: samples a text": (forged(lambda record: record["facts"]["config"].update(samples="x")), VERSION),
    "forged: hidden a number": (forged(lambda record: record["facts"]["config"].update(hidden=4)), VERSION),
    "forged: an option more": (forged(lambda record: record["facts"]["config"].update(more=4)), VERSION),
    "forged: an unknown method": (
        forged(lambda record: record["facts"]["config"].update(method="magic")),
        "no method named 'magic'",
    ),
    "forged: no safetensors": (
        lambda facts, tensors: (tensors.write_bytes(b"no"), forge_digest(facts, tensors)),
        "no safetensors file",
    ),
    "forged: a tensor less": (forged_tensors(lambda arrays: arrays.pop(_last(arrays))), ""),
    "forged: a tensor of another type": (
        forged_tensors(lambda arrays: arrays.update({_last(arrays): arrays[_last(arrays)].astype(np.float64)})),
        "",
    ),
    "forged: a tensor of another shape": (
        forged_tensors(lambda arrays: arrays.update({_last(arrays): np.zeros((3, 1), np.float32)})),
        "",
    ),
}


def forge_digest(facts: Path, tensors: Path) -> None:
    """Make the digests right for whatever the tensors' file holds."""
    record = json.loads(facts.read_text())
    record["tensors_sha256"] = hashlib.sha256(tensors.read_bytes()).hexdigest()
    record.pop("sha256")
    record["sha256"] = hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()
    facts.write_text(json.dumps(record, indent=2) + "\n")
