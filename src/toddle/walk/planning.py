"""The footsteps to come: the predictive controller (``pattern``), asked again every tenth of a second and at touchdown.

Between its plans they stay as they are; where a plan can't be used the last one, shifted, is walked on by.
"""

from __future__ import annotations

import math

import numpy as np

from toddle.robots.gait import Gait
from toddle.signals import Footstep, Velocity
from toddle.walk.balance.estimate import Estimate
from toddle.walk.clearance import held_back
from toddle.walk.config import TICK, WalkConfig
from toddle.walk.pattern.displacement import rotate
from toddle.walk.pattern.feasible import cap
from toddle.walk.pattern.nmpc import NEVER, Nmpc, Plan, PlanState
from toddle.walk.pattern.nmpc import plan as next_plan
from toddle.walk.pattern.obstacles import NONE
from toddle.walk.pattern.plan import Status
from toddle.walk.state import Mode, WalkerState
from toddle.walk.stepping import Chain, by_command, chain, moving

_CROSSED = 0.01  # a plan that breaks its own rows by more is no plan [m]
_LEAPS = 0.06  # nor is one in which an obstacle moves the landing under way by more [m]


def allowed(gait: Gait, state: WalkerState, sensed: Estimate, velocity: Velocity) -> Velocity:
    """The command, less what of it would lead into an obstacle."""
    x, y = state.anchors[:, :2].mean(axis=0).tolist()
    return cap(held_back(velocity, state.circles, (x, y, sensed.yaw), gait), gait)


def planned(
    problem: Nmpc, config: WalkConfig, state: WalkerState, sensed: Estimate, wanted: Velocity
) -> tuple[WalkerState, Chain]:
    """The footsteps to come: planned again where it is time, else as they were.

    Args:
        problem: of the gait.
        config: how often, by when, and whether at all.
        state: of the walker.
        sensed: where the robot is.
        wanted: the command as corrected.
    """
    step, gait = state.step, problem.gait
    if state.mode == Mode.SHIFT:
        return state, chain(gait, by_command(gait, wanted, step.stance, step.foot[2]), final=False)
    age = state.plan_age + TICK
    if not config.plan_steps:
        state = state._replace(later=by_command(gait, wanted, 1 - step.stance, step.foot[2] + step.turn)[:-1])
    elif age >= config.lead - TICK / 2 and (state.mode == Mode.STEP or state.fallbacks):
        state = _again(problem, config, state, sensed, wanted)
    else:
        state = state._replace(plan_age=age)
    first = rotate(step.foot[2], state.step.planned)
    return state, chain(gait, (first, *state.later), step.final)


def _astray(plan: Plan, at: PlanState) -> bool:
    """Whether rows linearised too far away have misled a plan: it breaks its own rows, or leaps from where it was."""
    if max(plan.overlap, plan.violation) > _CROSSED:
        return True
    x, y = plan.displacement[0].tolist()
    return at.first is not None and math.hypot(x - at.first[0], y - at.first[1]) > _LEAPS


def _again(problem: Nmpc, config: WalkConfig, state: WalkerState, sensed: Estimate, wanted: Velocity) -> WalkerState:
    """One iteration of the predictive controller, from the measured state."""
    step, at = state.step, _seen(problem.gait, state, sensed, wanted)
    plan = next_plan(problem, at, wanted, state.circles, state.plan, config.deadline_ms)
    if plan.obstacle and _astray(plan, at):
        # the command was held back already: walk on by it
        plan = next_plan(problem, at, wanted, NONE, state.plan, config.deadline_ms)
    fallbacks = 0 if plan.status == Status.SOLVED else state.fallbacks + 1
    state = state._replace(plan=plan, plan_age=0.0, fallbacks=fallbacks)
    if state.mode == Mode.STAND:
        return state
    displaced = [(float(x), float(y)) for x, y in plan.displacement]
    step = step._replace(planned=rotate(-step.foot[2], displaced[0]), turn=float(plan.feet[0, 2]) - step.foot[2])
    return state._replace(step=step, later=tuple(displaced[1:]))


def _seen(gait: Gait, state: WalkerState, sensed: Estimate, wanted: Velocity) -> PlanState:
    """The walker's state as the predictive controller takes it."""
    step = state.step
    other = state.anchors[1 - step.stance]
    com = np.column_stack([sensed.com[:2], sensed.com_velocity[:2], gait.omega**2 * (sensed.com[:2] - state.zmp)])
    stands = state.mode == Mode.STAND
    walks_on = NEVER if moving(wanted) else 2
    return PlanState(
        com,
        Footstep(step.stance, *step.foot),
        Footstep(1 - step.stance, float(other[0]), float(other[1]), float(other[3])),
        step.origin,
        step.phase,
        max(step.end - step.phase, 0.0),
        step.double_support,
        0 if stands else 1 if step.final else walks_on,
        None if step.final or stands else (*rotate(step.foot[2], step.nominal), step.turn),
    )
