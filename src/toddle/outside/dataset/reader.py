"""Reads a dataset back: each episode by itself, so that a damaged one is named and the others are read."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from pathlib import Path

from toddle.failures import BadInput
from toddle.navigate.cloning.recording import Recording
from toddle.navigate.sight import COLUMNS, ROWS
from toddle.outside.dataset import layout
from toddle.outside.dataset.pictures import read_video
from toddle.outside.dataset.rows import Damaged, Facts, read_facts, read_rows


def begun(folder: Path) -> bool:
    """Whether a dataset is here, if only an empty one."""
    return bool(layout.numbers(folder)) or _told(folder) is not None


def episodes(folder: Path) -> tuple[int, ...]:
    """The numbers of all episodes that there are or should be, from 0.

    Raises:
        BadInput: there is no dataset here.
    """
    found = layout.numbers(folder)
    told = _told(folder)
    if not found and told is None:
        raise BadInput("there is no dataset here", where=str(folder), remedy="name a folder of toddle navigate record")
    return tuple(range(max(told or 0, found[-1] + 1 if found else 0)))


def _told(folder: Path) -> int | None:
    """How many there should be; None: nobody tells."""
    try:
        said = json.loads((folder / layout.INFO).read_text(encoding="utf-8"))["total_episodes"]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    return said if isinstance(said, int) and 0 <= said <= 10**6 else None


def facts_of(folder: Path, number: int) -> Facts:
    """What an episode was, without reading it.

    Raises:
        Damaged: it can't be told.
    """
    return read_facts(layout.data_file(folder, number), _where(folder, number))


def read_episode(folder: Path, number: int) -> Recording:
    """One episode, bit for bit as it was written; depth to the millimetre.

    Raises:
        Damaged: a byte of it has changed, or a file of it is gone.
    """
    where = _where(folder, number)
    facts, recording = read_rows(layout.data_file(folder, number), where)
    path = layout.video_file(folder, number)
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise Damaged("its video is gone", where=where) from None
    except OSError as fault:
        raise Damaged(f"its video can't be read ({fault.strerror})", where=where) from fault
    if hashlib.sha256(content).hexdigest() != facts.video:
        raise Damaged("its video was altered or cut short", where=where)
    pictures = read_video(path)
    if pictures.shape != (facts.looks, ROWS, COLUMNS, 3):
        raise Damaged("its video can't be decoded here", where=where, remedy="is OpenCV built with FFmpeg?")
    return recording._replace(picture=pictures)


def read_dataset(folder: Path, damaged: Callable[[Damaged], None]) -> Iterator[tuple[int, Recording]]:
    """All episodes that can be read, each when it is asked for, with its number.

    Args:
        folder: of the dataset.
        damaged: is told of each that can't be read.

    Raises:
        BadInput: there is no dataset here.
    """
    for number in episodes(folder):
        try:
            recording = read_episode(folder, number)
        except Damaged as fault:
            damaged(fault)
        else:
            yield number, recording


def _where(folder: Path, number: int) -> str:
    return f"{folder}, episode {number}"
