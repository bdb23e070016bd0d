"""How a humanoid steps: the numbers that a walking pattern needs, whether or not there is a body.

Every length is in a sole's frame: x ahead, y to the left, the origin under the ankle, z = 0 the floor. The names in
brackets are those of Huber 2019, table 3.1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from toddle.failures import BadInput
from toddle.signals import Velocity

GRAVITY = 9.81
"""Acceleration of the walking pattern [m/s^2]."""

_FASTEST = Velocity(0.3, 0.1, 0.3)


@dataclass(frozen=True)
class Gait:
    """One way of walking.

    Attributes:
        com_height: height of the centre of mass over the floor [m] (h).
        foot_distance: between the soles' origins, standing [m].
        foot_length: of a sole [m].
        foot_width: of a sole [m].
        foot_ahead: of the sole's middle before its origin [m].
        step_time: of one step, double support included [s] (t_step).
        double_support: the part of a step in which both feet carry [s] (t_ds).
        sample: of the preview [s] (t).
        preview: samples looked ahead (N).
        steps: footsteps looked ahead (N_f).
        step_height: of the swing foot [m].
        margin: kept between the zero moment point and the sole's edges, ahead and aside [m].
        hull: where the left sole may land, seen from the right one: corners x, y [m], clockwise from the
            rear inner one; mirrored for the right sole.
        longest_turn: between the yaws of two feet [rad].
        fastest_turn: between the yaw rates of two feet [rad/s].
        fastest: the greatest velocity that may be commanded, each way [m/s, m/s, rad/s].
        command_period: of the trajectory [s].
        still: periods of standing before the first step, each of ``sample`` (n_still).
        start: x, y of the centre of mass at the start [m]; None: between the feet.
        first: x, y of the left sole at the start [m]; None: 0 and half of ``foot_distance``.
        objective: alpha, beta, gamma of Huber 2019, equations 2.43 to 2.46; the document's, for this gait.
    """

    com_height: float
    foot_distance: float
    foot_length: float
    foot_width: float
    foot_ahead: float = 0.0
    step_time: float = 0.6
    double_support: float = 0.12
    sample: float = 0.1
    preview: int = 16
    steps: int = 3
    step_height: float = 0.02
    margin: tuple[float, float] = (0.02, 0.02)
    hull: tuple[tuple[float, float], ...] = ()
    longest_turn: float = 0.4
    fastest_turn: float = 0.8
    fastest: Velocity = _FASTEST
    command_period: float = 0.01
    still: int = 0
    start: tuple[float, float] | None = None
    first: tuple[float, float] | None = None
    objective: tuple[float, float, float] = (1.0, 1e2, 1e-2)

    def __post_init__(self) -> None:
        """Refuses what nothing can walk by.

        Raises:
            BadInput: a number that is not finite, negative, or contradicts another.
        """
        for field in fields(self):
            value = getattr(self, field.name)
            flat = [value] if isinstance(value, int | float) else _numbers(value)
            if not all(math.isfinite(number) for number in flat):
                raise _bad(field.name, value, "give finite numbers")
        for name in (
            "com_height",
            "foot_distance",
            "foot_length",
            "foot_width",
            "step_time",
            "sample",
            "command_period",
        ):
            if getattr(self, name) <= 0:
                raise _bad(name, getattr(self, name), "give a number above 0")
        if not 0 <= self.double_support < self.step_time:
            raise _bad("double_support", self.double_support, f"it must be under step_time, {self.step_time:g} s")
        if self.preview < 2 or self.steps < 1:
            raise _bad("preview", self.preview, "give at least two samples and one step")
        if 2 * self.margin[0] >= self.foot_length or 2 * self.margin[1] >= self.foot_width:
            raise _bad("margin", self.margin, "it must leave a part of the sole")

    @property
    def omega(self) -> float:
        """Natural frequency of the linear inverted pendulum [rad/s]."""
        return math.sqrt(GRAVITY / self.com_height)


def _numbers(value: object) -> list[float]:
    if value is None:
        return []
    if isinstance(value, int | float):
        return [float(value)]
    return [number for part in value for number in _numbers(part)]  # type: ignore[attr-defined]


def _bad(name: str, value: object, remedy: str) -> BadInput:
    return BadInput(f"{value} is no use", where=f"gait, {name}", remedy=remedy)
