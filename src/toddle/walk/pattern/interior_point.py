"""Least-distance problems by an interior point with a fixed number of iterations, for accelerators and float32.

    min |u|^2 / 2 + sum e_i^2 / (2 slack_i)   with   low - e <= M u <= high + e,   e = 0 for hard rows

as in `quadratic`, which solves the same by active sets. Mehrotra's predictor and corrector (1992) on each bound

    a.u + t - slack l = b,   t l = 0,   t, l >= 0

A soft row's slack leaves the equations by itself: its weight in I + M' D M is l / (t + slack l), never above
1 / slack. Rows are scaled to length 1, bounds by the farthest one, so that single precision holds.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax.scipy.linalg import solve_triangular
from jaxtyping import Array, Bool, Float

ITERATIONS = 12
"""Of the predictor and corrector."""

UNBOUNDED = 1e29
"""A bound of this size or more is none."""

_SHORT = 1e-12  # a row shorter than this says nothing
_HARD = 1e-10  # slack of a hard row, scaled: a multiplier stays finite where hard rows contradict each other
_FORCE = 1e5  # of every row at the start, scaled: conflicting rows end with such multipliers, and it is easily lowered
_NEAR = 0.995  # share of the way to the boundary that a step takes


class Interior(NamedTuple):
    """What came back.

    Attributes:
        u: the point.
        gap: mean product of room and multiplier, scaled: how far from the optimum.
        residual: the greatest residual of the optimality conditions, scaled.
    """

    u: Float[Array, " unknowns"]
    gap: Float[Array, ""]
    residual: Float[Array, ""]


class _Sides(NamedTuple):
    """Of the lower and the upper bounds: room t and multiplier l."""

    room: Float[Array, "2 rows"]
    force: Float[Array, "2 rows"]


class _Scaled(NamedTuple):
    """Rows of length 1; bounds as a.u <= b for the upper, -a.u <= b for the lower ones."""

    matrix: Float[Array, "rows unknowns"]
    bound: Float[Array, "2 rows"]
    present: Bool[Array, "2 rows"]
    slack: Float[Array, " rows"]
    unit: Float[Array, ""]


@partial(jax.jit, static_argnames="iterations")
def interior_point(
    matrix: Float[Array, "rows unknowns"],
    low: Float[Array, " rows"],
    high: Float[Array, " rows"],
    slack: Float[Array, " rows"],
    iterations: int = ITERATIONS,
) -> Interior:
    """The point nearest to zero that keeps the rows; the work doesn't depend on the numbers, so it can be mapped.

    Args:
        matrix: M; rows of zeros are passed over.
        low: bounds; -1e30 for none.
        high: bounds; 1e30 for none.
        slack: reciprocal of a soft row's weight; 0 for a hard row.
        iterations: of the predictor and corrector.
    """
    problem = _scaled(matrix, low, high, slack)
    room = jnp.where(problem.present, jnp.maximum(problem.bound, 1.0), 1.0)
    force = jnp.where(problem.present, _FORCE, 0.0).astype(matrix.dtype)
    start = (jnp.zeros_like(matrix[0]), _Sides(room, force))
    (u, sides), _ = jax.lax.scan(lambda at, _: (_iterate(problem, *at), None), start, length=iterations)
    dual, primal = _residuals(problem, u, sides)
    residual = jnp.maximum(jnp.abs(dual).max(), jnp.abs(primal).max())
    return Interior(u * problem.unit, _gap(problem, sides), residual)


def _scaled(
    matrix: Float[Array, "rows unknowns"],
    low: Float[Array, " rows"],
    high: Float[Array, " rows"],
    slack: Float[Array, " rows"],
) -> _Scaled:
    length = jnp.sqrt((matrix * matrix).sum(axis=1))
    says = length > _SHORT
    by = 1.0 / jnp.where(says, length, 1.0)
    present = jnp.stack([says & (low > -UNBOUNDED), says & (high < UNBOUNDED)])
    bound = jnp.where(present, jnp.stack([-low * by, high * by]), 1.0)
    unit = jnp.maximum(-bound.min(), 1e-3)
    soft = jnp.maximum(slack * by * by, _HARD)
    return _Scaled(matrix * by[:, None], bound / unit, present, soft, unit)


def _rows(problem: _Scaled, u: Float[Array, " unknowns"]) -> Float[Array, "2 rows"]:
    value = _times(problem.matrix, u)
    return jnp.stack([-value, value])


def _columns(problem: _Scaled, force: Float[Array, "2 rows"]) -> Float[Array, " unknowns"]:
    return _times(force[1] - force[0], problem.matrix)


def _residuals(
    problem: _Scaled, u: Float[Array, " unknowns"], sides: _Sides
) -> tuple[Float[Array, " unknowns"], Float[Array, "2 rows"]]:
    primal = _rows(problem, u) + sides.room - problem.slack[None] * sides.force - problem.bound
    return u + _columns(problem, sides.force), jnp.where(problem.present, primal, 0.0)


def _gap(problem: _Scaled, sides: _Sides) -> Float[Array, ""]:
    return (sides.room * sides.force).sum() / jnp.maximum(problem.present.sum(), 1).astype(sides.room.dtype)


def _iterate(problem: _Scaled, u: Float[Array, " unknowns"], sides: _Sides) -> tuple[Float[Array, " unknowns"], _Sides]:
    """One predictor and one corrector, with one factorisation."""
    room, force = sides
    dual, primal = _residuals(problem, u, sides)
    slack = problem.slack[None]
    by = 1.0 / (room + slack * force)
    inverse = _inverse_root(problem.matrix, (force * by).sum(axis=0))

    def direction(product: Float[Array, "2 rows"]) -> tuple[Float[Array, " unknowns"], _Sides]:
        known = jnp.where(problem.present, (force * primal - product) * by, 0.0)
        du = -_times(inverse, _times(inverse.T, dual + _columns(problem, known)))
        along = _rows(problem, du)
        df = known + force * along * by
        dr = jnp.where(problem.present, slack * df - primal - along, 0.0)
        return du, _Sides(dr, df)

    gap = _gap(problem, sides)
    _, ahead = direction(room * force)
    length = jnp.minimum(_longest(sides, ahead), 1.0)
    tried = _gap(problem, _Sides(room + length * ahead.room, force + length * ahead.force))
    centre = (tried / jnp.maximum(gap, jnp.finfo(u.dtype).tiny)) ** 3 * gap
    du, change = direction(room * force + ahead.room * ahead.force - centre)
    length = jnp.minimum(_NEAR * _longest(sides, change), 1.0)
    return u + length * du, _Sides(room + length * change.room, force + length * change.force)


def _inverse_root(
    matrix: Float[Array, "rows unknowns"], weight: Float[Array, " rows"]
) -> Float[Array, "unknowns unknowns"]:
    """X with X X' the inverse of I + M' diag(weight) M.

    In single precision by two Cholesky factorisations, the first of a matrix with a larger diagonal, the second of what
    that leaves: as exact as by orthogonal transformations (shifted CholeskyQR; Fukaya and others 2020), and all products.
    """
    count = matrix.shape[1]
    one = jnp.eye(count, dtype=matrix.dtype)
    tall = jnp.concatenate([jnp.sqrt(weight)[:, None] * matrix, one])
    if matrix.dtype == jnp.float64:
        return _inverse_of_root(_times(tall.T, tall))
    normal = _times(tall.T, tall)
    shift = 4.0 * jnp.finfo(matrix.dtype).eps * jnp.trace(normal)
    first = _inverse_of_root(normal + shift * one)
    left = _times(tall, first)
    return _times(first, _inverse_of_root(_times(left.T, left)))


def _inverse_of_root(normal: Float[Array, "unknowns unknowns"]) -> Float[Array, "unknowns unknowns"]:
    root = jnp.linalg.cholesky(normal)
    return solve_triangular(root, jnp.eye(len(root), dtype=root.dtype), lower=True).T


def _times(a: Float[Array, "..."], b: Float[Array, "..."]) -> Float[Array, "..."]:
    """The product in full precision, which not every accelerator takes by itself."""
    return jnp.matmul(a, b, precision=jax.lax.Precision.HIGHEST)


def _longest(sides: _Sides, change: _Sides) -> Float[Array, ""]:
    """The step that reaches the boundary."""
    values, changes = jnp.stack(sides), jnp.stack(change)
    ratios = jnp.where(changes < 0, -values / jnp.where(changes < 0, changes, -1.0), jnp.inf)
    return ratios.min()
