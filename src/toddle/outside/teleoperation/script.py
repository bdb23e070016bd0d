"""A script of velocity commands in a text file: lines ``t vx vy omega``, times growing, ``#`` begins a comment.

Columns are parted by blanks, tabs, commas or semicolons. Each line holds from its time until the next line's.
"""

from __future__ import annotations

import math
import os
import re
import stat
from pathlib import Path

from toddle.failures import BadInput
from toddle.signals import Velocity
from toddle.walk.scenarios import Leg

COLUMNS = ("t", "vx", "vy", "omega")
_LARGEST = 2**20  # bytes
_FASTEST = 100.0  # [m/s], [rad/s]; more is a mistake, not a wish
_LONGEST = 86_400.0  # [s]
_LINE = "give t vx vy omega, in s, m/s, m/s and rad/s"


def read_script(path: Path) -> tuple[Leg, ...]:
    """The velocity commands of a file, in the order of time.

    Raises:
        BadInput: it can't be read, holds no command, or one that is none: the message names file and line.
    """
    legs: list[Leg] = []
    for number, line in enumerate(_text(path).splitlines(), start=1):
        words = re.findall(r"[^\s,;]+", line.partition("#")[0])
        if not words or (not legs and _is_head(words)):
            continue
        where = f"{path}, line {number}"
        leg = _leg(words, where)
        if legs and leg.t <= legs[-1].t:
            raise BadInput(f"its time {leg.t:g} s doesn't come after {legs[-1].t:g} s", where=where, remedy="sort them")
        legs.append(leg)
    if not legs:
        raise BadInput("it holds no command", where=str(path), remedy=_LINE)
    return tuple(legs)


def _is_head(words: list[str]) -> bool:
    return [word.lower() for word in words] == list(COLUMNS)


def _leg(words: list[str], where: str) -> Leg:
    if len(words) != len(COLUMNS):
        raise BadInput(f"it has {len(words)} columns, not {len(COLUMNS)}", where=where, remedy=_LINE)
    t, *velocity = (_number(word, name, where) for name, word in zip(COLUMNS, words, strict=True))
    if not 0 <= t <= _LONGEST:
        raise BadInput(f"t is out of range: {t:g}", where=where, remedy=f"give 0 to {_LONGEST:g} s")
    return Leg(t, Velocity(*velocity))


def _number(word: str, name: str, where: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = None
    if value is None or not math.isfinite(value):
        kind = "a number" if value is None else "a finite number"
        raise BadInput(f"{name} is not {kind}: {word[:40]!r}", where=where, remedy=_LINE)
    if name != "t" and abs(value) > _FASTEST:
        raise BadInput(f"{name} is out of range: {word[:40]}", where=where, remedy=_LINE)
    return value


def _text(path: Path) -> str:
    remedy = "name a text file of lines t vx vy omega"
    try:
        found = os.stat(path)
        if not stat.S_ISREG(found.st_mode):  # a pipe would wait for ever, a device never end
            raise BadInput("it is no file", where=str(path), remedy=remedy)
        if found.st_size > _LARGEST:
            raise BadInput("it is larger than any script", where=str(path), remedy=remedy)
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise BadInput("it is no text", where=str(path), remedy=remedy) from None
    except FileNotFoundError:
        raise BadInput("no such file", where=str(path), remedy=remedy) from None
    except OSError as fault:
        raise BadInput(f"it can't be read ({fault.strerror})", where=str(path), remedy=remedy) from fault
