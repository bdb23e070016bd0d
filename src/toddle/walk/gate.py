"""The safety gate: every velocity command passes it, whoever gave it.

Caps, rate limits and a dead-man's timeout. What comes out is finite, within the gait's range, and never jumps.
"""

from __future__ import annotations

import math

from toddle.signals import STILL, Velocity

ACCELERATION = 0.3
"""The fastest that a commanded velocity changes [m/s^2]; a choice of ours."""

TURNING = 0.6
"""The fastest that a commanded yaw rate changes [rad/s^2]; a choice of ours."""

BACKWARDS = 0.4
"""Share of the fastest walk ahead that is allowed backwards, where the soles reach less far: measured on heicub, which
falls at two thirds."""

SILENCE = 0.5
"""After so long without a word from whoever commands, the robot stops [s]."""


def gate(
    last: Velocity, asked: Velocity, fastest: Velocity, dt: float, *, silence: float = 0.0, limited: bool = True
) -> Velocity:
    """The velocity that is passed on.

    Args:
        last: what was passed on the tick before.
        asked: what is asked now [m/s, m/s, rad/s]; a number that isn't finite asks to stand.
        fastest: the greatest velocity ahead, aside and turning; `BACKWARDS` of it backwards.
        dt: time since ``last`` [s].
        silence: how long nothing was heard from whoever commands [s]; above `SILENCE` the robot stops.
        limited: whether changes are limited to `ACCELERATION` and `TURNING`.
    """
    heard = silence <= SILENCE and all(map(math.isfinite, asked))
    wanted = _allowed(asked, fastest) if heard else STILL
    if not limited:
        return wanted
    rates = (ACCELERATION, ACCELERATION, TURNING)
    return Velocity(*(_towards(*numbers, dt) for numbers in zip(last, wanted, rates, strict=True)))


def _allowed(asked: Velocity, fastest: Velocity) -> Velocity:
    """The command within its range: each part capped, backwards lower, ahead and aside together within an ellipse."""
    vx, vy, omega = map(_within, asked, fastest)
    vx = max(vx, -BACKWARDS * fastest.vx)
    most = fastest.vx if vx > 0 else BACKWARDS * fastest.vx
    far = math.hypot(vx / most if most else 0.0, vy / fastest.vy if fastest.vy else 0.0)
    share = 1.0 if far <= 1 else 1 / far
    return Velocity(share * vx, share * vy, omega)


def _within(asked: float, most: float) -> float:
    return min(max(asked, -most), most)


def _towards(last: float, wanted: float, rate: float, dt: float) -> float:
    return last + _within(wanted - last, rate * dt)
