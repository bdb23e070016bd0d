"""The walking pattern without a body: intervals of a plan become rows of a trajectory (Huber 2019, section 2.1.3).

The centre of mass follows by linear time-stepping at the command period (2.29). A sole swings from the end of the
double support that opens a step; along, across and yaw are fitted anew at every iteration from where the sole is then.
As in the author's program it arrives 5 % of the single support early and waits, still coming down. Unlike there it
lifts off when the double support ends: that program, by a rounding, one sample later, with a jump in height.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.robots.gait import Gait
from toddle.signals import Circle, Velocity
from toddle.walk.pattern.plan import Interval, Pattern, com_at_start, standing
from toddle.walk.pattern.swing import evaluate, quartic, quintic
from toddle.walk.pattern.time_stepping import advance, zero_moment_point

EARLY = 0.05
"""Part of the single support by which a sole arrives before it must carry."""

_AXES = ("x", "y", "z", "yaw")


@dataclass(frozen=True)
class Trajectory:
    """A walking pattern, one row each command period.

    Attributes:
        t: time [s].
        com: x, y, z of the centre of mass and the mean yaw of the soles; position, velocity, acceleration [m, rad, s].
        zmp: x, y of the zero moment point [m].
        feet: x, y, z, yaw of left and right sole; position, velocity, acceleration [m, rad, s].
        intervals: one for each iteration.
    """

    t: Float[np.ndarray, " rows"]
    com: Float[np.ndarray, "rows 3 4"]
    zmp: Float[np.ndarray, "rows 2"]
    feet: Float[np.ndarray, "rows 3 2 4"]
    intervals: tuple[Interval, ...]

    def columns(self) -> dict[str, np.ndarray]:
        """By name, in a table's order: t, com_x, ..., com_x_velocity, ..., zmp_x, zmp_y, left_x, ..., right_yaw."""
        table = {"t": self.t}
        for order, suffix in enumerate(("", "_velocity", "_acceleration")):
            table |= {f"com_{axis}{suffix}": self.com[:, order, i] for i, axis in enumerate(_AXES)}
        table |= {f"zmp_{axis}": self.zmp[:, i] for i, axis in enumerate("xy")}
        for side, name in enumerate(("left", "right")):
            table |= {f"{name}_{axis}": self.feet[:, 0, side, i] for i, axis in enumerate(_AXES)}
        return table


def walk_pattern(
    pattern: Pattern,
    gait: Gait,
    command: Callable[[float], Velocity],
    iterations: int,
    obstacles: Sequence[Circle] = (),
) -> Trajectory:
    """Walks a pattern without a body.

    Args:
        pattern: a form of it, for the same gait.
        gait: times, heights, the soles at the start.
        command: the velocity at a time [s]; 0 is the first row, where ``gait.still`` samples of standing begin.
        iterations: of the pattern.
        obstacles: on the floor.

    Returns:
        The rows of standing, then those of each iteration.

    Raises:
        BadInput: a sample is not a whole number of command periods.
    """
    per_sample = gait.sample / gait.command_period
    if abs(per_sample - round(per_sample)) > 1e-9 * per_sample:
        raise BadInput(
            f"a sample of {gait.sample:g} s is not a whole number of periods of {gait.command_period:g} s",
            where="gait, command_period",
            remedy="give a divisor of sample",
        )
    feet = _standing_feet(gait)
    still = np.repeat(com_at_start(gait)[None], gait.still * round(per_sample), axis=0)
    motions, soles = [still], [np.repeat(feet[None], len(still), axis=0)]
    state, intervals, rows = pattern.start(), [], len(still)
    for _ in range(iterations):
        state, interval = pattern.step(state, command(rows * gait.command_period), obstacles)
        times = np.arange(round(interval.duration / gait.command_period)) * gait.command_period
        motions.append(np.stack([advance(interval.com, interval.jerk, float(t)) for t in times]))
        swung = [swing(gait, interval, feet, float(t)) for t in (*times, interval.duration)]
        soles.append(np.stack(swung[:-1]))
        feet = swung[-1]
        intervals.append(interval)
        rows += len(times)
    return _assembled(gait, np.concatenate(motions), np.concatenate(soles), tuple(intervals))


def swing(gait: Gait, interval: Interval, feet: Float[np.ndarray, "3 2 4"], t: float) -> Float[np.ndarray, "3 2 4"]:
    """Both soles at a time within an interval: position, velocity, acceleration of x, y, z, yaw [m, rad, s].

    Args:
        gait: double support, step height.
        interval: of the plan.
        feet: the same at the interval's beginning.
        t: since then [s].
    """
    now = np.zeros_like(feet)
    now[0] = feet[0]
    lift = gait.double_support - interval.elapsed
    if interval.landing is None or t < lift:
        return now
    side, x, y, yaw = interval.landing
    single = interval.elapsed + interval.left - gait.double_support
    begins, arrives = max(0.0, lift), interval.left - EARLY * single
    flat = [0, 1, 3]
    if t < arrives:
        path = quintic(np.ascontiguousarray(feet[:, side, flat]), np.array([x, y, yaw]), arrives - begins)
        now[:, side, flat] = evaluate(path, t - begins)
    elif begins < arrives:
        now[0, side, flat] = x, y, yaw
    now[:, side, 2] = evaluate(quartic(0.0, 0.0, gait.step_height, 0.0, single), min(t - lift, single))[:, 0]
    return now


def _standing_feet(gait: Gait) -> Float[np.ndarray, "3 2 4"]:
    feet = np.zeros((3, 2, 4))
    for sole in standing(gait):
        feet[0, sole.side] = sole.x, sole.y, 0.0, sole.yaw
    return feet


def _assembled(
    gait: Gait,
    motion: Float[np.ndarray, "rows 2 3"],
    feet: Float[np.ndarray, "rows 3 2 4"],
    intervals: tuple[Interval, ...],
) -> Trajectory:
    com = np.zeros((len(motion), 3, 4))
    com[:, :, :2] = motion.transpose(0, 2, 1)
    com[:, 0, 2] = gait.com_height
    com[:, :, 3] = feet[..., 3].mean(axis=2)
    t = np.arange(len(motion)) * gait.command_period
    return Trajectory(t, com, zero_moment_point(motion, gait.com_height), feet, intervals)
