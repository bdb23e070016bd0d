"""Pictures on disk: read with suspicion, written whole or not at all, and paired by their names."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import UInt, UInt8

from toddle.failures import BadInput
from toddle.outside.files import write_bytes

ENDINGS = (".png", ".jpg", ".jpeg", ".bmp", ".pgm", ".ppm", ".tif", ".tiff", ".webp")
_LARGEST = 2**28  # bytes
_SIDES = re.compile(r"left|right|(?<![a-z])[lr](?![a-z])", re.IGNORECASE)


class Paired(NamedTuple):
    """Pictures of two folders that belong together.

    Attributes:
        pairs: name, left and right picture.
        alone: those without a partner.
    """

    pairs: tuple[tuple[str, Path, Path], ...]
    alone: tuple[Path, ...]


def read_picture(path: Path) -> UInt8[np.ndarray, "rows columns 3"]:
    """A picture: blue, green, red, 8 bits.

    Raises:
        BadInput: it can't be read, or is none.
    """
    remedy = "give a PNG or a JPEG"
    try:
        if not path.is_file():
            raise BadInput("there is no such picture", where=str(path), remedy=remedy)
        if path.stat().st_size > _LARGEST:
            raise BadInput("it is too large for a picture", where=str(path), remedy=remedy)
        content = np.frombuffer(path.read_bytes(), np.uint8)
        picture = cv2.imdecode(content, cv2.IMREAD_COLOR) if len(content) else None
    except OSError as fault:
        raise BadInput(f"it can't be read ({fault.strerror})", where=str(path), remedy=remedy) from fault
    except cv2.error:
        picture = None
    if picture is None:
        raise BadInput("it is no picture, or is damaged", where=str(path), remedy=remedy)
    return picture.astype(np.uint8)


def write_picture(path: Path, picture: UInt[np.ndarray, "rows columns *colours"]) -> None:
    """Write a PNG of 8 or 16 bits."""
    _, content = cv2.imencode(".png", picture)
    write_bytes(path, content.tobytes())


def paired(left: Path, right: Path) -> Paired:
    """The pictures of two folders, paired by what their names say besides the side: ``left07.png``, ``right07.png``.

    Raises:
        BadInput: a folder isn't one, or no picture of one has a partner in the other.
    """
    ours, theirs = _by_key(left), _by_key(right)
    pairs = tuple((key or ours[key].stem, ours[key], theirs[key]) for key in ours if key in theirs)
    if not pairs:
        remedy = "give the two pictures of a pair the same name, or names that differ in left and right"
        raise BadInput(f"none of its pictures has a partner in {right}", where=str(left), remedy=remedy)
    lonely = [path for key, path in ours.items() if key not in theirs]
    lonely += [path for key, path in theirs.items() if key not in ours]
    return Paired(pairs, tuple(lonely))


def _by_key(folder: Path) -> dict[str, Path]:
    """Pictures by the part of their names that is the same on both sides."""
    if not folder.is_dir():
        raise BadInput("there is no such folder", where=str(folder), remedy="name a folder of pictures")
    found: dict[str, Path] = {}
    for path in sorted(folder.iterdir(), key=lambda path: path.name):
        if path.suffix.lower() not in ENDINGS or path.name.startswith("."):
            continue
        key = _SIDES.sub("", path.stem).strip("_- ")
        if key in found:
            what = f"{found[key].name} and {path.name} look like the same picture"
            raise BadInput(what, where=str(folder), remedy="keep the left and the right pictures in a folder each")
        found[key] = path
    if not found:
        raise BadInput("it holds no pictures", where=str(folder), remedy=f"known are {', '.join(ENDINGS)}")
    return found
