"""Drives that nobody drove, for the tests of datasets: any seed gives another one."""

from __future__ import annotations

import numpy as np

from toddle.navigate.cloning.recording import Recording, RoomKey
from toddle.navigate.scenarios.rooms import SCENARIOS
from toddle.navigate.task import Outcome


def drive(seed: int = 0, looks: int = 7, things: int = 5) -> Recording:
    """Pictures are noise and flat colours, depth is whole millimetres, numbers use all their digits."""
    draw = np.random.default_rng(seed)
    picture = draw.integers(0, 256, (looks, 60, 80, 3)).astype(np.uint8)
    picture[:, :, 40:] = draw.integers(0, 256, 3).astype(np.uint8)
    depth = draw.integers(0, 65536, (looks, 60, 80)) / 1000
    depth[:, :10] = 0.0
    velocity, asked, taught, place = draw.normal(size=(4, looks, 3))
    outcome = (Outcome.WON, Outcome.COLLIDED, Outcome.FELL, Outcome.LATE)[seed % 4]
    return Recording(
        RoomKey(SCENARIOS[seed % 6], "train", "seen", seed), "expert", seed + 2**40, outcome, 0.2 * np.arange(looks),
        picture, depth.astype(np.float32), velocity, asked, taught, place, draw.normal(size=(looks, things, 3)),
        draw.integers(0, 4800, (looks, things)),
    )  # fmt: skip


def same(one: Recording, other: Recording) -> bool:
    """Bit for bit."""
    for mine, yours in zip(one, other, strict=True):
        if isinstance(mine, np.ndarray) and isinstance(yours, np.ndarray):
            if mine.dtype != yours.dtype or not np.array_equal(mine, yours):
                return False
        elif mine != yours:
            return False
    return True
