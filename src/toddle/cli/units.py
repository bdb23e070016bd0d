"""Lengths and angles as words of the command line: a number and its unit."""

from __future__ import annotations

import math
import re

from toddle.failures import BadInput

_QUANTITY = re.compile(r"([+-]?\d+(?:\.\d+)?)(mm|cm|m|mrad|rad|deg)")
_METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
_MOST = 1.0  # [m], [rad]
_RADIANS = {"mrad": 1e-3, "rad": 1.0, "deg": math.pi / 180}


def quantity(text: str, where: str) -> tuple[float, bool]:
    """A number with its unit, such as 1mm or 5mrad.

    Args:
        text: the word.
        where: the option that it was given to.

    Returns:
        The number in metres or radians, and whether it is an angle.

    Raises:
        BadInput: it has no unit, or another one.
    """
    match = _QUANTITY.fullmatch(text)
    if match is None:
        raise BadInput(f"{text!r} is no length or angle", where=where, remedy="give it with its unit, as 1mm or 5mrad")
    scale = _METRES.get(match[2]) or _RADIANS[match[2]]
    return float(match[1]) * scale, match[2] in _RADIANS


def sight(words: tuple[str, ...] | None, where: str) -> tuple[float, float]:
    """The noise of seen tips from words such as 1mm and 5mrad, also with a comma between them: [m], [rad].

    Raises:
        BadInput: one has no unit, is out of range, or there are two of a kind.
    """
    found: dict[bool, float] = {}
    for word in (part for text in words or () for part in text.split(",")):
        value, is_angle = quantity(word, where)
        if is_angle in found:
            raise BadInput(f"{' '.join(words or ())!r} is given twice", where=where, remedy="as in 1mm 5mrad")
        if not 0 <= value <= _MOST:
            raise BadInput(f"{word!r} is out of range", where=where, remedy="give 0 to 1 m, or 0 to 1 rad")
        found[is_angle] = value
    return found.get(False, 0.0), found.get(True, 0.0)


def metres(words: tuple[str, ...], where: str) -> float:
    """A length alone, such as 1mm [m].

    Raises:
        BadInput: it is none.
    """
    length, angle = sight(words, where)
    if angle:
        raise BadInput("an angle isn't seen here", where=where, remedy="give a length alone, such as 1mm")
    return length
