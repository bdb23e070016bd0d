"""Least-distance problems through DAQP, and what may be done with their answers.

    min |u|^2 / 2 + sum e_i^2 / (2 slack_i)   with   low - e <= M u <= high + e,   e = 0 for hard rows

DAQP turns every quadratic programme into this form itself (Arnstrom, Bemporad, Axehill 2022); handed over in it, with
the identity for a Hessian, the factorisation drops out.
"""

from __future__ import annotations

from typing import NamedTuple

import daqp
import numpy as np
from jaxtyping import Float, Int32

from toddle.walk.pattern.plan import Status

_SETTINGS = {"iter_limit": 500, "primal_tol": 1e-9}  # a solve takes about ten; tolerance of a row scaled to norm 1

_SHAPES = 64  # so many are kept
_IDLE: dict[tuple[int, int], list[daqp.Model]] = {}


class Answer(NamedTuple):
    """What came back: ``u`` counts only where ``status`` is solved.

    Attributes:
        u: the point.
        status: solved, infeasible, late or not finite.
        iterations: changes of the active set.
    """

    u: Float[np.ndarray, " unknowns"]
    status: Status
    iterations: int


def least_distance(
    matrix: Float[np.ndarray, "rows unknowns"],
    low: Float[np.ndarray, " rows"],
    high: Float[np.ndarray, " rows"],
    marks: Int32[np.ndarray, " rows"],
    slack: Float[np.ndarray, " rows"],
    seconds: float | None = None,
) -> Answer:
    """The point nearest to zero that keeps the rows.

    Args:
        matrix: M, contiguous.
        low: bounds; -1e30 for none.
        high: bounds; 1e30 for none.
        marks: 8 for a soft row, 0 for a hard one.
        slack: reciprocal of a soft row's weight.
        seconds: DAQP looks at the clock at every 32nd change of the active set, and gives up after these.
    """
    shape = matrix.shape
    workspace = _taken(shape)
    try:
        return _solved(workspace, matrix, low, high, marks, slack, seconds)
    finally:
        _IDLE.setdefault(shape, []).append(workspace)


def _solved(
    workspace: daqp.Model,
    matrix: Float[np.ndarray, "rows unknowns"],
    low: Float[np.ndarray, " rows"],
    high: Float[np.ndarray, " rows"],
    marks: Int32[np.ndarray, " rows"],
    slack: Float[np.ndarray, " rows"],
    seconds: float | None,
) -> Answer:
    workspace.settings = _SETTINGS | {"time_limit": 0.0 if seconds is None else max(seconds, 1e-9)}
    ready = workspace.update(A=matrix, bupper=high, blower=low, sense=marks)
    if ready < 0:
        nothing = np.zeros(matrix.shape[1])
        return Answer(nothing, _status(ready, nothing), 0)
    workspace.soft_weights(slack, slack)
    u, _, flag, info = workspace.solve()
    return Answer(u, _status(flag, u), info["iterations"])


def _taken(shape: tuple[int, int]) -> daqp.Model:
    """Memory for one shape of programme, for one solve at a time; what it was last used for doesn't matter."""
    if len(_IDLE) > _SHAPES:
        _IDLE.clear()
    try:
        return _IDLE[shape].pop()
    except (KeyError, IndexError):
        rows, count = shape
        marks, bounds = np.full(rows, 8, np.int32), np.ones(rows)
        model = daqp.Model()
        model.setup(np.eye(count), np.zeros(count), np.ones(shape), bounds, -bounds, marks)
        return model


def _status(flag: int, u: Float[np.ndarray, " unknowns"]) -> Status:
    if flag in (1, 2):
        return Status.SOLVED if np.isfinite(u).all() else Status.NOT_FINITE
    return Status.LATE if flag == -7 else Status.INFEASIBLE
