"""The folders that ``toddle navigate`` leaves: none is written over, none is left behind by a call that failed."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from toddle.cli.run_folder import new_folder
from toddle.failures import BadInput

RUN = "checkpoint.json"
FILES = (
    RUN, "policy.json", "policy.safetensors", "checkpoints", "config.json", "figures.json", "learning.png",
    "tensorboard", "courses.json", "drives.json", "paths.png", "cases.png",
)  # fmt: skip


def refuse_used(out: Path | None) -> None:
    """Refuse a folder in which something would be written over.

    Raises:
        BadInput: it holds a run or a judgement already, or is none.
    """
    if out is None:
        return
    if os.path.lexists(out) and not os.path.isdir(out):
        raise BadInput("it is no folder", where=f"--out {out}", remedy="name another")
    found = [name for name in FILES if os.path.lexists(out / name)]
    if found and found[0] == RUN:
        remedy = f"go on with toddle navigate ppo --resume {out}, or name another"
        raise BadInput("it holds a run already", where=f"--out {out}", remedy=remedy)
    if found:
        raise BadInput(f"its {found[0]} would be written over", where=f"--out {out}", remedy="name another")


@contextmanager
def left_folder(out: Path | None, name: str) -> Iterator[Path]:
    """A new folder; if it is still empty in the end, because nothing came of it, it goes again.

    Raises:
        BadInput: it can't be made, or nothing can be written into it.
    """
    there = out is not None and out.exists()
    folder = new_folder(out, name)
    try:
        yield folder
    finally:
        if not there:
            with contextlib.suppress(OSError):  # it holds something
                folder.rmdir()
