"""Physics: bodies in MuJoCo with servos, gravity and sensor noise."""

from toddle.outside.simulation.arm import PhysicsPlant
from toddle.outside.simulation.options import PhysicsOptions

__all__ = ["PhysicsOptions", "PhysicsPlant"]
