"""The two gaits that Huber 2019 gives, and how a compressed column file is read."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np

from toddle.robots.gait import Gait

DATA = Path(__file__).parent / "data"

HRP2 = Gait(
    com_height=0.814,
    foot_distance=0.2,
    foot_length=0.2172,
    foot_width=0.138,
    step_time=0.8,
    double_support=0.1,
    sample=0.1,
    preview=16,
    steps=2,
    step_height=0.05,
    margin=(0.09, 0.05),
    hull=((-0.28, 0.2), (-0.2, 0.3), (0.0, 0.4), (0.2, 0.3), (0.28, 0.2)),
    longest_turn=0.09,
    fastest_turn=0.22,
    command_period=0.005,
    still=10,
    start=(0.00949035, 0.095),
    first=(0.00949035, 0.095),
    objective=(1.0, 1e-6, 1e-5),
)

HEICUB = Gait(
    com_height=0.45,
    foot_distance=0.14,
    foot_length=0.2,
    foot_width=0.1,
    step_time=3.2,
    double_support=1.6,
    sample=0.4,
    preview=16,
    steps=2,
    step_height=0.03,
    margin=(0.02, 0.02),
    hull=((-0.11, 0.14), (-0.1, 0.16), (0.0, 0.17), (0.1, 0.16), (0.11, 0.14)),
    longest_turn=0.09,
    fastest_turn=0.22,
    command_period=0.01,
    start=(0.0, 0.05),
    objective=(1.0, 1e2, 1e-2),
)


def columns(name: str) -> dict[str, np.ndarray]:
    """The columns of a file in the data folder."""
    lines = gzip.decompress((DATA / name).read_bytes()).decode().splitlines()
    table = np.array([[float(number) for number in line.split(",")] for line in lines[1:]])
    return dict(zip(lines[0].split(","), table.T, strict=True))
