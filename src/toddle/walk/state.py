"""What the walker remembers between two ticks, and what it does in one: frozen records of plain numbers.

Poses on the floor are x, y [m] and yaw [rad] in the plan's frame, which begins between the soles, x ahead.
"""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.signals import Reference, Velocity
from toddle.walk.balance.pendulum import Pair

if TYPE_CHECKING:
    from toddle.walk.balance.estimate import Estimate
    from toddle.walk.pattern.nmpc import Plan
    from toddle.walk.pattern.plan import Interval

Pose = tuple[float, float, float]


class Mode(IntEnum):
    """What the feet are doing."""

    STAND = 0
    SHIFT = 1
    STEP = 2


class Step(NamedTuple):
    """One step under way: the other foot than ``stance`` swings.

    Attributes:
        stance: side that carries.
        foot: pose of the stance sole.
        origin: where the zero moment point was when the step began [m].
        double_support: how long the weight takes to come over [s].
        phase: time since it began [s].
        end: when the swing foot lands, in the same time [s].
        landing: displacement of the landing from the stance foot, in the stance foot's frame [m].
        turn: yaw of the landing over the stance foot's [rad].
        nominal: the displacement that the command asked for when the step began.
        planned: the displacement as planned last.
        asked: the velocity that was commanded when the step began.
        final: the robot will stand afterwards.
        moved: the landing was moved far from the plan by a push.
    """

    stance: int
    foot: Pose
    origin: Pair
    double_support: float
    phase: float
    end: float
    landing: Pair
    turn: float
    nominal: Pair
    planned: Pair
    asked: Velocity
    final: bool
    moved: bool = False


class Landing(NamedTuple):
    """A touchdown: when [s], which side, where, and the velocity that the step was asked for."""

    t: float
    side: int
    pose: Pose
    asked: Velocity


class WalkerState(NamedTuple):
    """Everything that the next tick depends on.

    Attributes:
        t: time [s].
        mode: what the feet do.
        step: the step under way, or the last one.
        shift_left: of the weight shift [s].
        anchors: poses in the plan of the soles: where each stands or last stood; x, y, z, yaw.
        feet: reference of the soles, x, y, z [m], yaw [rad].
        feet_velocity: its derivative.
        feet_acceleration: its second derivative.
        com: reference of the centre of mass: x, y [m], their velocities [m/s].
        offset: added to it against the servos' sag [m].
        zmp: the last commanded zero moment point [m].
        load: planned share of the weight on each foot.
        q: the last posture.
        correction: added to the command by the integral.
        landings: the last three touchdowns.
        lowering: the swing foot is brought down so long before it is to land, learned from the touchdowns [s].
        estimate: the last one.
        plan: the last plan, and how old it is [s].
        plan_age: see plan.
        later: displacements of the footsteps after the landing under way, in the plan's frame [m].
        circles: obstacles near the robot, in the plan's frame: centre and radius [m].
        held: an obstacle holds the command back.
        fallbacks: plans that could not be used, one after another.
    """

    t: float
    mode: Mode
    step: Step
    shift_left: float
    anchors: Float[np.ndarray, "2 4"]
    feet: Float[np.ndarray, "2 4"]
    feet_velocity: Float[np.ndarray, "2 4"]
    feet_acceleration: Float[np.ndarray, "2 4"]
    com: tuple[float, float, float, float]
    offset: Pair
    zmp: Pair
    load: Pair
    q: Float[np.ndarray, " positions"]
    correction: Velocity
    landings: tuple[Landing, ...]
    lowering: float
    estimate: Estimate | None
    plan: Plan | None
    plan_age: float
    later: tuple[Pair, ...]
    circles: Float[np.ndarray, "circles 3"]
    held: bool
    fallbacks: int


class Action(NamedTuple):
    """What one tick decided.

    Attributes:
        servo: target of each joint's servo [rad].
        reference: what the pattern asks for.
        estimate: what the senses told.
        plan: the plan made in this tick, if one was.
        posture_ms: time that the inverse kinematics took [ms].
        posture_residual: its greatest residual, [m] or [rad].
        velocity: the command as corrected.
    """

    servo: Float[np.ndarray, " joints"]
    reference: Reference
    estimate: Estimate
    plan: Plan | Interval | None
    posture_ms: float
    posture_residual: float
    velocity: Velocity


def pose_of(poses: Float[np.ndarray, "2 4"], side: int) -> Pose:
    """x, y [m] and yaw [rad] of one sole of both."""
    x, y, _, yaw = poses[side].tolist()
    return x, y, yaw
