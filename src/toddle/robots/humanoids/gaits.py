"""The gaits of named humanoids: Huber 2019, tables 3.1 and 3.2, and ours."""

from __future__ import annotations

from collections.abc import Mapping

from toddle.robots.gait import Gait
from toddle.signals import Velocity

_HEICUB = Gait(
    com_height=0.475,
    foot_distance=0.14,
    foot_length=0.18,
    foot_width=0.095,
    foot_ahead=0.0315,
    step_time=0.6,
    double_support=0.12,
    step_height=0.02,
    margin=(0.02, 0.02),
    hull=((-0.24, 0.12), (-0.24, 0.30), (0.24, 0.30), (0.24, 0.12)),
    fastest=Velocity(0.3, 0.1, 0.3),
)
_HEICUB_DOCUMENT = Gait(
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
    hull=((-0.11, 0.14), (-0.10, 0.16), (0.0, 0.17), (0.10, 0.16), (0.11, 0.14)),
    longest_turn=0.09,
    fastest_turn=0.22,
    fastest=Velocity(0.15, 0.02, 0.2),
    start=(0.0, 0.05),
    objective=(1.0, 1e2, 1e-2),
)
_HRP2 = Gait(
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
    hull=((-0.28, 0.2), (-0.20, 0.3), (0.0, 0.4), (0.20, 0.3), (0.28, 0.2)),
    longest_turn=0.09,
    fastest_turn=0.22,
    fastest=Velocity(0.3, 0.3, 0.3),
    command_period=0.005,
    still=10,
    start=(0.00949035, 0.095),
    first=(0.00949035, 0.095),
    objective=(1.0, 1e-6, 1e-5),
)

DEFAULT: Mapping[str, Gait] = {"heicub": _HEICUB, "hrp2": _HRP2}
DOCUMENT: Mapping[str, Gait] = {"heicub": _HEICUB_DOCUMENT, "hrp2": _HRP2}
