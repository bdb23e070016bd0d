"""Where and when the swing foot lands, so that the next step starts with the DCM it needs.

A quadratic programme of five unknowns, solved every tick: displacement D of the landing from the stance foot, growth
tau = exp(omega t_remaining) in place of time, and a shift u of the zero moment point:

    minimise  w_d |D - D_n|^2 + w_t (tau - tau_n)^2 + w_u |u|^2
              + w_b |x0 tau + (1 - tau_last) u - (kappa D + b2) / E|^2

(after Khadiv 2016, with the DCM's error judged at the step's end). x0 is the DCM from the stance foot less the rest of
the double support; kappa D + b2 over E is the DCM that the next step needs. The product of tau and u is linearised at
the last tick's tau. All in the stance foot's frame, where every bound is a box; obstacles add rows on D.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import daqp
import numpy as np
from jaxtyping import Float

from toddle.walk.balance.pendulum import Pair

_SOFT = 8  # DAQP's mark of a row that may be broken, at a price


@dataclass(frozen=True)
class StepWeights:
    """Weights of the programme: of D, tau and u against what was planned, and of the DCM's error at landing."""

    displacement: float = 1.0
    time: float = 0.002
    shift: float = 0.05
    landing: float = 50.0


class Aim(NamedTuple):
    """The step as planned, in the stance foot's frame.

    Attributes:
        displacement: of the landing from the stance foot [m].
        end: when it lands, from the step's start [s].
        kappa: factor of the displacement in the DCM that the next step needs.
        rest: what the steps after it add, b2 [m].
        growth: E of the next step.
    """

    displacement: Pair
    end: float
    kappa: float
    rest: Pair
    growth: float


class Bounds(NamedTuple):
    """What may be chosen, in the stance foot's frame: least and greatest displacement, end time, shift; [m] and [s]."""

    least: Pair
    most: Pair
    earliest: float
    latest: float
    shift_least: Pair
    shift_most: Pair


class Adjustment(NamedTuple):
    """The step as it will be: displacement [m] in the stance frame, end [s] from the step's start, ZMP shift [m]."""

    displacement: Pair
    end: float
    shift: Pair
    solved: bool


def adjust(
    weights: StepWeights,
    omega: float,
    x0: Pair,
    phase: float,
    last_end: float,
    aim: Aim,
    bounds: Bounds,
    rows: Float[np.ndarray, "rows 3"] | None = None,
) -> Adjustment:
    """Choose the landing.

    Args:
        weights: of the cost.
        omega: of the pendulum [rad/s].
        x0: DCM from the stance foot, less the ramp that is left [m], in the stance frame.
        phase: time since the step's start [s].
        last_end: the end chosen a tick ago, from the step's start [s].
        aim: the step as planned.
        bounds: of the unknowns.
        rows: obstacles, each ``n_x, n_y, least``: n . D >= least [m]; soft.

    Returns:
        The adjustment; the aim itself, not ``solved``, where the programme has no answer.
    """
    tau_last = math.exp(omega * max(last_end - phase, 0.0))
    tau_aim = math.exp(omega * max(aim.end - phase, 0.0))
    hessian = np.diag([weights.displacement] * 2 + [weights.time] + [weights.shift] * 2)
    gradient = np.array(
        [
            -weights.displacement * aim.displacement[0],
            -weights.displacement * aim.displacement[1],
            -weights.time * tau_aim,
            0.0,
            0.0,
        ]
    )
    for axis in (0, 1):
        row = np.zeros(5)
        row[axis], row[2], row[3 + axis] = -aim.kappa / aim.growth, x0[axis], 1 - tau_last
        hessian += weights.landing * np.outer(row, row)
        gradient -= weights.landing * row * (aim.rest[axis] / aim.growth)
    earliest = math.exp(omega * max(bounds.earliest - phase, 0.0))
    latest = max(math.exp(omega * max(bounds.latest - phase, 0.0)), earliest)
    lower = np.array([*bounds.least, earliest, *bounds.shift_least])
    upper = np.array([*bounds.most, latest, *bounds.shift_most])
    answer, _, flag, _ = daqp.solve(hessian, gradient, *_with_rows(lower, upper, rows))
    if flag < 1 or not np.isfinite(answer).all():
        return Adjustment(aim.displacement, aim.end, (0.0, 0.0), False)
    dx, dy, tau, ux, uy = answer.tolist()
    return Adjustment((dx, dy), phase + math.log(tau) / omega, (ux, uy), True)


def _with_rows(
    lower: Float[np.ndarray, "5"], upper: Float[np.ndarray, "5"], rows: Float[np.ndarray, "rows 3"] | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Constraint rows, upper and lower bounds, and sense in DAQP's order: simple bounds first."""
    if rows is None or not len(rows):
        return np.zeros((0, 5)), upper, lower, np.zeros(5, np.int32)
    normals = np.zeros((len(rows), 5))
    normals[:, :2] = rows[:, :2]
    sense = np.zeros(5 + len(rows), np.int32)
    sense[5:] = _SOFT
    return normals, np.concatenate([upper, np.full(len(rows), 1e30)]), np.concatenate([lower, rows[:, 2]]), sense
