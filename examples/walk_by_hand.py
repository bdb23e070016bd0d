"""A humanoid walks in physics: the whole loop in pure Python.

Senses go in, servo targets come out, a hundred times a second. Your own controller may decide on the velocity, and
your own robot may stand in for the simulation: it answers ``reset`` and ``tick``.

    python examples/walk_by_hand.py
"""

import math

from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.robots.humanoids import load_humanoid
from toddle.signals import Velocity
from toddle.walk.walker import walker

robot = load_humanoid("heicub")
controller, body = walker(robot), HumanoidSimulation(robot)
state, senses = controller.start(), body.reset()

while state.t < 6.0:
    velocity = Velocity(vx=min(0.2, 0.3 * state.t), vy=0.0, omega=0.1)  # [m/s, m/s, rad/s]
    state, action = controller.step(state, velocity, senses)
    senses = body.tick(action.servo)

truth = body.truth()
x, y, yaw = truth.waist
assert not truth.fallen
print(
    f"{robot.name} came {math.hypot(x, y):.2f} m far and turned by {math.degrees(yaw):.0f} degrees in {state.t:.0f} s"
)
