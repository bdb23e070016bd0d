"""The steps: how one begins, where the next ones go, what was achieved in the last ones. Pure functions."""

from __future__ import annotations

import math
from typing import NamedTuple

from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT, RIGHT
from toddle.signals import STILL, Velocity
from toddle.walk.balance import support
from toddle.walk.balance.pendulum import Pair, offset, timing
from toddle.walk.config import WalkConfig
from toddle.walk.pattern.displacement import displacements, rotate
from toddle.walk.pattern.nmpc_problem import apart
from toddle.walk.state import Landing, Mode, Pose, Step, WalkerState, pose_of

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


def total(a: Velocity, b: Velocity) -> Velocity:
    """The sum of two velocities."""
    return Velocity(a.vx + b.vx, a.vy + b.vy, a.omega + b.omega)


def single(state: WalkerState) -> bool:
    """Whether one foot alone carries, and the other swings."""
    return state.mode == Mode.STEP and state.step.phase >= state.step.double_support


def area(gait: Gait, state: WalkerState, share: float = 1.0) -> support.Corners:
    """The area of the soles that stand, counter-clockwise; ``share`` shrinks each sole about its middle."""
    if single(state):
        return support.area(gait, [state.step.foot], share)
    return support.area(gait, [pose_of(state.anchors, side) for side in (LEFT, RIGHT)], share)


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
