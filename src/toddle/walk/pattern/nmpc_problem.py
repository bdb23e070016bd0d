"""What the reduced walking controller is given and gives, and the parts of its problem that never change.

The equations stand in `nmpc` and `nmpc_kernels`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.robots.gait import Gait
from toddle.signals import Footstep, Velocity
from toddle.walk.pattern.displacement import Pair, displacements
from toddle.walk.pattern.feasible import landing_hull, widening
from toddle.walk.pattern.nmpc_kernels import Numbers, Tables
from toddle.walk.pattern.plan import Status
from toddle.walk.pattern.time_stepping import time_stepping

STILL = Velocity(0.0, 0.0, 0.0)

NEVER = -1
"""``halt`` of a robot that walks on."""

GAP = 0.01
"""Kept between a sole and an obstacle [m]."""

_STILL = 1e6  # weight of the displacement that ends with both feet side by side
_LAST = 1e-3  # without displacements, a foot that no cost touches is held by this share of beta


@dataclass(frozen=True)
class Weights:
    """Of the objective: 2.43 to 2.46, and two more.

    Attributes:
        alpha: of the velocity.
        beta: of the ZMP's distance from its reference.
        gamma: of the jerk.
        delta: of a footstep's distance from its displacement.
        yaw: of a turn's distance from the commanded one.
    """

    alpha: float = 0.01
    beta: float = 1e2
    gamma: float = 1e-5
    delta: float = 1e3
    yaw: float = 1e5


def document_weights(gait: Gait) -> Weights:
    """The weights that the document prints for a gait; no displacements."""
    alpha, beta, gamma = gait.objective
    return Weights(alpha, beta, gamma, 0.0)


@dataclass(frozen=True)
class Nmpc:
    """What doesn't change between iterations. Made by `nmpc`.

    Attributes:
        gait: how the robot steps.
        weights: of the objective.
        tables: time-stepping and factor.
        numbers: weights and lengths, for the kernels.
        freeze: the next landing is no longer moved so shortly before it [s].
    """

    gait: Gait
    weights: Weights
    tables: Tables
    numbers: Numbers
    freeze: float


class PlanState(NamedTuple):
    """Where the robot is, in the plan's frame.

    Attributes:
        com: x and y of the centre of mass: position, velocity, acceleration (omega^2 (c - p)) [m, s].
        support: the sole that carries in this step.
        lifted: where the other sole stood when this step began.
        origin: where the ZMP was when this step began [m]: the other sole, or between the feet out of standing.
        phase: time since this step began [s].
        remaining: until it ends [s]; any, the following steps take the gait's time.
        double_support: how long the weight takes to come over from ``origin`` [s].
        halt: the robot stands after so many landings, with both feet side by side; 0: it stands; `NEVER`.
        first: displacement x, y [m] in the plan's frame and turn [rad] that the next landing is drawn to, where it was
            settled before the command changed; None: the command's.
    """

    com: Float[np.ndarray, "2 3"]
    support: Footstep
    lifted: Footstep
    origin: Pair
    phase: float
    remaining: float
    double_support: float
    halt: int = NEVER
    first: tuple[float, float, float] | None = None


class Plan(NamedTuple):
    """An iteration's answer; ``feet`` and the rest are usable whatever the status is.

    Attributes:
        feet: the landings to come: x, y [m], yaw [rad]; the first is that of the foot in the air.
        displacement: of each landing from the one before, the first from the support foot [m].
        jerk: of x and y until the next sample [m/s^3].
        jerks: over the horizon.
        zmp: reference at the samples [m].
        status: solved, or why this is the last plan shifted.
        milliseconds: the iteration took, wall clock.
        obstacle: a clearance decides the plan.
        violation: of the soft rows of balance (ZMP, capture at the horizon's end), the greatest [m].
        overlap: of the soft clearance rows, the greatest [m].
        state: it was made at.
    """

    feet: Float[np.ndarray, "steps 3"]
    displacement: Float[np.ndarray, "steps 2"]
    jerk: Float[np.ndarray, "2"]
    jerks: Float[np.ndarray, "2 samples"]
    zmp: Float[np.ndarray, "samples 2"]
    status: Status
    milliseconds: float
    obstacle: bool
    violation: float
    overlap: float
    state: PlanState


def build(gait: Gait, weights: Weights, freeze: float, body: float | None) -> Nmpc:
    """The problem of a gait; arguments as in `nmpc.nmpc`."""
    step = time_stepping(gait.preview, gait.sample, gait.com_height)
    hessian = (
        weights.alpha * step.velocity_jerk.T @ step.velocity_jerk
        + weights.beta * step.zmp_jerk.T @ step.zmp_jerk
        + weights.gamma * np.eye(gait.preview)
    )
    upper = np.linalg.cholesky(hessian[::-1, ::-1])[::-1, ::-1]
    inverse = np.ascontiguousarray(np.linalg.inv(upper))
    position, speed, zmp = (
        np.ascontiguousarray(u @ inverse.T) for u in (step.position_jerk, step.velocity_jerk, step.zmp_jerk)
    )
    hull = landing_hull(gait)
    tables = Tables(
        step.position_state,
        step.velocity_state,
        step.zmp_state,
        step.zmp_jerk,
        step.position_jerk,
        position,
        speed,
        zmp,
        inverse,
        hull.rows,
    )
    front, rear = (gait.foot_ahead + way * (gait.foot_length / 2 - gait.margin[0]) for way in (1, -1))
    growth = math.exp(gait.omega * gait.step_time)
    inner, outer = hull.corners[:, 1].min(), hull.corners[:, 1].max()
    numbers = Numbers(
        alpha=weights.alpha,
        beta=weights.beta,
        delta=weights.delta,
        still=max(_STILL, weights.delta),
        last=0.0 if weights.delta > 0 else _LAST * weights.beta,
        yaw=math.sqrt(weights.yaw),
        step_time=gait.step_time,
        double_support=gait.double_support,
        sample=gait.sample,
        longest_turn=gait.longest_turn,
        rear=min(rear, 0.0),
        front=max(front, 0.0),
        side=gait.foot_width / 2 - gait.margin[1],
        half_length=gait.foot_length / 2,
        half_width=gait.foot_width / 2,
        ahead=gait.foot_ahead,
        gap=GAP,
        body=gait.foot_distance / 2 + 0.12 if body is None else body,
        reach=hull.reach,
        omega=gait.omega,
        end_ahead=float(np.abs(hull.corners[:, 0]).max() * growth / (growth - 1)),
        end_inner=float((inner - outer / growth) / (1 - growth**-2)),
        end_outer=float((outer - inner / growth) / (1 - growth**-2)),
    )
    return Nmpc(gait, weights, tables, numbers, freeze)


def turned(problem: Nmpc, yaw: float, velocity: Velocity) -> Float[np.ndarray, " soles"]:
    """Yaws by the command: of the support foot and of the landings to come [rad]."""
    most = problem.gait.longest_turn
    turn = min(max(velocity.omega * problem.gait.step_time, -most), most)
    return yaw + turn * np.arange(problem.gait.steps + 1)


def yaws_of(problem: Nmpc, state: PlanState, velocity: Velocity) -> Float[np.ndarray, " soles"]:
    """Yaws that the soles are tied to: of the support foot and of the landings to come [rad]."""
    if state.first is None:
        return turned(problem, state.support.yaw, velocity)
    most = problem.gait.longest_turn
    first = state.support.yaw + min(max(state.first[2], -most), most)
    return np.concatenate([[state.support.yaw], turned(problem, first, velocity)[:-1]])


def drawn_to(problem: Nmpc, state: PlanState, velocity: Velocity) -> Float[np.ndarray, "steps 2"]:
    """Displacements by the command, each from the foot before [m]."""
    gait, foot = problem.gait, state.support
    wide = apart(gait, velocity)
    if state.first is None:
        return np.array(displacements(wide, gait.step_time, velocity, foot.side, foot.yaw, gait.steps))
    yaw = foot.yaw + state.first[2]
    later = displacements(wide, gait.step_time, velocity, 1 - foot.side, yaw, gait.steps - 1)
    return np.array([state.first[:2], *later])


def apart(gait: Gait, velocity: Velocity) -> float:
    """The foot distance, widened where the hull asks for it [m]."""
    return gait.foot_distance + (widening(velocity, gait) or 0.0)
