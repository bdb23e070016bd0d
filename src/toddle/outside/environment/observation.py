"""What the environment's observation is made of: named parts of one flat array, each with its bounds.

Everything here is felt or decided by the robot itself; nothing is the simulator's truth. The heading is the waist's as
estimated; the support is the sole that carries, or the middle between both.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from toddle.robots.gait import GRAVITY
from toddle.robots.humanoid import LEFT, RIGHT, Humanoid
from toddle.signals import Senses, Velocity
from toddle.walk.loop import Moment

_WIDE = 0.5  # beyond the joints' limits [rad]
_HARDEST = 20.0  # of a foot's landing, in weights of the robot
_LONGEST = 10.0  # that the support is told to last [s]


@dataclass(frozen=True)
class Layout:
    """Where each part lies in the observation.

    Attributes:
        parts: by name, in their order.
        low: least value of each number.
        high: greatest value.
    """

    parts: dict[str, slice]
    low: Float[np.ndarray, " numbers"]
    high: Float[np.ndarray, " numbers"]


def layout(humanoid: Humanoid) -> Layout:
    """How the observation of a robot is made up."""
    fastest, joints = np.array(humanoid.gait.fastest), len(humanoid.joints)
    reach = 4 * humanoid.gait.com_height
    force = _HARDEST * GRAVITY * humanoid.mass
    wrench = np.array([force] * 3 + [force * humanoid.gait.foot_length] * 3)
    sole = np.array([reach, reach, reach, math.pi])
    even = {
        "goal": fastest,
        "allowed": fastest,
        "velocity": 10 * fastest,
        "com_velocity": np.full(3, 10.0),
        "dcm": np.full(2, 10.0),
        "soles": np.tile(sole, 2),
        "zmp_margin": np.ones(1),
        "support": np.ones(2),
        "support_time": np.full(1, _LONGEST),
        "up": np.full(3, 1.001),
        "gyro": np.full(3, 100.0),
        "acceleration": np.full(3, 1000.0),
        "joints": np.zeros(joints),
        "rates": np.full(joints, 100.0),
        "wrenches": np.tile(wrench, 2),
    }
    parts, high = _joined(even)
    low = -high
    low[parts["support"]] = low[parts["support_time"]] = 0.0
    low[parts["joints"]], high[parts["joints"]] = humanoid.lower - _WIDE, humanoid.upper + _WIDE
    return Layout(parts, low, high)


def observe(
    layout: Layout, omega: float, goal: Velocity, moment: Moment, senses: Senses, support_time: float
) -> Float[np.ndarray, " numbers"]:
    """The observation, each number within its bounds; 0 where it is not known.

    Args:
        layout: what it is made up of.
        omega: natural frequency of the pendulum [rad/s].
        goal: the velocity to walk at.
        moment: the last tick.
        senses: what the robot felt at its end.
        support_time: since the support last changed [s].
    """
    measured = moment.measured
    carries = [moment.support in (side, -1) for side in (LEFT, RIGHT)]
    support = measured.feet[carries].mean(axis=0)
    along = _turned(-measured.yaw)
    dcm = measured.com[:2] + measured.com_velocity[:2] / omega - support[:2]
    values = {
        "goal": np.array(goal),
        "allowed": np.array(moment.allowed),
        "velocity": np.array(measured.velocity),
        "com_velocity": along @ measured.com_velocity,
        "dcm": along[:2, :2] @ dcm,
        "soles": np.concatenate([_seen(sole, measured.com, measured.yaw, along) for sole in measured.feet]),
        "zmp_margin": np.array([measured.margin]),
        "support": np.array(carries, float),
        "support_time": np.array([support_time]),
        "up": _up(senses.orientation),
        "gyro": senses.gyro,
        "acceleration": senses.acceleration,
        "joints": senses.joints,
        "rates": senses.rates,
        "wrenches": senses.wrenches.ravel(),
    }
    row = np.concatenate([values[name] for name in layout.parts])
    return np.clip(np.nan_to_num(row), layout.low, layout.high)


def _joined(parts: dict[str, np.ndarray]) -> tuple[dict[str, slice], Float[np.ndarray, " numbers"]]:
    ends = np.cumsum([len(part) for part in parts.values()]).tolist()
    places = {name: slice(end - len(part), end) for (name, part), end in zip(parts.items(), ends, strict=True)}
    return places, np.concatenate(list(parts.values()))


def _seen(
    sole: Float[np.ndarray, "4"], com: Float[np.ndarray, "3"], yaw: float, along: Float[np.ndarray, "3 3"]
) -> Float[np.ndarray, "4"]:
    """A sole from the centre of mass, along the heading: x, y, z [m], yaw [rad]."""
    return np.append(along @ (sole[:3] - com), math.remainder(sole[3] - yaw, 2 * math.pi))


def _turned(yaw: float) -> Float[np.ndarray, "3 3"]:
    cos, sin = math.cos(yaw), math.sin(yaw)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def _up(orientation: Float[np.ndarray, "4"]) -> Float[np.ndarray, "3"]:
    """The vertical in the frame of the inertial unit: the last row of its rotation matrix."""
    w, x, y, z = orientation.tolist()
    return np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
