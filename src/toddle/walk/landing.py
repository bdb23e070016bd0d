"""Where and when the swing foot lands, and what the zero moment point and the DCM are until then.

The landing is chosen again every tick (`toddle.walk.balance.step_adjustment`), within what a leg reaches, what the
swing foot can still do, and what obstacles leave.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT
from toddle.walk.balance import pendulum
from toddle.walk.balance.estimate import Estimate
from toddle.walk.balance.pendulum import Pair
from toddle.walk.balance.step_adjustment import Aim, Bounds, adjust
from toddle.walk.config import WalkConfig
from toddle.walk.pattern.displacement import rotate
from toddle.walk.pattern.nmpc_problem import GAP
from toddle.walk.state import Mode, Step, WalkerState
from toddle.walk.stepping import Chain, shift_zmp

_BETWEEN = 0.01  # left between two soles when a push is caught [m]
_NEAR = 0.6  # obstacles farther than this from a landing don't matter to it [m]
_TOUCH = 0.04  # between the decision to land at once and the touchdown [s]
_MOVED = 0.03  # a landing this far from the plan was moved by a push, not by the gait's own error [m]
_LEAST_SHIFT = 0.05  # the weight shift is planned as if it took this long at least [s]


def adjusted(
    gait: Gait, config: WalkConfig, state: WalkerState, sensed: Estimate, ahead: Chain
) -> tuple[WalkerState, Pair, Pair]:
    """Place and time of the landing, the planned zero moment point, and the DCM that goes with them [m].

    Args:
        gait: how the robot steps.
        config: the adjustment's weights, limits and switches.
        state: of the walker.
        sensed: where the robot is.
        ahead: the footsteps to come.
    """
    xi = (float(sensed.dcm[0]), float(sensed.dcm[1]))
    if state.mode == Mode.STAND:
        x, y = state.anchors[:, :2].mean(axis=0).tolist()
        return state, (x, y), (x, y)
    step = state.step
    if state.mode == Mode.SHIFT:
        return state, shift_zmp(gait, xi, step.foot[:2], ahead, max(state.shift_left, _LEAST_SHIFT)), xi
    foot, yaw = step.foot[:2], step.foot[2]
    came, short = _coming(gait, step)
    x0 = rotate(-yaw, (xi[0] - foot[0] - short[0], xi[1] - foot[1] - short[1]))
    step = _choose(gait, config, state, x0, ahead)
    share = min(step.phase / step.double_support, 1.0) if step.double_support > 0 else 1.0
    zmp = (step.origin[0] + share * came[0], step.origin[1] + share * came[1])
    return state._replace(step=step), zmp, dcm_of(gait, step, ahead)


def dcm_of(gait: Gait, step: Step, ahead: Chain) -> Pair:
    """Where the DCM is to be now, so that it ends the step where the next one needs it [m]."""
    foot, yaw = step.foot[:2], step.foot[2]
    _, short = _coming(gait, step)
    goal = aim(step, ahead, gait)
    decay = math.exp(-gait.omega * max(step.end - step.phase, 0.0))
    at_end = [decay * (goal.kappa * step.landing[i] + goal.rest[i]) / goal.growth for i in (0, 1)]
    beyond = rotate(yaw, (at_end[0], at_end[1]))
    return foot[0] + short[0] + beyond[0], foot[1] + short[1] + beyond[1]


def _coming(gait: Gait, step: Step) -> tuple[Pair, Pair]:
    """How far the ZMP comes over in double support, and what the DCM is short of because it isn't there yet [m]."""
    came = (step.foot[0] - step.origin[0], step.foot[1] - step.origin[1])
    return came, pendulum.ramp(gait.omega, came, step.double_support - step.phase, step.double_support)


def _choose(gait: Gait, config: WalkConfig, state: WalkerState, x0: Pair, ahead: Chain) -> Step:
    """The step with its landing adjusted."""
    step = state.step
    if step.end - step.phase < config.freeze:
        return step
    goal, limits = aim(step, ahead, gait), bounds(step, gait, config)
    limits = within_reach(step, limits, state.feet[1 - step.stance], config)
    if not config.adapt_time:
        limits = limits._replace(earliest=goal.end, latest=goal.end)
    if not config.adapt_steps:
        limits = limits._replace(least=goal.displacement, most=goal.displacement)
    rows = clear_of(gait, step, state.circles)
    chosen = adjust(config.step, gait.omega, x0, step.phase, step.end, goal, limits, rows)
    far = math.hypot(chosen.displacement[0] - goal.displacement[0], chosen.displacement[1] - goal.displacement[1])
    return step._replace(landing=chosen.displacement, end=chosen.end, moved=step.moved or far > _MOVED)


def aim(step: Step, ahead: Chain, gait: Gait) -> Aim:
    """The planned landing in the stance foot's frame."""
    yaw = step.foot[2]
    return Aim(step.planned, gait.step_time, ahead.kappa, rotate(-yaw, ahead.rest), ahead.growth)


def bounds(step: Step, gait: Gait, config: WalkConfig) -> Bounds:
    """What the adjustment may choose."""
    side = -1.0 if step.stance == LEFT else 1.0
    reach, inner, outer = landing_box(gait)
    least, most = sorted((side * inner, side * outer))
    length, width = 0.4 * gait.foot_length, 0.4 * gait.foot_width
    earliest = config.earliest * gait.step_time / 0.6
    return Bounds(
        (-reach, least),
        (reach, most),
        earliest,
        config.latest * gait.step_time,
        (gait.foot_ahead - length, -width),
        (gait.foot_ahead + length, width),
    )


def within_reach(step: Step, limits: Bounds, foot: Float[np.ndarray, "4"], config: WalkConfig) -> Bounds:
    """The bounds, less what the swing foot can't do in the time left: come down, and go where it is to land.

    Args:
        step: under way.
        limits: of the landing.
        foot: where the swing foot is now, in the plan: x, y, z [m], yaw [rad].
        config: the swing foot's speeds.
    """
    lifts = max(step.double_support - step.phase, 0.0)
    least = max(float(foot[2]), 0.0) / config.fall_speed + _TOUCH
    earliest = max(limits.earliest, step.phase + lifts + least)
    reach = config.swing_speed * max(max(step.end, earliest) - step.phase - lifts, 0.0)
    x, y = rotate(-step.foot[2], (float(foot[0]) - step.foot[0], float(foot[1]) - step.foot[1]))
    (x0, x1), (y0, y1) = (
        _overlap(low, high, at - reach, at + reach)
        for low, high, at in zip(limits.least, limits.most, (x, y), strict=True)
    )
    return limits._replace(least=(x0, y0), most=(x1, y1), earliest=earliest, latest=max(limits.latest, earliest))


def clear_of(gait: Gait, step: Step, circles: Float[np.ndarray, "circles 3"]) -> Float[np.ndarray, "rows 3"]:
    """Rows n . D >= least that keep the landing sole off the obstacles within reach; n in the stance foot's frame.

    The sole is a box, the obstacle seen from where the landing is planned: linearised there.
    """
    rows = []
    yaw = step.foot[2] + step.turn
    ahead = rotate(yaw, (gait.foot_ahead, 0.0))
    planned = rotate(step.foot[2], step.planned)
    for x, y, radius in circles.tolist():
        from_x, from_y = step.foot[0] + ahead[0] - x, step.foot[1] + ahead[1] - y
        away = math.hypot(from_x + planned[0], from_y + planned[1])
        if not 0 < away < radius + _NEAR:
            continue
        nx, ny = (from_x + planned[0]) / away, (from_y + planned[1]) / away
        along, aside = rotate(-yaw, (nx, ny))
        half = abs(along) * gait.foot_length / 2 + abs(aside) * gait.foot_width / 2
        rows.append((*rotate(-step.foot[2], (nx, ny)), radius + GAP + half - nx * from_x - ny * from_y))
    return np.array(rows).reshape(-1, 3)


def _overlap(low: float, high: float, least: float, most: float) -> Pair:
    """What two intervals have in common; where that is nothing, the end of the first that is nearest to the second."""
    start, end = max(low, least), min(high, most)
    if start <= end:
        return start, end
    return (low, low) if most < low else (high, high)


def landing_box(gait: Gait) -> tuple[float, float, float]:
    """How far ahead or back a foot may land from the other to catch a push, and how near and far aside [m]."""
    scale = gait.com_height / 0.465
    inner = max(gait.foot_distance - 0.035 * scale, gait.foot_width + _BETWEEN)
    return 0.24 * scale, min(inner, gait.foot_distance), gait.foot_distance + 0.16 * scale
