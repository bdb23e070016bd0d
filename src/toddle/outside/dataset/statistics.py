"""Least, greatest, mean and standard deviation of a dataset's columns, in the shapes that LeRobot expects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from toddle.navigate.cloning.recording import Recording
from toddle.outside.dataset import layout
from toddle.outside.dataset.pictures import millimetres

Statistics = Mapping[str, Mapping[str, Any]]
"""Of each column: min, max, mean, std and count, as lists."""


def statistics(recording: Recording) -> Statistics:
    """Of one episode: of pictures by channel, from 0 to 1; of depth in millimetres."""
    looks = len(recording.t)
    return {
        layout.PICTURE: _of(recording.picture.reshape(-1, 3) / 255.0, (3, 1, 1), looks),
        layout.DEPTH: _of(millimetres(recording.depth).reshape(-1, 1).astype(float), (1, 1, 1), looks),
        layout.STATE: _of(np.asarray(recording.velocity, float), (3,), looks),
        layout.ACTION: _of(np.asarray(recording.asked, float), (3,), looks),
        layout.TAUGHT: _of(np.asarray(recording.taught, float), (3,), looks),
    }


def _of(rows: Float[np.ndarray, "rows numbers"], shape: tuple[int, ...], looks: int) -> dict[str, Any]:
    found = {"min": rows.min(axis=0), "max": rows.max(axis=0), "mean": rows.mean(axis=0), "std": rows.std(axis=0)}
    return {**{name: value.reshape(shape).tolist() for name, value in found.items()}, "count": [looks]}


def together(parts: Sequence[Statistics]) -> Statistics:
    """Of all episodes, from those of each."""
    return {column: _joined([part[column] for part in parts]) for column in parts[0]}


def _joined(parts: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    low, high, mean, std = (np.array([part[name] for part in parts]) for name in ("min", "max", "mean", "std"))
    count = np.array([part["count"][0] for part in parts], float)
    share = (count / count.sum()).reshape(-1, *[1] * (mean.ndim - 1))
    middle = (share * mean).sum(axis=0)
    variance = (share * (std**2 + (mean - middle) ** 2)).sum(axis=0)
    found = {"min": low.min(axis=0), "max": high.max(axis=0), "mean": middle, "std": np.sqrt(variance)}
    return {**{name: value.tolist() for name, value in found.items()}, "count": [int(count.sum())]}
