"""Small networks and a few drives, for the tests of learning by watching."""

from __future__ import annotations

from dataclasses import replace

from drives import drive

from toddle.navigate.cloning.config import CloningConfig, document
from toddle.navigate.cloning.episodes import Episode, episode

LIGHT = replace(CloningConfig(), channels=(4, 4, 4), hidden=8, units=6, streams=2, steps=4, passes=80)
DOCUMENT = replace(document(), channels=(2, 2, 2), hidden=4, units=3, streams=2, steps=5, passes=100)
NETWORKS = {"light": LIGHT, "document": DOCUMENT}


def episodes(count: int = 4) -> tuple[Episode, ...]:
    """Of 5 to 9 looks, velocities mostly within what can be asked for."""
    drives = (drive(seed, looks=5 + seed % 5) for seed in range(count))
    return tuple(episode(one._replace(taught=0.1 * one.taught, velocity=0.1 * one.velocity)) for one in drives)
