"""The rows of `nmpc_kernels` once more, for one walker of many: the same programme in array operations under `vmap`.

Unknowns, scaling and equations are those of the kernels, of which each function here bears the name. Rows that a walker
doesn't need are zero, so that every walker's programme has one shape; a landing that comes too soon is held by removing
its directions from the rows (`held`).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from toddle.walk.pattern.interior_point import inverse_of_root
from toddle.walk.pattern.nmpc_kernels import (
    BODY_ROWS,
    FOOT_PATH,
    SLACK_BODY,
    SLACK_FEET,
    SLACK_ZMP,
    TRUST,
    Numbers,
    Tables,
)

NO = 1e30
_TINY = 1e-9


class Walker(NamedTuple):
    """What one programme is made of; positions relative to the foot that stands.

    Attributes:
        com: of x and y: position, velocity, acceleration [m, s].
        sign: 1 where the left foot stands, -1 where the right one does.
        swing: where the other foot stood [m].
        origin: where the ZMP was [m].
        phase: since the step began [s].
        remaining: until it ends [s].
        double_support: until the weight is over [s].
        halt: stands after so many landings.
        velocity: vx, vy [m/s], omega [rad/s].
        yaws: of the foot that stands and those to come [rad].
        drawn: displacements by the command [m].
        last: the last plan's feet.
        jerks: the last plan's.
        circles: around [m].
        around: which circles count.
        pinned: the next landing stays where it was.
        early: rounding errors of times are no greater [s].
    """

    com: Float[Array, "2 3"]
    sign: Float[Array, ""]
    swing: Float[Array, "2"]
    origin: Float[Array, "2"]
    phase: Float[Array, ""]
    remaining: Float[Array, ""]
    double_support: Float[Array, ""]
    halt: Int[Array, ""]
    velocity: Float[Array, "3"]
    yaws: Float[Array, " soles"]
    drawn: Float[Array, "steps 2"]
    last: Float[Array, "steps 3"]
    jerks: Float[Array, "2 samples"]
    circles: Float[Array, "circles 3"]
    around: Bool[Array, " circles"]
    pinned: Bool[Array, ""]
    early: float


class Rows(NamedTuple):
    """Of one kind: coefficients of the unknowns and bounds; ``used`` says which are there."""

    matrix: Float[Array, "rows unknowns"]
    low: Float[Array, " rows"]
    high: Float[Array, " rows"]
    used: Bool[Array, " rows"]
    slack: Float[Array, " rows"]


class Factor(NamedTuple):
    """The factor of one axis's Hessian, and what follows from it.

    Attributes:
        shares: of the ZMP's reference: origin, the foot that stands, the feet to come.
        lower: L_F.
        inverse: of C.
        y: L^-1 g of both axes.
        drift: the ZMP less its reference without any unknown [m].
        base: of the feet in the ZMP less its reference.
    """

    shares: Float[Array, "samples shares"]
    lower: Float[Array, "steps samples"]
    inverse: Float[Array, "steps steps"]
    y: Float[Array, "2 axis"]
    drift: Float[Array, "samples 2"]
    base: Float[Array, "samples steps"]


def product(a: Float[Any, "..."], b: Float[Any, "..."]) -> Float[Array, "..."]:
    """In full precision, which not every accelerator takes by itself."""
    return jnp.matmul(a, b, precision=jax.lax.Precision.HIGHEST)


def selection(
    count: int, feet: int, sample: float, walker: Walker, later: float, step_time: float
) -> Float[Array, "samples shares"]:
    """Shares of the ZMP's reference, one row each sample."""
    t = _times(count, sample, walker)
    first, halt = walker.double_support, walker.halt
    waits = jnp.maximum(first - later, 0.0)
    over = jnp.clip((walker.phase + t - waits) / jnp.maximum(first - waits, _TINY), 0.0, 1.0)
    over = jnp.where(halt == 0, 0.5 * over, over)
    columns = [1.0 - over]
    for k in range(1, feet + 1):
        share = jnp.clip((t - walker.remaining - (k - 1) * step_time) / jnp.maximum(later, _TINY), 0.0, 1.0)
        share = jnp.where((halt >= 0) & (halt < k), 0.0, jnp.where(halt == k, 0.5 * share, share))
        share = jnp.minimum(share, over)
        columns.append(over - share)
        over = share
    return jnp.stack([*columns, over], axis=1)


def factor(tables: Tables, numbers: Numbers, walker: Walker) -> Factor:
    """The kernels' corner and gradient, and the feet's part of the ZMP."""
    count, feet = tables.inverse.shape[0], walker.drawn.shape[0]
    shares = selection(count, feet, numbers.sample, walker, numbers.double_support, numbers.step_time)
    carried = shares[:, 2:]
    lower = -numbers.beta * product(carried.T, tables.w_zmp)
    weight = jnp.where(jnp.arange(1, feet + 1, dtype=jnp.int32) == walker.halt, numbers.still, numbers.delta).astype(
        shares.dtype
    )
    difference = jnp.eye(feet, dtype=shares.dtype) - jnp.eye(feet, k=-1, dtype=shares.dtype)
    h = numbers.beta * product(carried.T, carried) - product(lower, lower.T)
    h = h + product(difference.T, weight[:, None] * difference) + numbers.last * jnp.eye(feet, dtype=shares.dtype)
    inverse = inverse_of_root(h)
    drift = product(tables.zmp_state, walker.com.T) - shares[:, :1] * walker.origin[None]
    by_speed = numbers.alpha * (product(tables.velocity_state, walker.com.T) - _target(numbers, walker, count))
    upper = product(tables.w_velocity.T, by_speed) + numbers.beta * product(tables.w_zmp.T, drift)
    rest = -product(difference.T, weight[:, None] * walker.drawn) - numbers.last * walker.last[:, :2]
    rest = rest - numbers.beta * product(carried.T, drift) - product(lower, upper)
    y = jnp.concatenate([upper, product(inverse, rest)]).T
    base = product(-carried - product(tables.w_zmp, lower.T), inverse.T)
    return Factor(shares, lower, inverse, y, drift, base)


def _times(count: int, sample: float, walker: Walker) -> Float[Array, " samples"]:
    return jnp.arange(1, count + 1).astype(walker.phase.dtype) * sample


def _target(numbers: Numbers, walker: Walker, count: int) -> Float[Array, "samples 2"]:
    t = _times(count, numbers.sample, walker)
    psi = walker.yaws[0] + walker.velocity[2] * (walker.phase + t - numbers.step_time / 2)
    cos, sin = jnp.cos(psi), jnp.sin(psi)
    vx, vy = walker.velocity[0], walker.velocity[1]
    return jnp.stack([cos * vx - sin * vy, sin * vx + cos * vy], axis=1)


def _rows(
    jerks: Float[Any, "rows samples"],
    feet: Float[Array, "rows steps"],
    x: Float[Array, " rows"],
    y: Float[Array, " rows"],
    yaw: Float[Array, "rows steps"],
) -> Float[Array, "rows unknowns"]:
    """Rows that hold the same along both axes, times x and y; and what they hold of the yaws."""
    axis = jnp.concatenate([jerks, feet], axis=1)
    return jnp.concatenate([x[:, None] * axis, y[:, None] * axis, yaw], axis=1)


def _foot(numbers: Numbers, feet: int, k: int, slope: Float[Array, " rows"]) -> Float[Array, "rows steps"]:
    """Of a slope by foot k's yaw, which is the sum of the changes up to it."""
    upto = (jnp.arange(feet) <= k).astype(slope.dtype)
    return slope[:, None] * upto[None] / numbers.yaw


def foot_rows(tables: Tables, numbers: Numbers, walker: Walker, found: Factor) -> Rows:
    """Hull of each landing and the relative yaw."""
    feet, count = found.inverse.shape[0], tables.inverse.shape[0]
    edges = tables.hull.shape[0]
    none = jnp.zeros((edges, count), found.inverse.dtype)
    parts, highs, used = [], [], []
    for k in range(feet):
        side = -walker.sign if k % 2 == 0 else walker.sign
        cos, sin = jnp.cos(walker.yaws[k]), jnp.sin(walker.yaws[k])
        nx, ny = tables.hull[:, 0], tables.hull[:, 1] * side
        x, y = cos * nx - sin * ny, sin * nx + cos * ny
        moved = walker.last[k] - (walker.last[k - 1] if k > 0 else 0.0)
        column = found.inverse[:, k] - (found.inverse[:, k - 1] if k > 0 else 0.0)
        yaw = _foot(numbers, feet, k - 1, x * moved[1] - y * moved[0])
        parts.append(_rows(none, jnp.broadcast_to(column, (edges, feet)), x, y, yaw))
        highs.append(tables.hull[:, 2])
        used.append(jnp.full(edges, True) & ((k > 0) | ~walker.pinned))
    turn = jnp.diff(walker.yaws)
    low = jnp.minimum(jnp.maximum(-numbers.longest_turn - turn, -TRUST), 0.0)
    high = jnp.maximum(jnp.minimum(numbers.longest_turn - turn, TRUST), 0.0)
    yaws = jnp.eye(feet, 2 * (count + feet) + feet, 2 * (count + feet), dtype=low.dtype) / numbers.yaw
    matrix = jnp.concatenate([*parts, yaws])
    free = (jnp.arange(feet) > 0) | ~walker.pinned
    lows = jnp.concatenate([jnp.full(edges * feet, -NO, low.dtype), low])
    return Rows(matrix, lows, jnp.concatenate([*highs, high]), jnp.concatenate([*used, free]), jnp.zeros_like(lows))


def zmp_rows(tables: Tables, numbers: Numbers, walker: Walker, found: Factor) -> Rows:
    """The zero moment point stays in the shrunk sole around its reference."""
    count, shares = len(found.base), found.shares[:, 2:]
    error = found.drift - product(shares, walker.last[:, :2]) + product(tables.zmp_jerk, walker.jerks.T)
    yaw = (found.shares[:, 0] + found.shares[:, 1]) * walker.yaws[0] + product(shares, walker.yaws[1:])
    cos, sin = jnp.cos(yaw), jnp.sin(yaw)
    after = jnp.cumsum(shares[:, ::-1], axis=1)[:, ::-1]
    standing = walker.phase + _times(count, numbers.sample, walker)
    standing = standing < walker.double_support - numbers.double_support + walker.early
    parts, lows, highs = [], [], []
    for x, y, rear, front in ((cos, sin, numbers.rear, numbers.front), (-sin, cos, -numbers.side, numbers.side)):
        slope = x * error[:, 1] - y * error[:, 0]
        parts.append(_rows(tables.w_zmp, found.base, x, y, slope[:, None] * after / numbers.yaw))
        known = x * found.drift[:, 0] + y * found.drift[:, 1]
        wider = jnp.where(standing, 0.5 * jnp.abs(x * walker.swing[0] + y * walker.swing[1]), 0.0)
        lows.append(rear - known - wider)
        highs.append(front - known + wider)
    low = jnp.concatenate(lows)
    return Rows(
        jnp.concatenate(parts), low, jnp.concatenate(highs), jnp.full(2 * count, True), jnp.full_like(low, SLACK_ZMP)
    )


def capture_rows(tables: Tables, numbers: Numbers, walker: Walker, found: Factor) -> Rows:
    """Where the horizon ends, the DCM lies where further steps can catch it."""
    count, feet = found.base.shape
    dtype, end = found.base.dtype, count * numbers.sample
    jerks = tables.w_position[-1] + tables.w_velocity[-1] / numbers.omega
    own = -product(found.inverse, product(found.lower, jerks))
    known = product(walker.com, tables.position_state[-1] + tables.velocity_state[-1] / numbers.omega)
    after = walker.remaining + jnp.arange(feet).astype(dtype) * numbers.step_time
    gone = end > after - walker.early
    landed = jnp.cumprod(gone.astype(jnp.int32)).sum(dtype=jnp.int32)
    landed = jnp.where(walker.halt >= 0, jnp.minimum(landed, walker.halt), landed)
    stands = landed == walker.halt
    since = end - walker.remaining - (landed - 1).astype(dtype) * numbers.step_time
    over = jnp.where(landed > 0, since / jnp.maximum(numbers.double_support, _TINY), 1.0 - found.shares[-1, 0])
    rest = jnp.maximum(1.0 - over, 0.0)
    lag = numbers.omega * rest * numbers.double_support
    old = jnp.where(lag > _TINY, rest * (1.0 + jnp.expm1(-lag) / jnp.maximum(lag, _TINY)), 0.0)
    order = jnp.arange(1, feet + 1, dtype=jnp.int32)
    weights = jnp.where(order == landed, 1.0 - old, jnp.where(order == landed - 1, old, 0.0))
    weights = jnp.where(stands, found.shares[-1, 2:], weights)
    from_origin = jnp.where(stands, found.shares[-1, 0], jnp.where(landed > 0, 0.0, old))
    known = known - from_origin * walker.origin
    left = jnp.maximum(walker.remaining + landed.astype(dtype) * numbers.step_time - end, 0.0)
    fade = jnp.exp(-numbers.omega * left)
    side = jnp.where(landed % 2 == 0, -walker.sign, walker.sign)
    inner, outer = fade * side * numbers.end_inner, fade * side * numbers.end_outer
    front = jnp.where(stands, numbers.front, fade * numbers.end_ahead)
    rear = jnp.where(stands, numbers.rear, -fade * numbers.end_ahead)
    least = jnp.where(stands, -numbers.side, jnp.minimum(inner, outer))
    most = jnp.where(stands, numbers.side, jnp.maximum(inner, outer))
    cos, sin = jnp.cos(walker.yaws[landed]), jnp.sin(walker.yaws[landed])
    x, y = jnp.stack([cos, -sin]), jnp.stack([sin, cos])
    own = own - product(found.inverse, weights)
    matrix = _rows(
        jnp.stack([jerks, jerks]), jnp.stack([own, own]), x, y, jnp.zeros((2, feet), dtype)
    )  # the yaw's part is nearly constant: the kernels leave it out too
    value = x * known[0] + y * known[1]
    low, high = jnp.stack([rear, least]) - value, jnp.stack([front, most]) - value
    return Rows(matrix, low, high, jnp.full(2, True), jnp.full_like(low, SLACK_ZMP))


def foot_clearance(tables: Tables, numbers: Numbers, walker: Walker, found: Factor) -> Rows:
    """Each previewed foot keeps clear of each circle, where it lands and on its way."""
    count, feet = found.base.shape
    circles, none = walker.circles, jnp.zeros((walker.circles.shape[0], count), found.base.dtype)
    behind = _swing_share(walker)
    distance = jnp.hypot(circles[:, 0], circles[:, 1]) - circles[:, 2]
    starts = [walker.swing, jnp.zeros_like(walker.swing), *walker.last[:, :2]]
    parts, lows, used = [], [], []
    for k in range(feet):
        cos, sin = jnp.cos(walker.yaws[k + 1]), jnp.sin(walker.yaws[k + 1])
        reach = (k + 1) * numbers.reach + numbers.half_length + abs(numbers.ahead) + numbers.gap
        may = walker.around & (distance <= reach) & ((walker.halt < 0) | (walker.halt >= k + 1))
        for b in FOOT_PATH:
            seen = (1 - b) * starts[k] + b * walker.last[k, :2] + numbers.ahead * jnp.stack([cos, sin])
            x, y = seen[0] - circles[:, 0], seen[1] - circles[:, 1]
            length = jnp.hypot(x, y)
            nx = jnp.where(length > 1e-6, x / jnp.maximum(length, 1e-6), -sin)
            ny = jnp.where(length > 1e-6, y / jnp.maximum(length, 1e-6), cos)
            along, aside = nx * cos + ny * sin, ny * cos - nx * sin
            column = b * found.inverse[:, k] + ((1 - b) * found.inverse[:, k - 2] if k > 1 else 0.0)
            known = -nx * circles[:, 0] - ny * circles[:, 1] + along * numbers.ahead
            if k < 2:
                known = known + (1 - b) * (nx * starts[k][0] + ny * starts[k][1])
            turn = jnp.where(along * aside < 0, -1.0, 1.0)
            slope = numbers.ahead * aside - numbers.half_length * jnp.abs(aside) * turn
            slope = slope + numbers.half_width * jnp.abs(along) * turn
            yaw = _foot(numbers, feet, k, slope)
            parts.append(_rows(none, jnp.broadcast_to(column, (len(circles), feet)), nx, ny, yaw))
            half = numbers.half_length * jnp.abs(along) + numbers.half_width * jnp.abs(aside)
            lows.append(circles[:, 2] + numbers.gap + half - known)
            used.append(may & (b > behind) if k == 0 and b < 1.0 else may)
    low = jnp.concatenate(lows)
    return Rows(
        jnp.concatenate(parts), low, jnp.full_like(low, NO), jnp.concatenate(used), jnp.full_like(low, SLACK_FEET)
    )


def body_clearance(tables: Tables, numbers: Numbers, walker: Walker, found: Factor) -> Rows:
    """The centre of mass keeps the body's radius from each circle, at a few instants."""
    count, feet = found.base.shape
    circles, wide = walker.circles, walker.circles.shape[0]
    parts, lows, used = [], [], []
    for b in range(1, BODY_ROWS + 1):
        i = max(b * count // BODY_ROWS, 1) - 1
        free = product(walker.com, tables.position_state[i])
        seen = free + product(walker.jerks, tables.position_jerk[i])
        own = -product(found.inverse, product(found.lower, tables.w_position[i]))
        x, y = seen[0] - circles[:, 0], seen[1] - circles[:, 1]
        away = jnp.hypot(x, y)
        nx, ny = x / jnp.maximum(away, 1e-6), y / jnp.maximum(away, 1e-6)
        jerks = jnp.broadcast_to(tables.w_position[i], (wide, count))
        none = jnp.zeros((wide, feet), own.dtype)
        parts.append(_rows(jerks, jnp.broadcast_to(own, (wide, feet)), nx, ny, none))
        lows.append(circles[:, 2] + numbers.body - nx * (free[0] - circles[:, 0]) - ny * (free[1] - circles[:, 1]))
        used.append(walker.around & (away >= 1e-6) & (away - circles[:, 2] <= numbers.body + 2.0 * numbers.reach))
    low = jnp.concatenate(lows)
    return Rows(
        jnp.concatenate(parts), low, jnp.full_like(low, NO), jnp.concatenate(used), jnp.full_like(low, SLACK_BODY)
    )


def held(numbers: Numbers, walker: Walker, found: Factor) -> tuple[Float[Array, "3 unknowns"], Float[Array, "3"]]:
    """Directions of the unknowns that move the next landing, of length 1, and where along them it stays."""
    count, feet = found.base.shape
    column = found.inverse[:, 0]
    length = jnp.sqrt((column * column).sum())
    none = jnp.zeros((2, count), column.dtype)
    rows = _rows(
        none, jnp.stack([column, column]) / length, jnp.array([1.0, 0.0], column.dtype),
        jnp.array([0.0, 1.0], column.dtype), jnp.zeros((2, feet), column.dtype),
    )  # fmt: skip
    turn = jnp.zeros((1, rows.shape[1]), column.dtype).at[0, 2 * (count + feet)].set(1.0)
    axes = jnp.concatenate([rows, turn])
    y = jnp.concatenate([found.y.reshape(-1), jnp.zeros(feet, column.dtype)])
    places = jnp.concatenate([walker.last[0, :2] / length, (walker.last[0, 2:] - walker.yaws[1]) * numbers.yaw])
    return axes, places + product(axes, y)


def _swing_share(walker: Walker) -> Float[Array, ""]:
    first = walker.double_support
    s = (walker.phase - first) / jnp.maximum(walker.phase + walker.remaining - first, _TINY)
    s = jnp.clip(s, 0.0, 1.0)
    return s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
