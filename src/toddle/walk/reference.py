"""What the body is to do in this tick: centre of mass, soles and their load, as one `Reference`."""

from __future__ import annotations

import numpy as np

from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT, RIGHT
from toddle.signals import Reference
from toddle.walk.balance import pendulum, support
from toddle.walk.balance.estimate import Estimate
from toddle.walk.balance.feet import Feet, rest, swing
from toddle.walk.balance.pendulum import Pair
from toddle.walk.config import TICK, WalkConfig
from toddle.walk.pattern.displacement import rotate
from toddle.walk.state import WalkerState
from toddle.walk.stepping import single


def followed(gait: Gait, config: WalkConfig, state: WalkerState, sensed: Estimate, zmp: Pair) -> WalkerState:
    """The centre of mass' reference: drawn to the measured one, then a tick of the pendulum over the new ZMP.

    Args:
        gait: how the robot steps.
        config: gains and limits.
        state: of the walker.
        sensed: where the robot is.
        zmp: zero moment point that is commanded [m].
    """
    x, y, vx, vy = state.com
    mx, my = float(sensed.com[0]), float(sensed.com[1])
    ux, uy = float(sensed.com_velocity[0]), float(sensed.com_velocity[1])
    most = config.offset_most
    gain = TICK / config.offset_time
    offset = (
        min(max(state.offset[0] + gain * (x - mx), -most), most),
        min(max(state.offset[1] + gain * (y - my), -most), most),
    )
    share = config.follow if config.follow_measured else 0.0
    x, y, vx, vy = x + share * (mx - x), y + share * (my - y), vx + share * (ux - vx), vy + share * (uy - vy)
    x, vx = pendulum.advance(gait.omega, x, vx, zmp[0], TICK)
    y, vy = pendulum.advance(gait.omega, y, vy, zmp[1], TICK)
    load = support.load_share(state.anchors, zmp, state.step.stance if single(state) else None)
    return state._replace(com=(x, y, vx, vy), offset=offset, zmp=zmp, load=load)


def moved(gait: Gait, state: WalkerState) -> WalkerState:
    """The soles' reference, a tick later."""
    feet = Feet(state.feet, state.feet_velocity, state.feet_acceleration)
    step = state.step
    if single(state):
        feet = rest(feet, step.stance, state.anchors[step.stance], TICK)
        dx, dy = rotate(step.foot[2], step.landing)
        goal = (step.foot[0] + dx, step.foot[1] + dy, step.foot[2] + step.turn)
        done, left = step.phase - step.double_support, step.end - state.lowering - step.phase
        feet = swing(feet, 1 - step.stance, goal, gait.step_height, done, left, TICK)
    else:
        for side in (LEFT, RIGHT):
            feet = rest(feet, side, state.anchors[side], TICK)
    return state._replace(feet=feet.pose, feet_velocity=feet.velocity, feet_acceleration=feet.acceleration)


def reference(gait: Gait, state: WalkerState) -> Reference:
    """What the state asks of the body."""
    x, y, vx, vy = state.com
    squared = gait.omega**2
    ax, ay = squared * (x - state.zmp[0]), squared * (y - state.zmp[1])
    feet = (state.feet, state.feet_velocity, state.feet_acceleration)
    yaw = np.array([poses[:, 3].mean() for poses in feet])
    com = np.array([[x, y, gait.com_height], [vx, vy, 0.0], [ax, ay, 0.0]])
    return Reference(state.t, com, np.array(state.zmp), yaw, *feet, np.array(state.load))
