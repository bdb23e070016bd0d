"""What may be wrong with the world and with the robot's senses; every draw comes from one seed."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from toddle.failures import BadInput
from toddle.signals import Circle

TIMESTEP = 0.002
"""Simulation step [s]."""

TICK = 0.01
"""Control period: what one `tick` of the simulation lasts [s]."""


def _within(name: str, value: float | int, low: float | int, high: float | int) -> None:
    if not (math.isfinite(value) and low <= value <= high):
        bounds = f"from {low:g} to {high:g}" if math.isfinite(high) else f"of at least {low:g}"
        remedy = f"give a number {bounds}" if math.isfinite(low) else "give a finite number"
        raise BadInput(f"{value} is no use", where=f"world, {name}", remedy=remedy)


@dataclass(frozen=True)
class Noise:
    """Standard deviations of a humanoid's sensors; the defaults are those of a good robot.

    Attributes:
        encoder: of each joint's angle [rad].
        rate: of each joint's speed [rad/s].
        force: of each force at the soles [N].
        torque: of each torque at the soles [N m].
        orientation: of the inertial unit, about each axis [rad].
        gyro: of its angular velocity [rad/s].
        acceleration: of its acceleration [m/s^2].
        place: of whatever localises the robot, x and y [m].
        heading: of the same, yaw [rad].
    """

    encoder: float = 2e-4
    rate: float = 0.02
    force: float = 1.0
    torque: float = 0.1
    orientation: float = 1e-3
    gyro: float = 5e-3
    acceleration: float = 0.05
    place: float = 0.0
    heading: float = 0.0

    def __post_init__(self) -> None:
        """Refuses what is no standard deviation.

        Raises:
            BadInput: a number that is negative or not finite.
        """
        for field in fields(self):
            _within("noise, " + field.name, getattr(self, field.name), 0.0, math.inf)


SILENT = Noise(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""Sensors without noise."""

_RANGES = (
    ("friction", 0.01, 10.0),
    ("tilt_deg", 0.0, 45.0),
    ("downhill_deg", -360.0, 360.0),
    ("bumps", 0, 10_000),
    ("bump_height", 1e-4, 1.0),
    ("bump_side", 1e-3, 10.0),
    ("bump_reach", 0.1, 1000.0),
    ("mass_error", 0.0, 0.9),
    ("lag_s", 0.0, 1.0),
    ("delay_s", 0.0, 1.0),
    ("yaw_drift", -math.inf, math.inf),
    ("seed", 0, math.inf),
)


@dataclass(frozen=True)
class WorldOptions:
    """The world that a humanoid walks in. The defaults are a level floor, no obstacle, and perfect senses.

    The floor is always the plane z = 0: a tilted floor is simulated by a gravity that leans the other way, which is
    the same physics, and leaves heights over the floor and places on it what they are. The inertial unit still
    measures against the vertical, as a real one does: on a tilted floor it shows the tilt.

    Attributes:
        friction: of soles and floor.
        tilt_deg: of the floor [degrees].
        downhill_deg: which way it falls, from x ahead, turning left [degrees].
        bumps: how many square blocks lie on the floor, at random places and angles.
        bump_height: of each block [m].
        bump_side: of each block [m].
        bump_reach: they lie within this distance of the start, and not under the first stance [m].
        circles: obstacles: upright cylinders, 1.5 m high.
        mass_error: each body's mass is scaled by a draw within 1 plus or minus this.
        lag_s: time constant of the servos: they follow what is commanded with a first-order lag [s].
        delay_s: age of the senses, a multiple of 0.01 s [s].
        noise: of the sensors, drawn at each tick.
        bias: standard deviations of constant errors of the sensors, drawn once.
        yaw_drift: of the inertial unit's orientation [rad/s].
        localised: whether something tells the robot its place in the world.
        seed: of all that is drawn.
    """

    friction: float = 0.8
    tilt_deg: float = 0.0
    downhill_deg: float = 0.0
    bumps: int = 0
    bump_height: float = 0.005
    bump_side: float = 0.12
    bump_reach: float = 2.0
    circles: tuple[Circle, ...] = ()
    mass_error: float = 0.0
    lag_s: float = 0.0
    delay_s: float = 0.0
    noise: Noise = SILENT
    bias: Noise = SILENT
    yaw_drift: float = 0.0
    localised: bool = True
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuses what is no world.

        Raises:
            BadInput: a number out of its range, or not finite.
        """
        for name, low, high in _RANGES:
            _within(name, getattr(self, name), low, high)
        ticks = self.delay_s / TICK
        if abs(ticks - round(ticks)) > 1e-9:
            raise BadInput(f"{self.delay_s} is no multiple of {TICK:g} s", where="world, delay_s", remedy="round it")
        for number, circle in enumerate(self.circles):
            _within(f"circles, {number}: x", circle.x, -math.inf, math.inf)
            _within(f"circles, {number}: y", circle.y, -math.inf, math.inf)
            _within(f"circles, {number}: radius", circle.radius, 0.001, 100.0)
