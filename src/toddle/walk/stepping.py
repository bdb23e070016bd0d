"""The steps: when one begins, where the next ones go, when it has landed. Pure functions of the walker's state.

STAND --command--> SHIFT --weight over--> STEP --touchdown--> STEP ... --feet side by side, no command--> STAND
  \\--pushed out of the soles--> STEP
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT, RIGHT
from toddle.signals import Velocity
from toddle.walk.balance.pendulum import Pair, Timing, offset, timing
from toddle.walk.balance.step_adjustment import Aim, Bounds
from toddle.walk.config import WalkConfig
from toddle.walk.pattern.displacement import displacements, rotate
from toddle.walk.pattern.nmpc_problem import GAP, apart
from toddle.walk.state import Landing, Pose, Step

STILL = Velocity(0.0, 0.0, 0.0)
_NEAR = 0.6  # obstacles farther than this from a landing don't matter to it [m]
_TOUCH = 0.04  # between the decision to land at once and the touchdown [s]
_CATCH_DS = 0.05  # double support of a step that catches a push while standing [s]
_SAME_PLACE = 0.015  # feet that stand side by side to within this are left as they are [m]
_SAME_YAW = 0.03  # [rad]
_PREVIEWED = 4


class Chain(NamedTuple):
    """The previewed footsteps: displacement of each from the one before [m], and what they ask of the DCM."""

    displacements: tuple[Pair, ...]
    kappa: float
    rest: Pair
    growth: float


def moving(velocity: Velocity) -> bool:
    """Whether a command asks to walk at all."""
    return max(abs(velocity.vx), abs(velocity.vy), abs(velocity.omega)) > 1e-6


def chain(gait: Gait, steps: tuple[Pair, ...], final: bool) -> Chain:
    """What the next footsteps, in the plan's frame, ask of the DCM at this one's landing.

    A final step ends with the zero moment point between the feet, and the DCM at rest there.
    """
    whole = timing(gait.omega, gait.step_time, gait.double_support)
    if final:
        return Chain(steps, whole.k / 2, (0.0, 0.0), whole.growth)
    return Chain(steps, whole.k, offset(whole, steps[1:]), whole.growth)


def by_command(gait: Gait, velocity: Velocity, stance: int, yaw: float) -> tuple[Pair, ...]:
    """The next footsteps that follow from the command alone, in the plan's frame [m]."""
    return tuple(displacements(apart(gait, velocity), gait.step_time, velocity, stance, yaw, _PREVIEWED))


def first_stance(velocity: Velocity) -> int:
    """Which foot carries first: the one that isn't on the side where the robot is going."""
    towards = velocity.vy + 0.1 * velocity.omega
    return LEFT if towards <= 0 else RIGHT


def shift_zmp(gait: Gait, xi: Pair, foot: Pair, ahead: Chain, left: float) -> Pair:
    """The zero moment point that brings the DCM to where the first step needs it in ``left`` seconds [m].

    With the point z held until then, and as the origin of the first step: E e^{w left} (xi - z) = k (foot - z) + b1.
    """
    step = timing(gait.omega, gait.step_time, gait.double_support)
    growth = step.growth * math.exp(gait.omega * left)
    b1 = [(ahead.kappa * d + r) / ahead.growth for d, r in zip(ahead.displacements[0], ahead.rest, strict=True)]
    x, y = ((growth * xi[i] - step.k * foot[i] - b1[i]) / (growth - step.k) for i in (0, 1))
    return x, y


def aim(step: Step, ahead: Chain, gait: Gait) -> Aim:
    """The planned landing in the stance foot's frame."""
    yaw = step.foot[2]
    return Aim(step.planned, gait.step_time, ahead.kappa, rotate(-yaw, ahead.rest), ahead.growth)


def bounds(step: Step, gait: Gait, config: WalkConfig) -> Bounds:
    """What the adjustment may choose."""
    side = -1.0 if step.stance == LEFT else 1.0
    reach, inner, outer = landing_box(gait)
    least, most = sorted((side * inner, side * outer))
    length, width = 0.4 * gait.foot_length, 0.4 * gait.foot_width
    earliest = config.earliest * gait.step_time / 0.6
    return Bounds(
        (-reach, least),
        (reach, most),
        earliest,
        config.latest * gait.step_time,
        (gait.foot_ahead - length, -width),
        (gait.foot_ahead + length, width),
    )


def within_reach(step: Step, limits: Bounds, foot: Float[np.ndarray, "4"], config: WalkConfig) -> Bounds:
    """The bounds, less what the swing foot can't do in the time left: come down, and go where it is to land.

    Args:
        step: under way.
        limits: of the landing.
        foot: where the swing foot is now, in the plan: x, y, z [m], yaw [rad].
        config: the swing foot's speeds.
    """
    lifts = max(step.double_support - step.phase, 0.0)
    least = max(float(foot[2]), 0.0) / config.fall_speed + _TOUCH
    earliest = max(limits.earliest, step.phase + lifts + least)
    reach = config.swing_speed * max(max(step.end, earliest) - step.phase - lifts, 0.0)
    x, y = rotate(-step.foot[2], (float(foot[0]) - step.foot[0], float(foot[1]) - step.foot[1]))
    (x0, x1), (y0, y1) = (
        _overlap(low, high, at - reach, at + reach)
        for low, high, at in zip(limits.least, limits.most, (x, y), strict=True)
    )
    return limits._replace(least=(x0, y0), most=(x1, y1), earliest=earliest, latest=max(limits.latest, earliest))


def clear_of(gait: Gait, step: Step, circles: Float[np.ndarray, "circles 3"]) -> Float[np.ndarray, "rows 3"]:
    """Rows n . D >= least that keep the landing sole off the obstacles within reach; n in the stance foot's frame.

    The sole is a box, the obstacle seen from where the landing is planned: linearised there.
    """
    rows = []
    yaw = step.foot[2] + step.turn
    ahead = rotate(yaw, (gait.foot_ahead, 0.0))
    planned = rotate(step.foot[2], step.planned)
    for x, y, radius in circles.tolist():
        from_x, from_y = step.foot[0] + ahead[0] - x, step.foot[1] + ahead[1] - y
        away = math.hypot(from_x + planned[0], from_y + planned[1])
        if not 0 < away < radius + _NEAR:
            continue
        nx, ny = (from_x + planned[0]) / away, (from_y + planned[1]) / away
        along, aside = rotate(-yaw, (nx, ny))
        half = abs(along) * gait.foot_length / 2 + abs(aside) * gait.foot_width / 2
        rows.append((*rotate(-step.foot[2], (nx, ny)), radius + GAP + half - nx * from_x - ny * from_y))
    return np.array(rows).reshape(-1, 3)


def _overlap(low: float, high: float, least: float, most: float) -> Pair:
    """What two intervals have in common; where that is nothing, the end of the first that is nearest to the second."""
    start, end = max(low, least), min(high, most)
    if start <= end:
        return start, end
    return (low, low) if most < low else (high, high)


def landing_box(gait: Gait) -> tuple[float, float, float]:
    """How far ahead or back a foot may land from the other to catch a push, and how near and far aside [m]."""
    scale = gait.com_height / 0.465
    return 0.24 * scale, gait.foot_distance - 0.02 * scale, gait.foot_distance + 0.16 * scale


def begin(gait: Gait, stance: int, foot: Pose, origin: Pair, ahead: Chain, turn: float, final: bool) -> Step:
    """A step that starts now."""
    nominal = rotate(-foot[2], ahead.displacements[0])
    return Step(
        stance, foot, origin, gait.double_support, 0.0, gait.step_time, nominal, turn, nominal, nominal, STILL, final
    )


def catching(gait: Gait, stance: int, foot: Pose, origin: Pair) -> tuple[Step, tuple[Pair, ...]]:
    """A step out of standing that catches a push, and the displacements after it."""
    ahead = chain(gait, by_command(gait, STILL, stance, foot[2]), final=False)
    step = begin(gait, stance, foot, origin, ahead, 0.0, final=False)._replace(double_support=_CATCH_DS)
    return step, ahead.displacements[1:]


def side_by_side(gait: Gait, a: Pose, b: Pose) -> bool:
    """Whether two feet, the stance foot first, stand as they do when the robot stands."""
    dx, dy = rotate(-a[2], (b[0] - a[0], b[1] - a[1]))
    turned = math.remainder(b[2] - a[2], 2 * math.pi)
    return abs(dx) < _SAME_PLACE and abs(abs(dy) - gait.foot_distance) < _SAME_PLACE and abs(turned) < _SAME_YAW


def corrected(correction: Velocity, landings: tuple[Landing, ...], config: WalkConfig) -> Velocity:
    """The integral on the velocity achieved over the last two steps, against what was asked for in them."""
    if len(landings) < 3 or not config.correct_velocity:
        return correction
    asked = zip(landings[-2].asked, landings[-1].asked, strict=True)
    most = (config.velocity_most[0], config.velocity_most[0], config.velocity_most[1])
    errors = [(a + b) / 2 - got for (a, b), got in zip(asked, achieved(landings), strict=True)]
    return Velocity(
        *(
            min(max(old + config.velocity_gain * error, -limit), limit)
            for old, error, limit in zip(correction, errors, most, strict=True)
        )
    )


def achieved(landings: tuple[Landing, ...]) -> Velocity:
    """The velocity over the last two steps, from one landing of a side to its next, in the heading between them."""
    old, new = landings[-3], landings[-1]
    dt = new.t - old.t
    turned = math.remainder(new.pose[2] - old.pose[2], 2 * math.pi)
    heading = old.pose[2] + turned / 2
    dx, dy = rotate(-heading, (new.pose[0] - old.pose[0], new.pose[1] - old.pose[1]))
    return Velocity(dx / dt, dy / dt, turned / dt)


def timing_of(gait: Gait) -> Timing:
    """E and k of a whole step of a gait."""
    return timing(gait.omega, gait.step_time, gait.double_support)
