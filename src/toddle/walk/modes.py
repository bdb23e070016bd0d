"""What the feet do next: the walker's state machine.

STAND --command--> SHIFT --weight over--> STEP --touchdown--> STEP ... --feet side by side, no command--> STAND
  \\--pushed out of the soles--> STEP
"""

from __future__ import annotations

import math

from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT, RIGHT
from toddle.signals import STILL, Velocity
from toddle.walk.balance import support
from toddle.walk.balance.estimate import Estimate
from toddle.walk.balance.pendulum import Pair
from toddle.walk.config import TICK, WalkConfig
from toddle.walk.landing import dcm_of
from toddle.walk.pattern.displacement import rotate
from toddle.walk.state import Landing, Mode, Pose, WalkerState, pose_of
from toddle.walk.stepping import (
    area,
    begin,
    by_command,
    catching,
    chain,
    corrected,
    first_stance,
    moving,
    side_by_side,
    total,
)

_LOWERING = 0.1  # the most by which a landing is brought forward or put off [s]
_CALM = 0.02  # a DCM this near to where it should be lets the robot stand after one more step [m]
_SETTLING = 0.5  # no step catches a robot that has just been put down [s]
_SHRUNK = 0.8  # of the soles: a DCM outside of this, while standing, calls for a step


def changed(gait: Gait, config: WalkConfig, state: WalkerState, sensed: Estimate, velocity: Velocity) -> WalkerState:
    """The state with the mode, and the step under way, of this tick.

    Args:
        gait: how the robot steps.
        config: times, and what the walker learns from its landings.
        state: of the walker, its time and estimate those of this tick.
        sensed: where the robot is, and which soles carry.
        velocity: the command.
    """
    if state.mode == Mode.STAND:
        return _leave_standing(gait, config, state, sensed, velocity)
    if state.mode == Mode.SHIFT:
        left = state.shift_left - TICK
        if left > 0:
            return state._replace(shift_left=left)
        return _begin(gait, state, sensed, state.step.stance, state.zmp, velocity)
    step = state.step._replace(phase=state.step.phase + TICK)
    state = state._replace(step=step)
    swinging = 1 - step.stance
    late = step.phase >= step.end + config.late
    share = (step.phase - step.double_support) / max(step.end - step.double_support, TICK)
    if late or (share >= config.touchdown and bool(sensed.contact[swinging])):
        return _land(gait, config, state, sensed, velocity)
    return state


def _leave_standing(
    gait: Gait, config: WalkConfig, state: WalkerState, sensed: Estimate, velocity: Velocity
) -> WalkerState:
    xi = (float(sensed.dcm[0]), float(sensed.dcm[1]))
    if config.adapt_steps and state.t > _SETTLING and support.margin(area(gait, state, _SHRUNK), xi) < 0:
        middle = state.anchors[:, :2].mean(axis=0)
        yaw = float(state.anchors[:, 3].mean())
        aside = rotate(-yaw, (xi[0] - middle[0], xi[1] - middle[1]))[1]
        stance = RIGHT if aside > 0 else LEFT
        step, later = catching(gait, stance, pose_of(state.anchors, stance), state.zmp)
        return state._replace(mode=Mode.STEP, step=step, later=later, plan_age=math.inf, landings=(), correction=STILL)
    if not moving(velocity):
        return state
    stance = first_stance(velocity)
    step = state.step._replace(stance=stance, foot=pose_of(state.anchors, stance))
    return state._replace(mode=Mode.SHIFT, shift_left=config.shift_time, step=step, landings=(), correction=STILL)


def _begin(
    gait: Gait, state: WalkerState, sensed: Estimate, stance: int, origin: Pair, velocity: Velocity
) -> WalkerState:
    foot = pose_of(state.anchors, stance)
    walks = moving(velocity)
    wanted = total(velocity, state.correction) if walks else STILL
    final = not walks and _calm(gait, sensed, foot, stance, origin)
    ahead = chain(gait, by_command(gait, wanted, stance, foot[2]), final)
    step = begin(gait, stance, foot, origin, ahead, wanted.omega * gait.step_time, final)
    step = step._replace(asked=velocity)
    return state._replace(mode=Mode.STEP, step=step, later=ahead.displacements[1:], plan_age=math.inf)


def _calm(gait: Gait, sensed: Estimate, foot: Pose, stance: int, origin: Pair) -> bool:
    """Whether the robot could stand after the step that begins: its DCM is about where that asks for."""
    ahead = chain(gait, by_command(gait, STILL, stance, foot[2]), final=True)
    x, y = dcm_of(gait, begin(gait, stance, foot, origin, ahead, 0.0, True), ahead)
    return math.hypot(float(sensed.dcm[0]) - x, float(sensed.dcm[1]) - y) < _CALM


def _land(gait: Gait, config: WalkConfig, state: WalkerState, sensed: Estimate, velocity: Velocity) -> WalkerState:
    landed = 1 - state.step.stance
    anchors = state.anchors.copy()
    anchors[landed] = sensed.soles[landed]
    anchors[landed, 2] = 0.0
    carried = state.step.foot[2]
    anchors[landed, 3] = carried + math.remainder(anchors[landed, 3] - carried, 2 * math.pi)
    pose = pose_of(anchors, landed)
    landings = (*state.landings[-2:], Landing(state.t, landed, pose, state.step.asked))
    correction = state.correction
    if moving(velocity) and not state.step.moved and not (state.held or (state.plan and state.plan.obstacle)):
        correction = corrected(correction, landings, config)
    late = state.step.phase - state.step.end
    lowering = min(max(state.lowering + config.punctual * late, -_LOWERING), _LOWERING)
    state = state._replace(anchors=anchors, landings=landings, correction=correction, lowering=lowering)
    if not moving(velocity) and side_by_side(gait, state.step.foot, pose):
        return state._replace(mode=Mode.STAND, correction=STILL)
    return _begin(gait, state, sensed, landed, state.step.foot[:2], velocity)
