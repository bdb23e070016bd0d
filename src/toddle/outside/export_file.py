"""Where something is exported to: the ending of the path says in which format."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from toddle.failures import BadInput
from toddle.outside.files import write_bytes


def write_export(path: Path, onnx: Callable[[], bytes], jax: Callable[[], bytes]) -> None:
    """Write a file that answers without toddle.

    Args:
        path: ``.onnx`` for ONNX, ``.jax`` for `jax.export`.
        onnx: the content of the one.
        jax: the content of the other.

    Raises:
        BadInput: the ending names no format, or the folder isn't there.
    """
    written = {".onnx": onnx, ".jax": jax}
    if path.suffix not in written:
        found = path.suffix or "no ending"
        raise BadInput(f"{found} is no format", where=str(path), remedy="end it in .onnx or .jax")
    if not path.parent.is_dir():
        raise BadInput("its folder isn't there", where=str(path), remedy="make it, or name another")
    write_bytes(path, written[path.suffix]())
