"""Configuration files of humanoids (TOML), and where a humanoid's description lies."""

from __future__ import annotations

import math
import os
import tomllib
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from toddle.failures import BadInput, unknown_name
from toddle.robots.catalogue import HUMANOIDS
from toddle.robots.humanoids.settings import Settings

MODEL = "model"
"""The key that names the description, relative to the configuration file."""

_MAX_BYTES = 1_000_000


def found(spec: str, config: Path | None) -> tuple[Path, Settings]:
    """The description that was asked for, and what is said of it.

    Args:
        spec: a catalogue's name, or a file.
        config: a configuration file.

    Raises:
        BadInput: there is no such humanoid or file, or a key is wrong.
    """
    if spec in HUMANOIDS:
        build = HUMANOIDS[spec].build
        if build is None:
            raise BadInput(
                "it is a gait alone, without a body", where=spec, remedy="add --pattern-only, or name another robot"
            )
        path, known = build()
        return path, known if config is None else _overlaid(known, read_settings(config)[1])
    if Path(spec).suffix.lower() == ".toml":
        if config is not None:
            raise BadInput("two configuration files are given", where=spec, remedy="give one")
        model, said = read_settings(Path(spec))
        if model is None:
            raise BadInput(f"the key {MODEL!r} is missing", where=spec, remedy="name the URDF or MJCF file with it")
        return model, _named(said, model)
    if not (os.sep in spec or Path(spec).suffix or Path(spec).exists()):
        raise unknown_name("humanoid", spec, HUMANOIDS)
    return Path(spec), _named(Settings() if config is None else read_settings(config)[1], Path(spec))


def _named(settings: Settings, path: Path) -> Settings:
    return settings if settings.name else replace(settings, name=path.stem)


def _overlaid(known: Settings, said: Settings) -> Settings:
    """What is known, but for what is said."""
    default = Settings()
    changes = {
        field.name: getattr(said, field.name)
        for field in fields(Settings)
        if getattr(said, field.name) != getattr(default, field.name)
    }
    return replace(known, **changes)


def read_settings(path: Path) -> tuple[Path | None, Settings]:
    """The description that a configuration file names, if it does, and what it says of the robot.

    Raises:
        BadInput: the file can't be read, a key is not known, or its value is of the wrong kind.
    """
    table = _table(path)
    model = table.pop(MODEL, None)
    if model is not None:
        model = path.parent / _text(model, f"{path}: {MODEL}")
    said = {key: _read(key, value, path) for key, value in table.items()}
    return model, Settings(**said)


def _table(path: Path) -> dict[str, Any]:
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise BadInput("the file is too large", where=str(path), remedy="name a configuration file (.toml)")
        return tomllib.loads(path.read_bytes().decode())
    except OSError as error:
        raise BadInput(
            f"the file can't be read: {error.strerror}", where=str(path), remedy="check the path and its rights"
        ) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise BadInput(
            f"this is not TOML: {error}", where=str(path), remedy="write lines such as step_time = 0.6"
        ) from None


def _read(key: str, value: object, path: Path) -> Any:
    if key not in _READERS:
        raise unknown_name("key", key, [*_READERS, MODEL], where=str(path))
    return _READERS[key](value, f"{path}: {key}")


def _text(value: object, where: str) -> str:
    if not isinstance(value, str) or not value:
        raise BadInput(f"{value!r} is not a name", where=where, remedy='write it in quotes, such as "l_foot"')
    return value


def _texts(value: object, where: str) -> tuple[str, ...]:
    if not isinstance(value, list):
        raise BadInput(f"{value!r} is not a list", where=where, remedy='write names in brackets, such as ["head"]')
    return tuple(_text(name, where) for name in value)


def _any(value: object, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise BadInput(f"{value!r} is not a finite number", where=where, remedy="write a number")
    return float(value)


def _positive(value: object, where: str) -> float:
    number = _any(value, where)
    if number <= 0:
        raise BadInput(f"{number:g} is not above 0", where=where, remedy="write a number above 0")
    return number


def _count(value: object, where: str) -> int:
    number = _positive(value, where)
    if number != int(number):
        raise BadInput(f"{number:g} is not a whole number", where=where, remedy="write a whole number")
    return int(number)


def _some(count: int) -> Callable[[object, str], tuple[float, ...]]:
    def read(value: object, where: str) -> tuple[float, ...]:
        if not isinstance(value, list) or len(value) != count:
            raise BadInput(f"{value!r} is not a list of {count} numbers", where=where, remedy="write them in brackets")
        return tuple(_any(number, where) for number in value)

    return read


def _corners(value: object, where: str) -> tuple[tuple[float, ...], ...]:
    if not isinstance(value, list) or len(value) < 3:
        raise BadInput(
            f"{value!r} is not a list of three corners or more", where=where, remedy="write [[x, y], [x, y], ...]"
        )
    corners = tuple(_some(2)(corner, where) for corner in value)
    for a, b, c in zip(corners, corners[1:] + corners[:1], corners[2:] + corners[:2], strict=True):
        if (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]) > 1e-12:
            raise BadInput(
                "its corners do not turn clockwise", where=where, remedy="begin at the rear inner one, then outward"
            )
    return corners


_READERS: dict[str, Callable[[object, str], Any]] = {
    **dict.fromkeys(("name", "base", "left_foot", "right_foot", "waist", "chest", "imu", "forward"), _text),
    **dict.fromkeys(("without", "moves", "held", "welded"), _texts),
    **dict.fromkeys(("sole_length", "sole_width", "sole_depth", "foot_distance", "com_height", "step_time"), _positive),
    **dict.fromkeys(("step_height", "longest_turn", "fastest_turn", "sample", "stiffness", "effort"), _positive),
    **dict.fromkeys(("sole_ahead", "double_support", "damping", "reflected"), _any),
    **dict.fromkeys(("preview", "steps"), _count),
    "margin": _some(2),
    "hull": _corners,
    "fastest": _some(3),
}
