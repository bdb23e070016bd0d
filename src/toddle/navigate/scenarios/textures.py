"""Textures made of numbers: no picture file is read. Each repeats without a seam."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float, UInt8

from toddle.failures import unknown_name
from toddle.navigate.scenarios.rooms import Surface

SIZE = 128
"""Side of a texture [texels]."""

_OCTAVES = (4, 8, 16, 32, 64, 128)


def texture(surface: Surface, size: int = SIZE) -> UInt8[np.ndarray, "{size} {size} 3"]:
    """A square of a surface.

    Args:
        surface: which.
        size: its side [texels], a power of 2.

    Raises:
        BadInput: there is no such pattern.
    """
    if surface.pattern not in PATTERNS:
        raise unknown_name("pattern", surface.pattern, list(PATTERNS), where="surface")
    draw = np.random.default_rng([surface.seed, 11])
    share = np.clip(PATTERNS[surface.pattern](size, draw), 0.0, 1.0)[..., None]
    colours = (1 - share) * np.array(surface.colour) + share * np.array(surface.second)
    grain = 1.0 + surface.grain * clouds(size, draw, roughness=0.75)[..., None]
    return np.rint(255 * np.clip(colours * grain, 0.0, 1.0)).astype(np.uint8)


def clouds(size: int, draw: np.random.Generator, roughness: float = 0.5) -> Float[np.ndarray, "{size} {size}"]:
    """Noise of several scales with mean 0 and deviation 1; each finer scale is weaker by ``roughness``."""
    total = np.zeros((size, size))
    for octave, cells in enumerate(cells for cells in _OCTAVES if cells <= size):
        total += roughness**octave * _spread(draw.standard_normal((cells, cells)), size)
    return (total - total.mean()) / total.std()


def _spread(coarse: Float[np.ndarray, "cells cells"], size: int) -> Float[np.ndarray, "{size} {size}"]:
    """Linear between a grid's values, from its end over to its start."""
    cells = len(coarse)
    at = np.arange(size) * cells / size
    low, share = at.astype(int), at % 1
    rows = (1 - share)[:, None] * coarse[low] + share[:, None] * coarse[(low + 1) % cells]
    return (1 - share) * rows[:, low] + share * rows[:, (low + 1) % cells]


def _plain(size: int, draw: np.random.Generator) -> Float[np.ndarray, "{size} {size}"]:
    return 0.15 * clouds(size, draw) + 0.2


def _cloudy(size: int, draw: np.random.Generator) -> Float[np.ndarray, "{size} {size}"]:
    return 0.5 + 0.3 * clouds(size, draw, roughness=0.6)


def _speckled(size: int, draw: np.random.Generator) -> Float[np.ndarray, "{size} {size}"]:
    return (clouds(size, draw, roughness=1.1) > 0.8).astype(float)


def _stripes(size: int, draw: np.random.Generator) -> Float[np.ndarray, "{size} {size}"]:
    count, width = int(draw.choice([2, 4, 8])), draw.uniform(0.15, 0.5)
    line = (np.arange(size) * count / size) % 1 < width
    return np.tile(line.astype(float), (size, 1))


def _planks(size: int, draw: np.random.Generator) -> Float[np.ndarray, "{size} {size}"]:
    """Boards of their own brightness each, along the first axis, with dark joints and a grain along them."""
    count = int(draw.choice([4, 8]))
    at = np.arange(size) * count / size
    board, inside = at.astype(int), at % 1
    shade = draw.uniform(0.0, 0.5, count)[board] + 0.5 * (np.minimum(inside, 1 - inside) < 0.5 * count / size)
    fibre = _spread(draw.standard_normal((size // 2, size // 2)), size)[: size // 16].repeat(16, axis=0)
    ends = (np.arange(size)[:, None] + draw.integers(0, size, count)[board][None]) % size < 2
    return shade[None] + 0.12 * fibre + 0.4 * ends


def _checks(size: int, draw: np.random.Generator) -> Float[np.ndarray, "{size} {size}"]:
    count = int(draw.choice([2, 4]))
    side = (np.arange(size) * count // size) % 2
    return (side[:, None] ^ side[None]).astype(float)


def _bricks(size: int, draw: np.random.Generator) -> Float[np.ndarray, "{size} {size}"]:
    rows, across = 8, 4
    at = np.arange(size) * rows / size
    row, down = at.astype(int), at % 1
    along = (np.arange(size)[None] * across / size + 0.5 * (row % 2)[:, None]) % across
    shade = draw.uniform(0.0, 0.35, (rows, across))[row[:, None], along.astype(int)]
    joint = (down[:, None] < 0.12) | (along % 1 < 0.06)
    return np.where(joint, 1.0, shade)


def _dots(size: int, draw: np.random.Generator) -> Float[np.ndarray, "{size} {size}"]:
    count, radius = int(draw.choice([4, 8])), draw.uniform(0.2, 0.35)
    at = (np.arange(size) * count / size) % 1 - 0.5
    return (np.hypot(at[:, None], at[None]) < radius).astype(float)


def _waves(size: int, draw: np.random.Generator) -> Float[np.ndarray, "{size} {size}"]:
    at = np.arange(size) / size
    bent = at[:, None] + 0.15 * np.sin(2 * np.pi * at)[None] + 0.05 * clouds(size, draw)
    return 0.5 + 0.5 * np.sin(2 * np.pi * int(draw.choice([4, 6])) * bent)


PATTERNS: dict[str, Callable[[int, np.random.Generator], Float[np.ndarray, "size size"]]] = {
    "plain": _plain,
    "cloudy": _cloudy,
    "speckled": _speckled,
    "stripes": _stripes,
    "planks": _planks,
    "checks": _checks,
    "bricks": _bricks,
    "dots": _dots,
    "waves": _waves,
}
"""Which share of each texel is the second colour."""
