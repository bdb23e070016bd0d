"""What stands in rooms, made of boxes and cylinders; sizes vary by draw.

Each maker returns the parts in the thing's own frame; a thing's radius is that of the upright cylinder that holds them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

import numpy as np
from jaxtyping import Float

from toddle.navigate.scenarios.rooms import Part, Thing

Maker = Callable[[np.random.Generator, tuple[int, ...]], tuple[Part, ...]]
"""Makes parts of a draw and of the surfaces that the thing is covered with, the first being most of it."""

PERSON_RADIUS = 0.25
"""Of the circle that a person takes [m]."""

_SLOT = 1.5  # of a wall, for one panel at most [m]
_THIN = 0.03  # of a panel [m]
_PANELS = ((0.9, 0.0, 2.0), (1.2, 0.9, 2.0), (0.6, 0.8, 1.6), (1.0, 0.1, 0.7), (0.8, 0.3, 0.9), (1.2, 0.0, 0.1))


def stand(kind: str, parts: tuple[Part, ...], place: Float[np.ndarray, "2"], yaw: float) -> Thing:
    """A thing at its place [m], turned by yaw [rad]."""
    return Thing(kind, float(place[0]), float(place[1]), yaw, max(map(_reach, parts)), parts)


def extinguisher(draw: np.random.Generator, red: int, black: int, label: int) -> tuple[Part, ...]:
    """A red cylinder with a label, a black head, a lever and a hose with its nozzle."""
    radius, tall = draw.uniform(0.06, 0.085), draw.uniform(0.40, 0.54)
    hose = radius + 0.018
    return (
        _cylinder((0.0, 0.0), 0.02, tall, radius, red),
        _cylinder((0.0, 0.0), 0.0, 0.02, 0.9 * radius, black),
        _cylinder((0.0, 0.0), tall, tall + 0.05, 0.45 * radius, red),
        _cylinder((0.0, 0.0), tall + 0.05, tall + 0.09, 0.025, black),
        _box((-0.05, 0.0), tall + 0.09, tall + 0.11, 0.16, 0.025, black),
        _cylinder((0.0, hose), 0.45 * tall, tall + 0.08, 0.014, black),
        _cylinder((0.0, hose), 0.25 * tall, 0.45 * tall, 0.022, black),
        _cylinder((0.0, 0.0), 0.45 * tall, 0.72 * tall, radius + 0.002, label),
    )


def _chair(draw: np.random.Generator, surfaces: tuple[int, ...]) -> tuple[Part, ...]:
    side, high, back = draw.uniform(0.38, 0.46), draw.uniform(0.42, 0.48), draw.uniform(0.38, 0.50)
    half, leg = side / 2 - 0.02, surfaces[-1]
    legs = [_box((a * half, b * half), 0.0, high - 0.04, 0.035, 0.035, leg) for a in (-1, 1) for b in (-1, 1)]
    return (
        _box((0.0, 0.0), high - 0.04, high + 0.03, side, side, surfaces[0]),
        _box((-half, 0.0), high + 0.10, high + back, 0.05, side, surfaces[0]),
        _box((-half, 0.0), high + 0.03, high + 0.10, 0.04, 0.06, leg),
        *legs,
    )


def _office_chair(draw: np.random.Generator, surfaces: tuple[int, ...]) -> tuple[Part, ...]:
    side, high, back, leg = draw.uniform(0.42, 0.50), draw.uniform(0.44, 0.50), draw.uniform(0.45, 0.6), surfaces[-1]
    return (
        _box((0.0, 0.0), high - 0.04, high + 0.05, side, side, surfaces[0]),
        _box((-side / 2, 0.0), high + 0.12, high + back, 0.06, 0.9 * side, surfaces[0]),
        _box((-side / 2, 0.0), high, high + 0.12, 0.03, 0.08, leg),
        _cylinder((0.0, 0.0), 0.08, high - 0.04, 0.03, leg),
        _box((0.0, 0.0), 0.03, 0.08, 0.52, 0.06, leg),
        _box((0.0, 0.0), 0.03, 0.08, 0.06, 0.52, leg),
    )


def _carton(draw: np.random.Generator, surfaces: tuple[int, ...]) -> tuple[Part, ...]:
    a, b, tall = draw.uniform(0.25, 0.55, 3)
    return (_box((0.0, 0.0), 0.0, tall, a, b, surfaces[0]),)


def _cartons(draw: np.random.Generator, surfaces: tuple[int, ...]) -> tuple[Part, ...]:
    a, b, tall = draw.uniform(0.30, 0.50, 3)
    c, d, more = draw.uniform(0.20, 0.29, 3)
    return (
        _box((0.0, 0.0), 0.0, tall, a, b, surfaces[0]),
        _box((0.02, -0.01), tall, tall + more, c, d, surfaces[-1]),
    )


def _cabinet(draw: np.random.Generator, surfaces: tuple[int, ...]) -> tuple[Part, ...]:
    deep, wide, tall = draw.uniform(0.3, 0.5), draw.uniform(0.5, 1.0), draw.uniform(0.7, 1.9)
    knob = _box((deep / 2 + 0.01, 0.0), 0.55 * tall, 0.62 * tall, 0.02, 0.1, surfaces[-1])
    return (_box((0.0, 0.0), 0.0, tall, deep, wide, surfaces[0]), knob)


def _table(draw: np.random.Generator, surfaces: tuple[int, ...]) -> tuple[Part, ...]:
    a, b, high = draw.uniform(0.7, 1.1), draw.uniform(0.5, 0.7), draw.uniform(0.68, 0.76)
    x, y = a / 2 - 0.04, b / 2 - 0.04
    legs = [_box((s * x, t * y), 0.0, high - 0.03, 0.05, 0.05, surfaces[-1]) for s in (-1, 1) for t in (-1, 1)]
    return (_box((0.0, 0.0), high - 0.03, high, a, b, surfaces[0]), *legs)


def _bin(draw: np.random.Generator, surfaces: tuple[int, ...]) -> tuple[Part, ...]:
    return (_cylinder((0.0, 0.0), 0.0, draw.uniform(0.25, 0.6), draw.uniform(0.12, 0.2), surfaces[0]),)


def _plant(draw: np.random.Generator, surfaces: tuple[int, ...]) -> tuple[Part, ...]:
    pot, stem, crown = draw.uniform(0.2, 0.35), draw.uniform(0.1, 0.4), draw.uniform(0.3, 0.7)
    return (
        _cylinder((0.0, 0.0), 0.0, pot, draw.uniform(0.12, 0.2), surfaces[0]),
        _cylinder((0.0, 0.0), pot, pot + stem, 0.02, surfaces[-1]),
        _cylinder((0.0, 0.0), pot + stem, pot + stem + crown, draw.uniform(0.15, 0.28), surfaces[-1]),
    )


def _pillar(draw: np.random.Generator, surfaces: tuple[int, ...]) -> tuple[Part, ...]:
    half = draw.uniform(0.1, 0.18)
    if draw.random() < 0.5:
        return (_cylinder((0.0, 0.0), 0.0, 2.3, half, surfaces[0]),)
    return (_box((0.0, 0.0), 0.0, 2.3, 2 * half, 2 * half, surfaces[0]),)


def _pole(draw: np.random.Generator, surfaces: tuple[int, ...]) -> tuple[Part, ...]:
    high = draw.uniform(0.9, 1.4)
    foot = _cylinder((0.0, 0.0), 0.0, 0.03, 0.15, surfaces[0])
    return (foot, _cylinder((0.0, 0.0), 0.03, high, draw.uniform(0.03, 0.045), surfaces[0]))


def _bag(draw: np.random.Generator, surfaces: tuple[int, ...]) -> tuple[Part, ...]:
    tall = draw.uniform(0.3, 0.45)
    strap = _box((0.0, 0.0), tall, tall + 0.12, 0.02, 0.14, surfaces[-1])
    return (_box((0.0, 0.0), 0.0, tall, draw.uniform(0.14, 0.2), draw.uniform(0.26, 0.36), surfaces[0]), strap)


def person(draw: np.random.Generator, shirt: int, trousers: int, skin: int, hair: int, shoes: int) -> tuple[Part, ...]:
    """Somebody who stands, looking along x."""
    tall = draw.uniform(1.55, 1.85)
    hip, neck, apart = 0.50 * tall, 0.83 * tall, draw.uniform(0.08, 0.11)
    legs = [_cylinder((0.0, side * apart), 0.06, hip, 0.07, trousers) for side in (-1, 1)]
    feet = [_box((0.04, side * apart), 0.0, 0.06, 0.24, 0.09, shoes) for side in (-1, 1)]
    arms = [_cylinder((0.0, side * 0.205), 0.46 * tall, neck - 0.02, 0.04, shirt) for side in (-1, 1)]
    return (
        *legs,
        *feet,
        _box((0.0, 0.0), hip, neck, 0.2, 0.32, shirt),
        *arms,
        _cylinder((0.0, 0.0), neck, 0.86 * tall, 0.05, skin),
        _cylinder((0.0, 0.0), 0.86 * tall, 0.96 * tall, 0.085, skin),
        _cylinder((0.0, 0.0), 0.96 * tall, tall, 0.09, hair),
    )


FURNITURE: dict[str, Maker] = {
    "chair": _chair,
    "office chair": _office_chair,
    "carton": _carton,
    "cartons": _cartons,
    "cabinet": _cabinet,
    "table": _table,
    "bin": _bin,
    "plant": _plant,
    "pillar": _pillar,
}
"""What stands around."""

OBSTACLES: tuple[str, ...] = ("chair", "office chair", "carton", "cartons", "bin")
"""What may stand in the way: low enough that the target is seen beyond it from aside."""

DECOYS: dict[str, Maker] = {"bin": _bin, "carton": _carton, "chair": _chair, "pole": _pole, "bag": _bag}
"""What may have the target's colour, but not its shape."""


def panels(draw: np.random.Generator, half: tuple[float, float], surfaces: tuple[int, ...]) -> tuple[Part, ...]:
    """Doors, windows, posters, radiators on the four walls of a hall, in its frame; about half of the wall is bare.

    Args:
        draw: random.
        half: half of the hall's length and width [m].
        surfaces: those that they may have.
    """
    found = []
    for wall in range(4):
        along, off, side = half[1 - wall // 2], half[wall // 2], 1.0 - 2.0 * (wall % 2)
        slots = int(2 * along / _SLOT)
        for slot in range(slots):
            wide, low, high = _PANELS[int(draw.integers(len(_PANELS)))]
            at = (slot + 0.5) * 2 * along / slots - along + draw.uniform(-0.1, 0.1)
            surface = surfaces[int(draw.integers(len(surfaces)))]
            if draw.random() < 0.5:
                continue
            place, thin = side * (off - _THIN / 2), (_THIN, wide) if wall < 2 else (wide, _THIN)
            found.append(_box((place, at) if wall < 2 else (at, place), low, high, *thin, surface))
    return tuple(found)


def _box(at: tuple[float, float], low: float, high: float, along: float, across: float, surface: int) -> Part:
    return _part("box", at, low, high, along / 2, across / 2, surface)


def _cylinder(at: tuple[float, float], low: float, high: float, radius: float, surface: int) -> Part:
    return _part("cylinder", at, low, high, radius, radius, surface)


def _part(
    shape: Literal["box", "cylinder"],
    at: tuple[float, float],
    low: float,
    high: float,
    a: float,
    b: float,
    surface: int,
) -> Part:
    middle = (float(at[0]), float(at[1]), float((low + high) / 2))
    return Part(shape, middle, (float(a), float(b), float((high - low) / 2)), surface)


def _reach(part: Part) -> float:
    x, y, _ = part.middle
    if part.shape == "cylinder":
        return math.hypot(x, y) + part.half[0]
    return math.hypot(abs(x) + part.half[0], abs(y) + part.half[1])
