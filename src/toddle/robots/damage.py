"""What can happen to a body while it works, and how it is written: ``lock:elbow@500``, ``slip:elbow=10deg@500``.

    lock:JOINT@N          the joint stays where it stands
    weaken:JOINT=0.5@N    it moves half as far from where it stood
    slip:JOINT=0.2@N      it goes 0.2 rad (10deg, or for a sliding joint 2cm) beyond what it is told
    bend:LINK=5cm@N       the far end of the link is 5 cm aside, and turned as much; a joint's name: the link after it
    replace:LINK=+8cm@N   the link is 8 cm longer

N is the first movement that the broken body makes, counted from 1.
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from toddle.failures import BadInput, unknown_name

JOINT_KINDS, LINK_KINDS = ("lock", "weaken", "slip"), ("bend", "replace")
_UNITS = {"rad": ("rad", 1.0), "deg": ("rad", math.pi / 180), "m": ("m", 1.0), "cm": ("m", 0.01), "mm": ("m", 1e-3)}
_PATTERN = re.compile(r"([a-z]+):([^=@]+?)(?:=([^=@]*))?@([0-9]{1,9})")
_EXAMPLE = "write it like lock:elbow@500, slip:elbow=0.2@500 or bend:elbow=5cm@500"


class Damage(NamedTuple):
    """One thing that happens to a body.

    Attributes:
        kind: "lock", "weaken", "slip", "bend" or "replace".
        part: the joint or link that it happens to.
        amount: what remains of the motion of a weakened joint, a slip [rad or m], a bend or change of length [m].
        at: the first movement that the broken body makes, counted from 1.
        unit: "rad" or "m" as it was written; "": none was.
    """

    kind: str
    part: str
    amount: float
    at: int
    unit: str = ""

    def __str__(self) -> str:
        amount = "" if self.kind == "lock" else f"={self.amount:g}{self.unit}"
        return f"{self.kind}:{self.part}{amount}@{self.at}"


def parse_damage(text: str) -> Damage:
    """The damage that a text such as ``slip:elbow=0.2@500`` stands for.

    Raises:
        BadInput: it is written otherwise, of no known kind, or its amount makes no sense.
    """
    match = _PATTERN.fullmatch(text.strip())
    if match is None:
        raise BadInput("it is no damage", where=f"damage {text!r}", remedy=_EXAMPLE)
    kind, part, written, at = match.groups()
    if kind not in JOINT_KINDS + LINK_KINDS:
        raise unknown_name("kind of damage", kind, JOINT_KINDS + LINK_KINDS, where=f"damage {text!r}")
    if int(at) < 1:
        raise BadInput("movements are counted from 1", where=f"damage {text!r}", remedy="give a number above 0")
    amount, unit = _amount(kind, written, text)
    return Damage(kind, part.strip(), amount, int(at), unit)


def _amount(kind: str, written: str | None, text: str) -> tuple[float, str]:
    """The amount in SI units, and the unit that was written, or goes without saying."""

    def refused(what: str, remedy: str) -> BadInput:
        return BadInput(what, where=f"damage {text!r}", remedy=remedy)

    if kind == "lock":
        if written is not None:
            raise refused("a lock has no amount", "leave it out: the joint stays where it stands")
        return 0.0, ""
    match = re.fullmatch(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)\s*([a-z]*)", (written or "").strip())
    if match is None or match[2] not in ("", *_UNITS):
        raise refused(f"{written or 'nothing'} is no amount", _EXAMPLE)
    unit, scale = _UNITS.get(match[2], ("", 1.0))
    amount = scale * float(match[1])
    if kind == "weaken" and (unit or not 0 < amount < 1):
        raise refused("a weakened joint moves less, and moves", "give what remains of its motion, between 0 and 1")
    if kind in LINK_KINDS and (unit == "rad" or not 0 < abs(amount) <= 10):
        raise refused("a link changes by a length up to 10 m", "give it in m, cm or mm")
    if kind == "slip" and not 0 < abs(amount) <= 10:
        raise refused("a slip of that size makes no sense", "give it in rad or deg, or for a sliding joint in m or cm")
    return amount, "m" if kind in LINK_KINDS else unit
