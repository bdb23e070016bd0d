"""The walking controller: a few footsteps and the motion of the centre of mass, from where the robot is now.

Huber 2019, section 2.1.3, in a reduced form: the future feet's yaws stand in for the 2 N yaw jerks; the feet are drawn
to the displacements that follow from the command (`displacement`), without which the printed objective under-tracks;
the ZMP's reference passes from foot to foot during double support, so an iteration may begin at any moment of a step
and end it at any time. Gauss-Newton, one step an iteration: yaws are linearised at those of the command, to which a
strong residual ties them, feet and ZMP at the last plan.

A plan must end where further steps can catch the robot (`nmpc_kernels.capture_rows`); the document doesn't ask that.
Foot hulls and relative yaw are hard rows and can always be kept. Balance and clearance are soft, so that there is an
answer always; ``violation`` and ``overlap`` say by how much they are exceeded. An answer that is late, not finite or
breaks a hard row isn't used: the last plan is, shifted to now.
"""

from __future__ import annotations

import math
import time

import numpy as np
from jaxtyping import Float

from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT, RIGHT
from toddle.signals import Footstep, Velocity
from toddle.walk.pattern.displacement import displacements
from toddle.walk.pattern.nmpc_kernels import Moment, assemble, shift, unfold
from toddle.walk.pattern.nmpc_problem import (
    NEVER,
    STILL,
    Nmpc,
    Plan,
    PlanState,
    Weights,
    apart,
    build,
    document_weights,
    drawn_to,
    turned,
    yaws_of,
)
from toddle.walk.pattern.obstacles import NONE, near
from toddle.walk.pattern.plan import Status
from toddle.walk.pattern.quadratic import least_distance

__all__ = ["NEVER", "STILL", "Nmpc", "Plan", "PlanState", "Weights", "apart", "document_weights", "nmpc", "plan"]

_BROKEN = 1e-5  # a hard row may be exceeded by so much [m], [rad]


def nmpc(gait: Gait, weights: Weights | None = None, *, freeze: float = 0.06, body: float | None = None) -> Nmpc:
    """The problem of a gait, ready for its first iteration.

    Args:
        gait: how the robot steps.
        weights: of the objective; None: the defaults, which track the command.
        freeze: the next landing is no longer moved so shortly before it [s].
        body: radius kept from obstacles around the centre of mass [m]; None: half the foot distance and 0.12.

    Raises:
        BadInput: the gait's hull can't be used.
    """
    problem = build(gait, weights or Weights(), freeze, body)
    _warm_up(problem)
    return problem


def _warm_up(problem: Nmpc) -> None:
    """Compiles, or loads what was compiled: else the first iteration would be late by a second."""
    half = problem.gait.foot_distance / 2
    left, right = Footstep(LEFT, 0.0, half, 0.0), Footstep(RIGHT, 0.0, -half, 0.0)
    state = PlanState(np.zeros((2, 3)), left, right, (0.0, -half), 0.0, problem.gait.step_time, 0.1)
    plan(problem, state, STILL, np.array([[1.0, 0.0, 0.1]]), plan(problem, state, STILL))


def plan(
    problem: Nmpc,
    state: PlanState,
    velocity: Velocity,
    circles: Float[np.ndarray, "circles 3"] = NONE,
    last: Plan | None = None,
    deadline_ms: float | None = None,
) -> Plan:
    """One iteration. Never raises, and never returns a number that isn't finite.

    Args:
        problem: of the gait.
        state: where the robot is.
        velocity: commanded; its direction turns with the robot. A robot that is to halt takes none.
        circles: obstacles in the plan's frame: centre and radius [m].
        last: the last plan, of this or of the step before; None: there is none.
        deadline_ms: an answer that took longer isn't used.
    """
    began = time.perf_counter_ns()
    velocity = velocity if state.halt == NEVER else STILL
    guess = nominal(problem, state, velocity) if last is None else shifted(problem, last, state, velocity)
    if not _finite(state, velocity, circles):
        return guess._replace(status=Status.NOT_FINITE, milliseconds=_since(began))
    found = _solve(problem, state, velocity, circles, guess, deadline_ms, last is not None)
    taken = _since(began)
    if deadline_ms is not None and taken > deadline_ms and found.status == Status.SOLVED:
        return guess._replace(status=Status.LATE, milliseconds=taken)
    return found._replace(milliseconds=taken)


def _solve(
    problem: Nmpc,
    state: PlanState,
    velocity: Velocity,
    circles: Float[np.ndarray, "circles 3"],
    guess: Plan,
    deadline_ms: float | None,
    known: bool,
) -> Plan:
    """Linearised at ``guess``; which is the answer where there is no better one."""
    numbers, foot = problem.numbers, state.support
    yaws = yaws_of(problem, state, velocity)
    drawn = drawn_to(problem, state, velocity)
    place = np.array([foot.x, foot.y, 0.0])
    com = state.com.copy()
    com[:, 0] -= place[:2]
    wide = problem.gait.steps * numbers.reach + numbers.body + 0.5
    around = near(circles, foot.x, foot.y, wide) if len(circles) else NONE
    pinned = known and 0 < state.remaining <= problem.freeze and state.halt != 0
    if pinned:
        yaws, drawn = _from_landing(problem, guess.feet[0], yaws, drawn, state, velocity)
    tables, moment = problem.tables, _moment(state, velocity)
    matrix, low, high, marks, slack, y, lower, inverse, shares, hard, zmp = assemble(
        tables, numbers, moment, com, drawn, yaws, guess.feet - place, guess.jerks, around, pinned
    )
    answer = least_distance(matrix, low, high, marks, slack, None if deadline_ms is None else deadline_ms / 1e3)
    if answer.status != Status.SOLVED:
        return guess._replace(status=answer.status)
    jerks, feet, displacement, reference, figures = unfold(
        answer.u, tables, numbers, moment, matrix, low, high, y, lower, inverse, shares, yaws, hard, zmp, place
    )
    broken, violation, overlap, active = figures.tolist()
    if not broken <= _BROKEN:
        return guess._replace(status=Status.INFEASIBLE if math.isfinite(broken) else Status.NOT_FINITE)
    return Plan(
        feet,
        displacement,
        jerks[:, 0],
        jerks,
        reference,
        Status.SOLVED,
        0.0,
        active > 0,
        violation,
        overlap,
        state,
    )


def _from_landing(
    problem: Nmpc,
    landing: Float[np.ndarray, "3"],
    yaws: Float[np.ndarray, " soles"],
    drawn: Float[np.ndarray, "steps 2"],
    state: PlanState,
    velocity: Velocity,
) -> tuple[Float[np.ndarray, " soles"], Float[np.ndarray, "steps 2"]]:
    """Yaws and displacements where the next landing is settled already: the others follow from it."""
    after = state._replace(support=Footstep(1 - state.support.side, *landing.tolist()), first=None)
    following = drawn_to(problem, after, velocity)
    yaws = np.concatenate([yaws[:1], turned(problem, float(landing[2]), velocity)[:-1]])
    return yaws, np.concatenate([drawn[:1], following[:-1]])


def nominal(problem: Nmpc, state: PlanState, velocity: Velocity) -> Plan:
    """The plan that follows from the command alone: no jerk. Numbers that aren't finite count as 0."""
    state = _usable(state)
    velocity = velocity if all(map(math.isfinite, velocity)) else STILL
    drawn, yaws = drawn_to(problem, state, velocity), yaws_of(problem, state, velocity)
    feet = np.column_stack([np.array([state.support.x, state.support.y]) + drawn.cumsum(axis=0), yaws[1:]])
    count = problem.gait.preview
    zmp = np.repeat(np.array([[state.support.x, state.support.y]]), count, axis=0)
    return Plan(feet, drawn, np.zeros(2), np.zeros((2, count)), zmp, Status.SOLVED, 0.0, False, 0.0, 0.0, state)


def shifted(problem: Nmpc, last: Plan, state: PlanState, velocity: Velocity) -> Plan:
    """The last plan, seen from now: a landing that has been is dropped, and one more is added by the command."""
    before = last.state
    switched = state.support.side != before.support.side
    elapsed = before.remaining + state.phase if switched else state.phase - before.phase
    if not math.isfinite(elapsed):
        return last
    gait = problem.gait
    late = min(max(round(elapsed / gait.sample), 0), gait.preview)
    step, turn = np.zeros(2), 0.0
    if switched:
        speed = velocity if all(map(math.isfinite, velocity)) else STILL
        side, yaw = (before.support.side + len(last.feet)) % 2, float(last.feet[-1, 2])
        step = np.array(displacements(apart(gait, speed), gait.step_time, speed, side, yaw, 1)[0])
        turn = float(turned(problem, yaw, speed)[1])
    jerks, zmp, feet, moved = shift(last.jerks, last.zmp, last.feet, last.displacement, late, switched, step, turn)
    return last._replace(
        feet=feet,
        displacement=moved,
        jerk=jerks[:, 0],
        jerks=jerks,
        zmp=zmp,
        status=Status.SOLVED,
        state=_usable(state),
    )


def _moment(state: PlanState, velocity: Velocity) -> Moment:
    foot = state.support
    return Moment(
        foot.yaw,
        1.0 if foot.side == LEFT else -1.0,
        state.lifted.x - foot.x,
        state.lifted.y - foot.y,
        state.origin[0] - foot.x,
        state.origin[1] - foot.y,
        float(state.phase),
        float(state.remaining),
        float(state.double_support),
        float(state.halt),
        float(velocity.vx),
        float(velocity.vy),
        float(velocity.omega),
    )


def _finite(state: PlanState, velocity: Velocity, circles: Float[np.ndarray, "circles 3"]) -> bool:
    foot, other = state.support, state.lifted
    total = foot.x + foot.y + foot.yaw + other.x + other.y + other.yaw + state.origin[0] + state.origin[1]
    total += state.phase + state.remaining + state.double_support + velocity.vx + velocity.vy + velocity.omega
    total += sum(state.first or ())
    return math.isfinite(total + float(state.com.sum()) + (float(circles.sum()) if len(circles) else 0.0))


def _usable(state: PlanState) -> PlanState:
    """The state with 0 for each number that isn't finite."""
    numbers = (*state.support[1:], *state.lifted[1:], *state.origin, *state[4:7], *state.com.flat)
    if all(map(math.isfinite, numbers)):
        return state

    x, y, yaw, x2, y2, yaw2, *origin, phase, remaining, over = (n if math.isfinite(n) else 0.0 for n in numbers[:11])
    return PlanState(
        np.nan_to_num(state.com, nan=0.0, posinf=0.0, neginf=0.0),
        Footstep(state.support.side, x, y, yaw),
        Footstep(state.lifted.side, x2, y2, yaw2),
        (origin[0], origin[1]),
        phase,
        remaining,
        over,
        state.halt,
    )


def _since(began: int) -> float:
    return (time.perf_counter_ns() - began) / 1e6
