"""Least-distance problems through DAQP, and what may be done with their answers.

    min |u|^2 / 2   with   low <= M u <= high,   some rows soft

DAQP turns every quadratic programme into this form itself (Arnstrom, Bemporad, Axehill 2022); handed over in it, the
factorisation of the Hessian drops out. A soft row of unit norm may be exceeded by e at the cost e^2 / (2 `SLACK`).
"""

from __future__ import annotations

from typing import NamedTuple

import daqp
import numpy as np
from jaxtyping import Float, Int32

from toddle.walk.pattern.plan import Status

SLACK = 1e-6
"""Reciprocal of a soft row's weight, on the row scaled to norm 1."""

_ITERATIONS = 500  # a solve takes about ten
_TOLERANCE = 1e-9  # of a row scaled to norm 1


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
    seconds: float | None = None,
) -> Answer:
    """The point nearest to zero that keeps the rows.

    Args:
        matrix: M, contiguous.
        low: bounds; -1e30 for none.
        high: bounds; 1e30 for none.
        marks: 8 for a soft row, 0 for a hard one.
        seconds: DAQP looks at the clock at every 32nd change of the active set, and gives up after these.
    """
    limit = 0.0 if seconds is None else max(seconds, 1e-9)
    u, _, flag, info = daqp.solve(
        None,
        None,
        matrix,
        high,
        low,
        marks,
        rho_soft=SLACK,
        iter_limit=_ITERATIONS,
        primal_tol=_TOLERANCE,
        time_limit=limit,
    )
    return Answer(u, _status(flag, u), info["iterations"])


def _status(flag: int, u: Float[np.ndarray, " unknowns"]) -> Status:
    if flag in (1, 2):
        return Status.SOLVED if np.isfinite(u).all() else Status.NOT_FINITE
    return Status.LATE if flag == -7 else Status.INFEASIBLE
