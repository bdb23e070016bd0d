"""The two quadratic programmes of one iteration of the document's walking pattern (Huber 2019, 2.43 to 2.88).

Positions (2.53): N jerks and N_f footsteps along x and y, with the yaws of the soles held at the last iteration's
prediction. Yaws (2.54): N jerks of each sole. The author's program solves the two apart, since the block of 2.86 that
would couple them is zero there (`document_rows`), and freezes the next footstep in the last two samples of a step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import daqp
import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT
from toddle.signals import Circle
from toddle.walk.pattern.document_rows import Preview, Rows, edges, hull_rows, obstacle_rows, zmp_rows
from toddle.walk.pattern.time_stepping import TimeStepping, time_stepping

FROZEN = 3
"""Fewer samples than this before the end of a step, the next footstep is that of the last iteration."""

_STAY = 1e-4
"""Weight that holds a footstep without cost near its last value, in parts of beta: of all optima the nearest."""

_VIOLATION = 1e-6
"""Of a row, above which an answer is none [m, rad, rad/s]."""

_EQUALITY = 5
_SETTINGS = {"primal_tol": 1e-9, "dual_tol": 1e-12, "sing_tol": 1e-14, "eps_prox": 0.0, "iter_limit": 2000}


class Programme(NamedTuple):
    """Minimise x'Hx / 2 + g'x within rows; the first bounds, where there are more than rows, are of x itself."""

    hessian: Float[np.ndarray, "unknowns unknowns"]
    gradient: Float[np.ndarray, " unknowns"]
    rows: Float[np.ndarray, "rows unknowns"]
    lower: Float[np.ndarray, " bounds"]
    upper: Float[np.ndarray, " bounds"]
    equality: int = 0
    """How many of the last rows are equalities."""


class Model(NamedTuple):
    """What no iteration changes, worked out once for a gait.

    Attributes:
        gait: as given.
        samples: of one step.
        matrices: of the preview horizon.
        previews: how the samples are dealt, by the samples left of the step less one.
        hessians: of one axis (2.56), in the same order.
        stay: the part of their diagonals that only holds footsteps in place.
        box: of the zero moment point in a sole's frame [m].
        normals: of the hulls of the footsteps to come, by the side that stands.
        offsets: the same [m].
        angle_state: the yaw at each sample by the state, with the yaw rates as unknowns.
        angle_rate: the same by the rates [s].
        jerk_rate: jerks by yaw rates, the inverse of P_vu.
    """

    gait: Gait
    samples: int
    matrices: TimeStepping
    previews: tuple[Preview, ...]
    hessians: tuple[np.ndarray, ...]
    stay: tuple[np.ndarray, ...]
    box: Float[np.ndarray, "2 2"]
    normals: tuple[np.ndarray, np.ndarray]
    offsets: tuple[np.ndarray, np.ndarray]
    angle_state: Float[np.ndarray, "samples 3"]
    angle_rate: Float[np.ndarray, "samples samples"]
    jerk_rate: Float[np.ndarray, "samples samples"]


def model(gait: Gait) -> Model:
    """The constant parts of the problem.

    Raises:
        BadInput: the gait has no hull, or its step is not a whole number of samples.
    """
    per_step = round(gait.step_time / gait.sample)
    if not math.isclose(per_step * gait.sample, gait.step_time, rel_tol=1e-9):
        raise BadInput(
            f"a step of {gait.step_time:g} s is not a whole number of samples of {gait.sample:g} s",
            where="gait, step_time",
            remedy="the document's pattern needs a multiple of sample",
        )
    if len(gait.hull) < 3:
        raise BadInput("there is none", where="gait, hull", remedy="give at least three corners x, y")
    matrices = time_stepping(gait.preview, gait.sample, gait.com_height)
    previews = tuple(_preview(gait, matrices, per_step, left) for left in range(1, per_step + 1))
    stay = tuple(_stay(gait, preview) for preview in previews)
    hulls = np.array(gait.hull, float)
    (left, left_offset), (right, right_offset) = edges(hulls), edges(hulls * [1.0, -1.0])
    even = (np.arange(gait.steps) % 2 == 0)[:, None]
    inverse = np.linalg.inv(matrices.velocity_jerk)
    half = np.array([gait.foot_length, gait.foot_width]) / 2 - gait.margin
    ahead = np.array([gait.foot_ahead, 0.0])
    return Model(
        gait,
        per_step,
        matrices,
        previews,
        tuple(_hessian(gait, matrices, preview) + np.diag(held) for preview, held in zip(previews, stay, strict=True)),
        stay,
        np.array([ahead - half, ahead + half]),
        (np.where(even[..., None], right, left), np.where(even[..., None], left, right)),
        (np.where(even, right_offset, left_offset), np.where(even, left_offset, right_offset)),
        matrices.position_state - matrices.position_jerk @ inverse @ matrices.velocity_state,
        matrices.position_jerk @ inverse,
        inverse,
    )


def positions(
    model: Model,
    left: int,
    com: Float[np.ndarray, "2 3"],
    velocity: Float[np.ndarray, "2"],
    foot: Float[np.ndarray, "2"],
    side: int,
    yaw: Float[np.ndarray, " soles"],
    footsteps: Float[np.ndarray, "steps 2"],
    obstacles: Sequence[Circle],
) -> Programme:
    """The quadratic programme of the centre of mass and the footsteps.

    Args:
        model: of the gait.
        left: samples left of the step.
        com: x, y of the centre of mass and its derivatives.
        velocity: commanded, in the world [m/s].
        foot: the sole that stands [m].
        side: which one it is.
        yaw: of the soles: the one that stands, then the footsteps to come [rad].
        footsteps: of the last iteration [m].
        obstacles: on the floor.
    """
    gait, matrices, preview = model.gait, model.matrices, model.previews[left - 1]
    alpha, beta, _ = gait.objective
    samples = gait.preview
    stands = (preview.step == 0)[:, None]
    drift = matrices.zmp_state @ com.T - np.where(stands, foot, 0.0)
    gradient = beta * (preview.zmp.T @ drift)
    gradient[:samples] += alpha * (matrices.velocity_jerk.T @ (matrices.velocity_state @ com.T - velocity))
    gradient[samples:] -= model.stay[left - 1][samples:, None] * footsteps
    blocks = [
        zmp_rows(preview, drift, yaw, model.box),
        hull_rows(samples, foot, yaw, model.normals[side], model.offsets[side]),
    ]
    if obstacles:
        blocks.append(obstacle_rows(samples, footsteps, obstacles, max(gait.foot_length, gait.foot_width)))
    frozen = left < min(FROZEN, model.samples)
    if frozen:
        blocks[1].upper[: model.offsets[side].shape[1]] = np.inf
        blocks.append(_freeze(samples, footsteps))
    rows = Rows(*(np.concatenate(parts) for parts in zip(*blocks, strict=True)))
    width = samples + gait.steps
    hessian = np.zeros((2 * width, 2 * width))
    hessian[:width, :width] = hessian[width:, width:] = model.hessians[left - 1]
    return Programme(hessian, gradient.T.ravel(), *rows, equality=2 if frozen else 0)


def flying(model: Model, left: int, side: int) -> np.ndarray:
    """The side of the sole in the air at each sample: diagonals of E_L and E_R (2.50)."""
    return np.where(model.previews[left - 1].step % 2 == 0, 1 - side, side)


def yaws(model: Model, left: int, side: int, state: Float[np.ndarray, "2 3"], omega: float) -> Programme:
    """The quadratic programme of the soles' yaws (2.44, 2.73 to 2.78).

    The 2 N jerks obey N equalities: the sole that stands does not turn. What is left are the N yaw rates of the sole
    in the air, one for each sample, which are the unknowns here; `yaw_jerks` turns them into jerks.

    Args:
        model: of the gait.
        left: samples left of the step.
        side: of the sole that stands.
        state: yaw of left and right sole, rate and acceleration [rad, s].
        omega: commanded [rad/s].
    """
    samples, gait = model.gait.preview, model.gait
    sign = np.where(flying(model, left, side) == LEFT, -1.0, 1.0)
    apart = model.angle_state @ (state[1] - state[0])
    widest, fastest = np.full(samples, gait.longest_turn), np.full(samples, gait.fastest_turn)
    return Programme(
        np.eye(samples),
        np.full(samples, -float(omega)),
        model.angle_rate * sign,
        np.concatenate([-fastest, -widest - apart]),
        np.concatenate([fastest, widest - apart]),
    )


def yaw_jerks(
    model: Model, left: int, side: int, state: Float[np.ndarray, "2 3"], rates: Float[np.ndarray, " samples"]
) -> Float[np.ndarray, "2 samples"]:
    """Jerks of left and right sole that bring about the yaw rates of the sole in the air [rad/s^3]."""
    turning = flying(model, left, side) == np.arange(2)[:, None]
    drift = state @ model.matrices.velocity_state.T
    return (np.where(turning, rates, 0.0) - drift) @ model.jerk_rate.T


def solve(programme: Programme) -> np.ndarray | None:
    """The optimum by DAQP; None: there is none, or it was not found."""
    sense = np.zeros(len(programme.upper), np.int32)
    if programme.equality:
        sense[-programme.equality :] = _EQUALITY
    x, _, flag, _ = daqp.solve(
        programme.hessian,
        programme.gradient,
        programme.rows,
        np.minimum(programme.upper, 1e30),
        np.maximum(programme.lower, -1e30),
        sense,
        **_SETTINGS,
    )
    x = np.asarray(x)
    return x if flag == 1 and _violation(programme, x) <= _VIOLATION else None


def _violation(programme: Programme, x: np.ndarray) -> float:
    """By how much the worst bound or row is broken; the solver's own tolerance is of scaled rows."""
    values = programme.rows @ x
    values = np.concatenate([x[: len(programme.upper) - len(values)], values])
    return float(np.maximum(values - programme.upper, programme.lower - values).max())


def _preview(gait: Gait, matrices: TimeStepping, per_step: int, left: int) -> Preview:
    step = np.minimum((np.arange(gait.preview) + per_step - left) // per_step, gait.steps)
    chosen = step[:, None] == np.arange(1, gait.steps + 1)
    first = np.where(chosen.any(axis=0), chosen.argmax(axis=0), gait.preview)
    return Preview(step, np.hstack([matrices.zmp_jerk, -chosen.astype(float)]), first)


def _hessian(gait: Gait, matrices: TimeStepping, preview: Preview) -> np.ndarray:
    """One axis of 2.56."""
    alpha, beta, gamma = gait.objective
    hessian = beta * preview.zmp.T @ preview.zmp
    jerks = slice(gait.preview)
    hessian[jerks, jerks] += alpha * matrices.velocity_jerk.T @ matrices.velocity_jerk + gamma * np.eye(gait.preview)
    return hessian


def _stay(gait: Gait, preview: Preview) -> np.ndarray:
    beta = gait.objective[1]
    idle = (preview.first == gait.preview) | (beta == 0)
    return np.concatenate([np.zeros(gait.preview), np.where(idle, _STAY * (beta or 1.0), 0.0)])


def _freeze(samples: int, footsteps: Float[np.ndarray, "steps 2"]) -> Rows:
    matrix = np.zeros((2, 2, samples + len(footsteps)))
    matrix[[0, 1], [0, 1], samples] = 1.0
    return Rows(matrix.reshape(2, -1), footsteps[0], footsteps[0])
