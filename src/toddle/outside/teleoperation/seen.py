"""A small picture on a terminal: two pixels in each character, the nearest things below it, and a line of words."""

from __future__ import annotations

import contextlib
import os
import shutil
import sys

import numpy as np
from jaxtyping import Float, Float32, UInt8

from toddle.navigate.sight import Sight

_BARS = " ▁▂▃▄▅▆▇█"
_NEAR, _FAR = 0.5, 3.0  # a full bar, and none [m]
_BAND = slice(8, 34)  # rows in which what stands in the way shows, and hardly any floor
_SHARE = 10  # percentile of the depths in a column
_WIDE, _HIGH = 80, 34  # of the screen that a whole picture takes
_BEGIN, _END = "\x1b[?1049h\x1b[?25l", "\x1b[?25h\x1b[?1049l"


class Seen:
    """A screen that shows what the robot sees; within ``with``, and the terminal is as before afterwards."""

    def __init__(self, full: bool | None = None) -> None:
        """Made ready; nothing is shown yet, and all of it on standard error.

        Args:
            full: whether it shows 16 million colours, or 256; as the terminal says unless given.
        """
        self._full = os.environ.get("COLORTERM") in ("truecolor", "24bit") if full is None else full

    def __enter__(self) -> Seen:
        self._write(_BEGIN)
        return self

    def __exit__(self, *_: object) -> None:
        self._write(_END)

    def show(self, sight: Sight, lines: tuple[str, ...]) -> None:
        """This is what it sees now, and what is to be said below."""
        columns, rows = shutil.get_terminal_size((_WIDE, _HIGH))
        step = 1 if columns >= _WIDE and rows >= _HIGH - 4 + len(lines) else 2
        shown = [*blocks(sight.picture[::step, ::step], full=self._full), nearness(sight.depth)[::step], *lines]
        text = "".join(
            f"{line[:columns] if number >= len(shown) - len(lines) else line}\x1b[K\r\n"
            for number, line in enumerate(shown)
        )
        self._write(f"\x1b[H{text}\x1b[J")

    def _write(self, text: str) -> None:
        with contextlib.suppress(OSError, ValueError):  # the terminal is gone; whoever reads the keys finds out
            sys.stderr.write(text)
            sys.stderr.flush()


def blocks(picture: UInt8[np.ndarray, "rows columns 3"], *, full: bool) -> list[str]:
    """A picture as lines of half blocks: the upper pixel is the character's colour, the lower one its ground.

    Args:
        picture: red, green, blue; an even number of rows.
        full: whether any colour can be shown, or only the 6 x 6 x 6 of 256.
    """
    if full:
        codes = [[f"2;{r};{g};{b}" for r, g, b in row] for row in picture.tolist()]
    else:
        sixths = np.rint(picture.astype(float) / 51.0).astype(int)
        numbers = 16 + sixths @ np.array([36, 6, 1])
        codes = [[f"5;{number}" for number in row] for row in numbers.tolist()]
    return [_line(above, below) for above, below in zip(codes[::2], codes[1::2], strict=True)]


def _line(above: list[str], below: list[str]) -> str:
    parts, last = [], ("", "")
    for pair in zip(above, below, strict=True):
        upper = f"\x1b[38;{pair[0]}m" if pair[0] != last[0] else ""
        lower = f"\x1b[48;{pair[1]}m" if pair[1] != last[1] else ""
        parts.append(f"{upper}{lower}▀")
        last = pair
    return "".join(parts) + "\x1b[0m"


def nearness(depth: Float32[np.ndarray, "rows columns"]) -> str:
    """A bar for each column: the higher, the nearer what stands there; a dot where nothing is known."""
    return "".join("·" if np.isnan(near) else _bar(near) for near in nearest(depth).tolist())


def _bar(near: float) -> str:
    share = min(max((_FAR - near) / (_FAR - _NEAR), 0.0), 1.0)
    return _BARS[round(share * (len(_BARS) - 1))]


def nearest(depth: Float32[np.ndarray, "rows columns"]) -> Float[np.ndarray, " columns"]:
    """How far away the nearest tenth of what each column shows is [m]; NaN where nothing is known."""
    band = np.where(depth[_BAND] > 0, depth[_BAND], np.inf).astype(float)
    known = (band < np.inf).sum(axis=0)
    rank = np.maximum(np.ceil(known * _SHARE / 100).astype(int) - 1, 0)
    found = np.sort(band, axis=0)[rank, np.arange(band.shape[1])]
    return np.where(known > 0, found, np.nan)
