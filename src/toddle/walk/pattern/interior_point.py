"""Least-distance problems by an interior point with a fixed number of iterations, for accelerators and float32.

    min |u|^2 / 2 + sum e_i^2 / (2 slack_i)   with   low - e <= M u <= high + e,   e = 0 for hard rows

as in `quadratic`, which solves the same by active sets. Mehrotra's predictor and corrector (1992), with Gondzio's
further correctors (1996), on each bound

    a.u + t - slack l = b,   t l = 0,   t, l >= 0

A soft row's slack leaves the equations by itself: its weight in I + M' D M is l / (t + slack l), never above
1 / slack. Rows are scaled to length 1, bounds by the farthest one, so that single precision holds.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

ITERATIONS = 12
"""Of the predictor and corrector."""

UNBOUNDED = 1e29
"""A bound of this size or more is none."""

_SMALL = 4  # a matrix no larger is factored element by element
_SHORT = 1e-12  # a row shorter than this says nothing
_HARD = {jnp.dtype("float32"): 1e-10, jnp.dtype("float64"): 1e-12}  # slack of a hard row, scaled: two may conflict
_FORCE = 1e5  # of every row at the start, scaled: conflicting rows end with such multipliers, and it is easily lowered
_CORRECTORS, _FURTHER, _OFF = 2, 0.3, 10.0  # Gondzio's (1996): try a longer step, mend products so far off the centre
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
    soft = jnp.maximum(slack * by * by, _HARD[matrix.dtype])
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


class _Change(NamedTuple):
    u: Float[Array, " unknowns"]
    sides: _Sides


def _iterate(problem: _Scaled, u: Float[Array, " unknowns"], sides: _Sides) -> tuple[Float[Array, " unknowns"], _Sides]:
    """One predictor and its correctors, with one factorisation."""
    room, force = sides
    dual, primal = _residuals(problem, u, sides)
    slack = problem.slack[None]
    by = 1.0 / (room + slack * force)
    inverse = _inverse_root(problem.matrix, (force * by).sum(axis=0))

    def direction(product: Float[Array, "2 rows"], share: float) -> _Change:
        """Lowers the products by these, and the residuals by a share of them."""
        known = jnp.where(problem.present, (share * force * primal - product) * by, 0.0)
        du = -_times(inverse, _times(inverse.T, share * dual + _columns(problem, known)))
        along = _rows(problem, du)
        df = known + force * along * by
        dr = jnp.where(problem.present, slack * df - share * primal - along, 0.0)
        return _Change(du, _Sides(dr, df))

    gap = _gap(problem, sides)
    ahead = direction(room * force, 1.0).sides
    tried = _gap(problem, _moved(sides, ahead, jnp.minimum(_longest(sides, ahead), 1.0)))
    centre = (tried / jnp.maximum(gap, jnp.finfo(u.dtype).tiny)) ** 3 * gap
    change = direction(room * force + ahead.room * ahead.force - centre, 1.0)
    for _ in range(_CORRECTORS):
        length = _longest(sides, change.sides)
        reached = _moved(sides, change.sides, jnp.minimum(length + _FURTHER, 1.0))
        products = reached.room * reached.force
        lacking = jnp.clip(products, centre / _OFF, centre * _OFF) - products
        more = direction(-jnp.maximum(lacking, -centre * _OFF), 0.0)
        both = jax.tree.map(jnp.add, change, more)
        better = _longest(sides, both.sides) >= jnp.minimum(length, 1.0) + _FURTHER / 10
        change = jax.tree.map(lambda new, old, take=better: jnp.where(take, new, old), both, change)
    length = jnp.minimum(_NEAR * _longest(sides, change.sides), 1.0)
    return u + length * change.u, _moved(sides, change.sides, length)


def _moved(sides: _Sides, change: _Sides, length: Float[Array, ""]) -> _Sides:
    return _Sides(sides.room + length * change.room, sides.force + length * change.force)


def _inverse_root(
    matrix: Float[Array, "rows unknowns"], weight: Float[Array, " rows"]
) -> Float[Array, "unknowns unknowns"]:
    """X with X X' the inverse of I + M' diag(weight) M.

    In single precision by two Cholesky factorisations, the first of a matrix with a larger diagonal, the second of what
    that leaves: as exact as orthogonal transformations (shifted CholeskyQR; Fukaya and others 2020), but all products.
    """
    one = jnp.eye(matrix.shape[1], dtype=matrix.dtype)
    tall = jnp.concatenate([jnp.sqrt(weight)[:, None] * matrix, one])
    normal = _times(tall.T, tall)
    if matrix.dtype == jnp.float64:
        return inverse_of_root(normal).T
    shift = 4.0 * jnp.finfo(matrix.dtype).eps * jnp.trace(normal)
    first = inverse_of_root(normal + shift * one).T
    left = _times(tall, first)
    return _times(first, inverse_of_root(_times(left.T, left)).T)


def inverse_of_root(h: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """The inverse of the lower Cholesky factor, by halves: products do nearly all, and a batch of them is fast.

    Args:
        h: positive definite.
    """
    n = len(h)
    if n <= _SMALL:
        return _written_out(h)
    k = n // 2
    above = inverse_of_root(h[:k, :k])
    beside = _times(h[k:, :k], above.T)
    below = inverse_of_root(h[k:, k:] - _times(beside, beside.T))
    corner = -_times(below, _times(beside, above))
    return jnp.block([[above, jnp.zeros((k, n - k), h.dtype)], [corner, below]])


def _written_out(h: Float[Array, "n n"]) -> Float[Array, "n n"]:
    n, none = len(h), jnp.zeros_like(h[0, 0])
    root, inverse = [[none] * n for _ in range(n)], [[none] * n for _ in range(n)]
    for j in range(n):
        for i in range(j, n):
            total = h[i, j] - sum((root[i][k] * root[j][k] for k in range(j)), start=none)
            root[i][j] = jnp.sqrt(jnp.maximum(total, jnp.finfo(h.dtype).tiny)) if i == j else total / root[j][j]
    for j in range(n):
        inverse[j][j] = 1.0 / root[j][j]
        for i in range(j + 1, n):
            total = sum((root[i][k] * inverse[k][j] for k in range(j, i)), start=none)
            inverse[i][j] = -total / root[i][i]
    return jnp.stack([jnp.stack(row) for row in inverse])


def _times(a: Float[Array, "..."], b: Float[Array, "..."]) -> Float[Array, "..."]:
    """The product in full precision, which not every accelerator takes by itself."""
    return jnp.matmul(a, b, precision=jax.lax.Precision.HIGHEST)


def _longest(sides: _Sides, change: _Sides) -> Float[Array, ""]:
    """The step that reaches the boundary."""
    values, changes = jnp.stack(sides), jnp.stack(change)
    ratios = jnp.where(changes < 0, -values / jnp.where(changes < 0, changes, -1.0), jnp.inf)
    return ratios.min()
