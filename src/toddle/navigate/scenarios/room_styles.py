"""What rooms look like: surfaces and lights, drawn from ranges that the seen and the unseen style do not share.

Patterns, hues of walls, floors and furniture, and the brightness of the ambient light are disjoint. The target is red
in both, or it would be another task; skin, metal and rubber are what they are.
"""

from __future__ import annotations

import colorsys
import math
from dataclasses import dataclass

import numpy as np

from toddle.navigate.scenarios.rooms import Colour, Light, Style, Surface


@dataclass(frozen=True)
class Ranges:
    """Of a style.

    Attributes:
        walls: patterns of walls.
        floors: patterns of floors.
        furniture: patterns of furniture and clothes.
        hues: bands of hue, from 0 to 1.
        saturation: of walls, floors and furniture, least and most; clothes and furniture may have twice as much.
        ambient: brightness of the light from everywhere.
        lamps: brightness of the directed light, in all.
        grain: of surfaces.
    """

    walls: tuple[str, ...]
    floors: tuple[str, ...]
    furniture: tuple[str, ...]
    hues: tuple[tuple[float, float], ...]
    saturation: tuple[float, float]
    ambient: tuple[float, float]
    lamps: tuple[float, float]
    grain: tuple[float, float]


RANGES: dict[Style, Ranges] = {
    "seen": Ranges(
        walls=("plain", "cloudy", "stripes", "speckled"),
        floors=("cloudy", "planks", "checks", "speckled"),
        furniture=("plain", "cloudy", "planks", "checks"),
        hues=((0.07, 0.16), (0.50, 0.68)),
        saturation=(0.02, 0.35),
        ambient=(0.48, 0.72),
        lamps=(0.30, 0.60),
        grain=(0.02, 0.10),
    ),
    "unseen": Ranges(
        walls=("bricks", "waves"),
        floors=("bricks", "dots"),
        furniture=("dots", "waves"),
        hues=((0.22, 0.42), (0.72, 0.86)),
        saturation=(0.12, 0.45),
        ambient=(0.30, 0.44),
        lamps=(0.35, 0.80),
        grain=(0.03, 0.12),
    ),
}
"""Of each style."""

RED = (-0.02, 0.02)
"""Hues of the target and its decoys."""

FLOOR, CEILING, WALL, ACCENT, RED_PAINT, BLACK, LABEL, METAL, SKIN, HAIR, SHOES, DECOY, FURNITURE = range(13)
"""Places in a room's surfaces: those of the furniture begin at the last of these, those of the clothes after them."""

FURNITURE_SURFACES = 4
CLOTHES_SURFACES = 4


def furniture_surface(number: int) -> int:
    """The place of a surface of the furniture."""
    return FURNITURE + number


def clothes_surface(number: int) -> int:
    """The place of a surface of the clothes."""
    return FURNITURE + FURNITURE_SURFACES + number


def surfaces(draw: np.random.Generator, style: Style) -> tuple[Surface, ...]:
    """Everything that a room is covered with."""
    ranges = RANGES[style]
    some = [_coloured(draw, ranges, ranges.furniture, (0.25, 0.85), (0.3, 0.8)) for _ in range(FURNITURE_SURFACES)]
    worn = [_coloured(draw, ranges, ranges.furniture, (0.15, 0.8), (0.2, 0.5)) for _ in range(CLOTHES_SURFACES)]
    return (
        _coloured(draw, ranges, ranges.floors, (0.45, 0.85), (0.6, 1.6)),
        _fixed(draw, (0.0, 1.0), (0.0, 0.04), (0.85, 0.95)),
        _coloured(draw, ranges, ranges.walls, (0.6, 0.95), (0.8, 2.4)),
        _coloured(draw, ranges, ranges.walls, (0.55, 0.95), (0.8, 2.4)),
        _fixed(draw, RED, (0.80, 0.95), (0.62, 0.85), grain=0.03),
        _fixed(draw, (0.0, 1.0), (0.0, 0.1), (0.06, 0.14)),
        _fixed(draw, (0.10, 0.16), (0.0, 0.25), (0.8, 0.95), pattern="checks", tile=0.1),
        _fixed(draw, (0.55, 0.65), (0.0, 0.1), (0.15, 0.5)),
        _fixed(draw, (0.05, 0.08), (0.3, 0.55), (0.35, 0.9)),
        _fixed(draw, (0.05, 0.12), (0.2, 0.7), (0.08, 0.5)),
        _fixed(draw, (0.55, 0.65), (0.0, 0.2), (0.08, 0.3)),
        _fixed(draw, RED, (0.75, 0.95), (0.55, 0.85), grain=float(draw.uniform(0.02, 0.1))),
        *some,
        *worn,
    )


def light(draw: np.random.Generator, style: Style) -> Light:
    """One or two lamps or windows, warm or cold."""
    ranges, count = RANGES[style], int(draw.integers(1, 3))
    share = draw.dirichlet([2.0] * count) * draw.uniform(*ranges.lamps)
    directions, colours = [], []
    for strength in share.tolist():
        tilt, towards = draw.uniform(0.15, 1.1), draw.uniform(-math.pi, math.pi)
        level = math.sin(tilt)
        directions.append((level * math.cos(towards), level * math.sin(towards), -math.cos(tilt)))
        colours.append(_tinted(draw, strength))
    return Light(_tinted(draw, float(draw.uniform(*ranges.ambient))), tuple(directions), tuple(colours))


def _tinted(draw: np.random.Generator, strength: float) -> Colour:
    """Light between that of a lamp and that of the sky; its green is ``strength``."""
    warm = float(draw.uniform(-0.08, 0.12))
    return strength * (1 + warm), strength, strength * (1 - warm)


def _coloured(
    draw: np.random.Generator,
    ranges: Ranges,
    patterns: tuple[str, ...],
    value: tuple[float, float],
    tile: tuple[float, float],
) -> Surface:
    low, high = ranges.hues[int(draw.integers(len(ranges.hues)))]
    hue, saturation, bright = draw.uniform(low, high), draw.uniform(*ranges.saturation), draw.uniform(*value)
    second = _rgb(draw.uniform(low, high), draw.uniform(*ranges.saturation), bright * draw.uniform(0.65, 0.92))
    return Surface(
        str(draw.choice(patterns)),
        _rgb(hue, saturation, bright),
        second,
        float(draw.uniform(*tile)),
        float(draw.uniform(*ranges.grain)),
        int(draw.integers(2**31)),
    )


def _fixed(
    draw: np.random.Generator,
    hue: tuple[float, float],
    saturation: tuple[float, float],
    value: tuple[float, float],
    *,
    pattern: str = "plain",
    tile: float = 0.5,
    grain: float = 0.05,
) -> Surface:
    colour = draw.uniform(*hue) % 1, draw.uniform(*saturation), draw.uniform(*value)
    second = _rgb(colour[0], colour[1], 0.8 * colour[2])
    return Surface(pattern, _rgb(*colour), second, tile, grain, int(draw.integers(2**31)))


def _rgb(hue: float, saturation: float, value: float) -> Colour:
    red, green, blue = colorsys.hsv_to_rgb(float(hue), float(saturation), float(value))
    return float(red), float(green), float(blue)
