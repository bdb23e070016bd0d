"""Where the robot is, from its own senses alone, in the frame of the plan.

The inertial unit gives the body's lean, the joints its shape. The plan gives the rest: where each sole that carries
was put down is taken for true, in place and yaw, so that neither slip nor the unit's drifting yaw adds up. The centre
of mass follows by forward kinematics through the soles, each as much as it carries; aligned in this way the measured
state can be compared with the plan at all.

The velocity of the centre of mass is predicted and corrected. The prediction takes what the soles feel: of the total
force f, the part f_xy g / f_z is the acceleration that a linear inverted pendulum over the measured zero moment point
would have, w^2 (c - zmp), and it needs neither w nor the masses; the correction is the kinematics' own difference.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from toddle.robots.gait import GRAVITY
from toddle.robots.humanoid import Humanoid
from toddle.signals import Senses
from toddle.walk.balance.alignment import align
from toddle.walk.balance.zmp import zmp
from toddle.walk.posture.model import PostureModel
from toddle.walk.posture.survey import jacobians, survey


@dataclass(frozen=True)
class Observer:
    """What estimating needs of a robot.

    Attributes:
        model: its kinematics.
        omega: of the linear inverted pendulum [rad/s].
        weight: of the robot [N].
        position_gain: share of the difference between measured and predicted place that corrects the place, each tick.
        velocity_gain: the same difference a tick, and its share that corrects the velocity.
        turning: from the gyroscope's axes to those of body 0; None: it sits elsewhere, and speeds aren't used.
        rates_gain: share of the difference to the velocity by joints' speeds and gyroscope that corrects it, each tick.
        lands: a sole carries once it feels this share of the weight ...
        lifts: ... and until it feels less than this.
    """

    model: PostureModel
    omega: float
    weight: float
    turning: Float[np.ndarray, "3 3"] | None
    position_gain: float = 0.3
    velocity_gain: float = 0.05
    rates_gain: float = 0.15
    lands: float = 0.08
    lifts: float = 0.04


def observer(humanoid: Humanoid, model: PostureModel) -> Observer:
    """The observer of a humanoid, with the gains that the defaults are."""
    turning = humanoid.imu.rotation if humanoid.imu.body == 0 else None
    return Observer(model, humanoid.gait.omega, humanoid.mass * GRAVITY, turning)


class Estimate(NamedTuple):
    """The robot in the plan's frame (z = 0: the floor under the soles that carry; z is the vertical).

    Attributes:
        t: when it was sensed [s].
        q: configuration, in the order of `toddle.robots.humanoid.Tree`.
        com: centre of mass [m].
        com_velocity: its velocity [m/s].
        dcm: com + velocity / omega, x and y [m].
        zmp: zero moment point [m]; the last one while nothing carries.
        soles: left and right: x, y, z [m] and yaw [rad].
        sole_tilt: roll and pitch of each [rad].
        force: on each sole, upwards in its frame [N].
        contact: whether each sole carries.
        yaw: of the waist [rad].
        tilt: roll and pitch of the waist [rad].
    """

    t: float
    q: Float[np.ndarray, " positions"]
    com: Float[np.ndarray, "3"]
    com_velocity: Float[np.ndarray, "3"]
    dcm: Float[np.ndarray, "2"]
    zmp: Float[np.ndarray, "2"]
    soles: Float[np.ndarray, "2 4"]
    sole_tilt: Float[np.ndarray, "2 2"]
    force: Float[np.ndarray, "2"]
    contact: Bool[np.ndarray, "2"]
    yaw: float
    tilt: Float[np.ndarray, "2"]


class Body(NamedTuple):
    """What forward kinematics through the soles tells."""

    q: Float[np.ndarray, " positions"]
    com: Float[np.ndarray, "3"]
    soles: Float[np.ndarray, "2 4"]
    sole_tilt: Float[np.ndarray, "2 2"]
    soles_R: Float[np.ndarray, "2 3 3"]
    yaw: float
    tilt: Float[np.ndarray, "2"]


def estimate(
    observer: Observer,
    senses: Senses,
    anchors: Float[np.ndarray, "2 4"],
    load: Float[np.ndarray, "2"],
    last: Estimate | None,
    dt: float,
) -> Estimate:
    """The robot's state from its senses.

    Args:
        observer: see `Observer`.
        senses: of this tick.
        anchors: where each sole stands by the plan: x, y, z [m] and yaw [rad].
        load: how much each sole's anchor is to be believed; shares, in proportion.
        last: the estimate of the tick before; None: there was none, and the robot is taken to rest.
        dt: time since then [s].
    """
    body = _body(observer.model, senses, anchors, load)
    force = senses.wrenches[:, 2].copy()
    thresholds = observer.weight * np.where(_carried(last), observer.lifts, observer.lands)
    contact = force > thresholds
    pressed = zmp(senses.wrenches * contact[:, None], body.soles)
    if math.isnan(pressed[0]):
        pressed = body.com[:2].copy() if last is None else last.zmp
    com, velocity = body.com, np.zeros(3)
    if last is not None:
        acceleration = _acceleration(observer, senses, body)
        velocity = last.com_velocity + dt * acceleration
        expected = last.com + dt * last.com_velocity + 0.5 * dt * dt * acceleration
        surprise = body.com - expected
        com = expected + observer.position_gain * surprise
        velocity += observer.velocity_gain / dt * surprise
        if observer.turning is not None:
            felt = _felt_velocity(observer.model, observer.turning, senses, body, pressed, load)
            velocity += observer.rates_gain * (felt - velocity)
    dcm = com[:2] + velocity[:2] / observer.omega
    return Estimate(
        senses.t, body.q, com, velocity, dcm, pressed, body.soles, body.sole_tilt, force, contact, body.yaw, body.tilt
    )


def _carried(last: Estimate | None) -> Bool[np.ndarray, "2"]:
    return np.zeros(2, bool) if last is None else last.contact


def _body(model: PostureModel, senses: Senses, anchors: Float[np.ndarray, "2 4"], load: Float[np.ndarray, "2"]) -> Body:
    q = np.zeros(7 + len(senses.joints))
    q[3], q[7:] = 1.0, senses.joints
    seen = survey(model, q)
    q[:7], com, soles, tilt, rotations, (roll, pitch, yaw) = align(
        senses.orientation,
        seen.com,
        seen.soles_p,
        seen.soles_R,
        seen.waist_R,
        seen.imu_R,
        anchors,
        _shares(load),
    )
    return Body(q, com, soles, tilt, rotations, float(yaw), np.array([roll, pitch]))


def _acceleration(observer: Observer, senses: Senses, body: Body) -> Float[np.ndarray, "3"]:
    """Of the centre of mass, by the force that the soles feel; upwards none is taken."""
    force = body.soles_R[0] @ senses.wrenches[0, :3] + body.soles_R[1] @ senses.wrenches[1, :3]
    force *= GRAVITY / max(float(force[2]), 0.5 * observer.weight)
    force[2] = 0.0
    return force


def _felt_velocity(
    model: PostureModel,
    turning: Float[np.ndarray, "3 3"],
    senses: Senses,
    body: Body,
    pressed: Float[np.ndarray, "2"],
    load: Float[np.ndarray, "2"],
) -> Float[np.ndarray, "3"]:
    """Velocity of the centre of mass by the joints' speeds and the gyroscope.

    The point of each carrying sole that the zero moment point presses on is taken to rest, so that a sole may rock.
    """
    moving = jacobians(model, body.q)
    speeds = np.concatenate([np.zeros(3), turning @ senses.gyro, senses.rates])
    velocity = moving.com @ speeds
    for sole, share, place in zip(moving.soles, _shares(load), body.soles, strict=True):
        linear, angular = sole[:3] @ speeds, sole[3:] @ speeds
        x, y, z = pressed[0] - place[0], pressed[1] - place[1], -place[2]
        at_point = np.array(
            [angular[1] * z - angular[2] * y, angular[2] * x - angular[0] * z, angular[0] * y - angular[1] * x]
        )
        velocity -= share * (linear + at_point)
    return velocity


def _shares(load: Float[np.ndarray, "2"]) -> Float[np.ndarray, "2"]:
    left, right = max(float(load[0]), 0.0), max(float(load[1]), 0.0)
    total = left + right
    return np.array([left / total, right / total]) if total > 0 else np.array([0.5, 0.5])
