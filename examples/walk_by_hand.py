"""A humanoid walks in physics: the whole loop in pure Python.

Senses go in, servo targets come out, a hundred times a second. Your own controller may decide on the velocity, and
your own robot may stand in for the simulation: it answers ``reset`` and ``tick``.

    python examples/walk_by_hand.py
"""

import math

import toddle

robot = toddle.load_humanoid("heicub")
controller, body = toddle.walker(robot), toddle.HumanoidSimulation(robot)
state, senses = controller.start(), body.reset()

while state.t < 6.0:
    velocity = toddle.Velocity(vx=min(0.2, 0.3 * state.t), vy=0.0, omega=0.1)  # [m/s, m/s, rad/s]
    state, action = controller.step(state, velocity, senses)
    senses = body.tick(action.servo)

truth = body.truth()
x, y, yaw = truth.waist
assert not truth.fallen
print(
    f"{robot.name} came {math.hypot(x, y):.2f} m far and turned by {math.degrees(yaw):.0f} degrees in {state.t:.0f} s"
)
