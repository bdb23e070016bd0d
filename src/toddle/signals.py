"""The frozen records that travel between the stations.

Stations (robots, explorers, learners, solvers, evaluation) never meet each other; they meet here.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Bool, Float


class Movement(NamedTuple):
    """One movement made and watched: what was commanded, where the tip went, what it was tried for.

    Every number is in the body's unit box: 0 and 1 are a joint's limits, or the edges of the workspace.
    A NamedTuple of arrays, so that it is a pytree: a chunk of movements is the same record with a leading axis.
    """

    q: Float[Array, "*batch joints"]
    x: Float[Array, "*batch space"]
    goal: Float[Array, "*batch space"]
    weight: Float[Array, "*batch"]


@dataclass(frozen=True)
class Experience:
    """Movements made and watched, in physical units: what a body's own shape is learned from.

    Attributes:
        q: joint values commanded [rad, or m for a sliding joint].
        x: where the tip was seen, in the base frame [m].
        turn: the tip's orientation that was seen, as rotations from the tip's frame to the base's; None: not seen.
    """

    q: Float[np.ndarray, "movements joints"]
    x: Float[np.ndarray, "movements space"]
    turn: Float[np.ndarray, "movements 3 3"] | None = None


class Verdict(StrEnum):
    """How an answer ended."""

    REACHED = "reached"
    OUT_OF_REACH = "out of reach"
    AT_JOINT_LIMIT = "at a joint limit"
    NOT_CONVERGED = "not converged"


class Velocity(NamedTuple):
    """A walking command, in the robot's own frame: forward, to the left [m/s], turning left [rad/s]."""

    vx: float
    vy: float
    omega: float


STILL = Velocity(0.0, 0.0, 0.0)
"""The command to stand."""


class Circle(NamedTuple):
    """An obstacle on the floor, a tall cylinder: its centre and radius in the world [m]."""

    x: float
    y: float
    radius: float


class Footstep(NamedTuple):
    """Where a sole stands: 0 the left, 1 the right; its frame's origin [m] and yaw [rad] on the floor."""

    side: int
    x: float
    y: float
    yaw: float


class Reference(NamedTuple):
    """What the walking pattern asks of the body at one instant, in the plan's frame (z = 0: the floor).

    Rows of ``feet`` and its derivatives are the left and the right sole, columns x, y, z [m] and yaw [rad].

    Attributes:
        t: time [s].
        com: centre of mass: position [m], velocity [m/s] and acceleration [m/s^2], one row each.
        zmp: zero moment point [m].
        yaw: of waist and chest: angle [rad], rate and acceleration.
        feet: the soles' poses.
        feet_velocity: their first derivative, per second.
        feet_acceleration: their second derivative, per second squared.
        load: share of the weight that each foot is to carry; they add up to 1.
    """

    t: float
    com: Float[np.ndarray, "3 3"]
    zmp: Float[np.ndarray, "2"]
    yaw: Float[np.ndarray, "3"]
    feet: Float[np.ndarray, "2 4"]
    feet_velocity: Float[np.ndarray, "2 4"]
    feet_acceleration: Float[np.ndarray, "2 4"]
    load: Float[np.ndarray, "2"]


class Senses(NamedTuple):
    """What a humanoid's own sensors tell at one instant; nothing here is the simulator's truth but ``place``.

    Attributes:
        t: time [s].
        joints: encoders, in the humanoid's order [rad].
        rates: joint speeds [rad/s].
        wrenches: left and right foot: the force [N] and torque [N m] that the floor applies to the sole, in the
            sole's frame, about its origin. Standing, the third force is positive.
        orientation: of the IMU in the world, unit quaternion (w, x, y, z).
        gyro: angular velocity in the IMU's frame [rad/s].
        acceleration: specific force in the IMU's frame [m/s^2]; at rest it points up and measures gravity.
        place: x, y [m] and yaw [rad] of the waist in the world from whatever localises the robot; NaN without.
            Only obstacles are placed by it.
    """

    t: float
    joints: Float[np.ndarray, " joints"]
    rates: Float[np.ndarray, " joints"]
    wrenches: Float[np.ndarray, "2 6"]
    orientation: Float[np.ndarray, "4"]
    gyro: Float[np.ndarray, "3"]
    acceleration: Float[np.ndarray, "3"]
    place: Float[np.ndarray, "3"]


class DepthImage(NamedTuple):
    """What two pictures tell of how far things are, in the rectified left camera.

    Attributes:
        disparity: [pixels]; NaN where none was found.
        depth: along the optical axis [m]; NaN where it is not known.
        confidence: 0 to 1.
        valid: the pixel was seen by both cameras, is neither black nor saturated, and its confidence suffices.
        trouble: what is wrong with the cameras, in words; empty: nothing was noticed.
    """

    disparity: Float[np.ndarray, "rows columns"]
    depth: Float[np.ndarray, "rows columns"]
    confidence: Float[np.ndarray, "rows columns"]
    valid: Bool[np.ndarray, "rows columns"]
    trouble: tuple[str, ...] = ()


@dataclass(frozen=True)
class Solution:
    """An answer to "which joint angles bring the tip there?".

    Attributes:
        q: joint values, within the limits [rad, or m for a sliding joint].
        expected_error: the distance to expect between the tip and the target [m].
        steps: movements made to find it (0: open loop, the first answer).
        verdict: how it ended.
        reason: one sentence that explains the verdict.
        error_90: the distance from the target that nine of ten such answers stay within [m]; NaN: not known.
        nearest: where the tip comes to instead, for a target that is out of reach [m]; None: it is not.
    """

    q: np.ndarray
    expected_error: float
    steps: int
    verdict: Verdict
    reason: str
    error_90: float = float("nan")
    nearest: np.ndarray | None = None
