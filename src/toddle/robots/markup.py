"""Reading a stranger's XML: size, entities and nonsense are refused before anything looks inside."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

import defusedxml.ElementTree
from defusedxml.common import DefusedXmlException

from toddle.failures import BadInput

MAX_BYTES = 20_000_000
LARGEST = 1e6  # [m or rad] no arm is larger, and single precision could not compute it


def read_bytes(path: Path) -> bytes:
    """The whole of a robot's description file.

    Raises:
        BadInput: there is no such file, it is a folder, empty, too large, or not readable.
    """
    where = str(path)
    try:
        if path.is_dir():
            raise BadInput("this is a folder", where=where, remedy="name a .urdf or .xml file in it")
        if not path.is_file():
            raise BadInput("no such file", where=where, remedy="check the path")
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise BadInput(
                f"the file has {size / 1e6:.0f} MB, more than {MAX_BYTES / 1e6:.0f}",
                where=where,
                remedy="a robot's description is smaller: name that file, not a mesh",
            )
        text = path.read_bytes()
    except OSError as error:
        raise BadInput(
            f"the file can't be read: {error.strerror}", where=where, remedy="check the path and its rights"
        ) from None
    if not text.strip():
        raise BadInput("the file is empty", where=where, remedy="name a URDF or MJCF file")
    return text


def parse(text: bytes, where: str) -> Element:
    """The root element of an XML document.

    Raises:
        BadInput: it is not XML, or it declares a document type or entities (which can be a bomb).
    """
    try:
        return defusedxml.ElementTree.fromstring(text, forbid_dtd=True)
    except DefusedXmlException:
        raise BadInput(
            "the file declares a document type or entities, which are refused",
            where=where,
            remedy="remove its <!DOCTYPE ...> part",
        ) from None
    except (ParseError, ValueError, LookupError, RecursionError) as error:
        raise BadInput(f"this is not XML: {error}", where=where, remedy="name a URDF or MJCF file") from None


def values(element: Element, attribute: str, where: str) -> tuple[float, ...]:
    """The numbers of an attribute; none where it is absent.

    Raises:
        BadInput: one is not a finite number, or too large for any robot.
    """
    text = element.get(attribute, "")
    return tuple(_finite(word, _spot(where, attribute, text)) for word in text.split())


def numbers(element: Element, attribute: str, default: tuple[float, ...], where: str) -> tuple[float, ...]:
    """The numbers of an attribute, as many as its default has; the default where it is absent.

    Raises:
        BadInput: there are more or fewer, or one is not a finite number.
    """
    if attribute not in element.keys():  # noqa: SIM118 (an Element iterates over its children)
        return default
    found = values(element, attribute, where)
    if len(found) != len(default):
        spot = _spot(where, attribute, element.get(attribute, ""))
        raise BadInput(f"it has {len(found)} numbers", where=spot, remedy=f"give {len(default)}")
    return found


def number(element: Element, attribute: str, default: float, where: str) -> float:
    """The one number of an attribute; see `numbers`."""
    return numbers(element, attribute, (default,), where)[0]


def _spot(where: str, attribute: str, text: str) -> str:
    return f"{where}, {attribute}={text[:60]!r}"


def _finite(word: str, where: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in word:  # 1_0 is a number to Python only
        raise BadInput(f"{word[:40]!r} is not a finite number", where=where, remedy="write it in plain decimals")
    if abs(value) > LARGEST:
        raise BadInput(f"{word[:40]!r} is too large", where=where, remedy=f"give less than {LARGEST:g} m or rad")
    return value
