"""What can be chosen about the simulated arm: its sensors, its servos, and what its links weigh."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from toddle.failures import BadInput

TIMESTEP = 0.002
"""Simulation step [s]."""

_STIFFEST_HZ = 40.0  # 2 pi f TIMESTEP = 0.5 rad a step: well inside what an explicit spring bears


@dataclass(frozen=True)
class PhysicsOptions:
    """How the arm is simulated. The defaults are a small humanoid's arm with geared servos.

    Attributes:
        noise: standard deviation of the observed tip position, each coordinate [m].
        gravity: acceleration [m/s^2]; a planar arm moves in the horizontal plane, so -z is across it.
        seed: of the sensor noise.
        natural_frequency_hz: stiffness of the servos [Hz]; an arm sags less when it is higher. At most 40.
        sweep_s: duration of a movement over a joint's whole range [s]; shorter movements take their share.
        settle_s: longest wait for rest after the commanded movement has ended [s].
        still: joint speed under which the arm is at rest [rad/s, or m/s for a sliding joint].
        armature: rotor inertia seen through the gears, each joint [kg m^2, or kg for a sliding joint].
        friction: dry friction of each joint [N m, or N]; the arm then stops short of the command.
        gravity_compensation: hold the links' weight with extra torque, so that nothing sags.
        link_density: mass of a link for its length [kg/m]; 2 is a rod of water 5 cm thick.
        link_radius: of the capsule that is a link [m].
    """

    noise: float = 0.001
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    seed: int = 0
    natural_frequency_hz: float = 5.0
    sweep_s: float = 1.0
    settle_s: float = 1.0
    still: float = 0.01
    armature: float = 0.005
    friction: float = 0.0
    gravity_compensation: bool = False
    link_density: float = 2.0
    link_radius: float = 0.025

    def __post_init__(self) -> None:
        """Refuses what no simulation can use.

        Raises:
            BadInput: a number that is not finite, or negative, or zero where it divides.
        """
        for field in fields(self):
            value = getattr(self, field.name)
            if not all(math.isfinite(number) for number in (value if isinstance(value, tuple) else (value,))):
                raise _bad(field.name, value, "must be finite")
        for name in ("noise", "seed", "settle_s", "friction"):
            if getattr(self, name) < 0:
                raise _bad(name, getattr(self, name), "must not be negative")
        for name in ("natural_frequency_hz", "sweep_s", "still", "armature", "link_density", "link_radius"):
            if getattr(self, name) <= 0:
                raise _bad(name, getattr(self, name), "must be above zero")
        if self.natural_frequency_hz > _STIFFEST_HZ:
            raise _bad("natural_frequency_hz", self.natural_frequency_hz, f"must be at most {_STIFFEST_HZ:g} Hz")


def _bad(name: str, value: object, remedy: str) -> BadInput:
    return BadInput(f"{value} is no use", where=f"physics option {name}", remedy=f"it {remedy}")
