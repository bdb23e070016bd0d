"""Thousands of walkers at once: `nmpc.plan` for a batch, assembly and solver in one call, on any device that JAX knows.

The same programme as for a single walker (`batch_rows`), solved by an interior point with a fixed number of iterations
(`interior_point`); every walker costs the same, so that nothing waits for the slowest. Arrays decide about the
precision: float32 by default, as accelerators like it. All functions can be jitted, mapped, scanned and sharded along
the leading axis.

`step_batch` closes the pattern over itself as `reduced` does: point walkers that go where their first jerk leads.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT
from toddle.walk.pattern import batch_rows as rows
from toddle.walk.pattern.batch_command import cap, drawn_to, nominal, rounding, shifted, sign_of, turned
from toddle.walk.pattern.batch_state import STATUSES, BatchPlan, BatchState, stacked
from toddle.walk.pattern.interior_point import ITERATIONS, interior_point
from toddle.walk.pattern.nmpc_problem import NEVER, Nmpc
from toddle.walk.pattern.obstacles import MOST
from toddle.walk.pattern.plan import Status
from toddle.walk.pattern.reduced import Reduced

_BROKEN = 1e-3  # a hard row may be exceeded by so much [m], [rad]: the iterations end before the last digit
_SOLVED, _INFEASIBLE, _NOT_FINITE = (
    STATUSES.index(status) for status in (Status.SOLVED, Status.INFEASIBLE, Status.NOT_FINITE)
)
_ACTIVE = 1e-4  # a clearance row nearer to its bound decides the plan [m]
_LEFT = 1e-8  # a row of which less than this is left (squared) spoke of the held landing alone
_MOVING = 1e-6


def plan_batch(
    problem: Nmpc,
    states: BatchState,
    velocities: Float[Any, "walkers 3"],
    circles: Float[Any, "walkers circles 3"] | None = None,
    last: BatchPlan | None = None,
    iterations: int = ITERATIONS,
) -> BatchPlan:
    """One iteration of each walker; no answer has a number that isn't finite.

    Args:
        problem: of the gait, the same for all.
        states: where the walkers are; their precision is that of the answer.
        velocities: commanded: vx, vy [m/s], omega [rad/s]. A walker that is to halt takes none.
        circles: obstacles: x, y, radius [m]; a negative radius for none.
        last: the last plans; where ``known`` is false there is none.
        iterations: of the interior point.
    """
    dtype = jnp.asarray(states.com).dtype
    states, last = jax.tree.map(jnp.asarray, (states, last))
    velocities = jnp.asarray(velocities, dtype)
    around = jnp.zeros((len(velocities), 0, 3), dtype) if circles is None else jnp.asarray(circles, dtype)
    if last is None:
        last = jax.vmap(partial(nominal, problem.gait))(states, velocities)
    fixed = _Fixed(problem.gait, rows.Numbers(*map(float, problem.numbers)), problem.freeze, iterations)
    tables = jax.tree.map(lambda part: jnp.asarray(part, dtype), problem.tables)
    return _plan(fixed, tables, states, velocities, around, last)


class _Fixed(NamedTuple):
    """What all walkers have in common; hashable, so that it is compiled in."""

    gait: Gait
    numbers: rows.Numbers
    freeze: float
    iterations: int


@partial(jax.jit, static_argnums=0)
def _plan(
    fixed: _Fixed,
    tables: rows.Tables,
    states: BatchState,
    velocities: Float[Array, "walkers 3"],
    circles: Float[Array, "walkers circles 3"],
    last: BatchPlan,
) -> BatchPlan:
    return jax.vmap(partial(_one, fixed, tables))(states, velocities, circles, last)


def _one(
    fixed: _Fixed,
    tables: rows.Tables,
    state: BatchState,
    velocity: Float[Array, "3"],
    circles: Float[Array, "circles 3"],
    last: BatchPlan,
) -> BatchPlan:
    """One walker's iteration."""
    velocity = jnp.where(state.halt == NEVER, velocity, 0.0)
    there = ~(circles[:, 2] < 0)
    finite = _finite(state, velocity) & jnp.isfinite(jnp.where(there[:, None], circles, 0.0)).all()
    state = jax.tree.map(lambda part: jnp.where(jnp.isfinite(part), part, 0), state)
    velocity = jnp.where(jnp.isfinite(velocity).all(), velocity, 0.0)
    guess = _either(last.known, shifted(fixed.gait, last, state, velocity), nominal(fixed.gait, state, velocity))
    walker = _walker(fixed, state, velocity, circles, there & finite, guess, last.known)
    found = _solved(fixed, tables, state, walker, guess)
    found = found._replace(status=jnp.where(finite, found.status, _NOT_FINITE))
    return _either(found.status == _SOLVED, found, guess._replace(status=found.status))._replace(
        known=jnp.ones_like(last.known), state=state
    )


def _walker(
    fixed: _Fixed,
    state: BatchState,
    velocity: Float[Array, "3"],
    circles: Float[Array, "circles 3"],
    there: Bool[Array, " circles"],
    guess: BatchPlan,
    known: Bool[Array, ""],
) -> rows.Walker:
    """What the programme is made of, relative to the foot that stands."""
    gait, numbers = fixed.gait, fixed.numbers
    dtype, place = state.com.dtype, state.support[:2]
    sign, zero = sign_of(state.side, dtype), jnp.zeros((1,), dtype)
    yaws, drawn = turned(gait, state.support[2], velocity), drawn_to(gait, sign, state.support[2], velocity)
    pinned = known & (state.remaining > 0) & (state.remaining <= fixed.freeze) & (state.halt != 0)
    landing = guess.feet[0, 2]
    yaws = jnp.where(pinned, jnp.concatenate([yaws[:1], turned(gait, landing, velocity)[:-1]]), yaws)
    following = jnp.concatenate([drawn[:1], drawn_to(gait, -sign, landing, velocity)[:-1]])
    seen, around = _near(circles, there, place, gait.steps * numbers.reach + numbers.body + 0.5)
    return rows.Walker(
        com=state.com - jnp.stack([place, jnp.zeros_like(place), jnp.zeros_like(place)], axis=1),
        sign=sign,
        swing=state.lifted[:2] - place,
        origin=state.origin - place,
        phase=state.phase,
        remaining=state.remaining,
        double_support=state.double_support,
        halt=state.halt,
        velocity=velocity,
        yaws=yaws,
        drawn=jnp.where(pinned, following, drawn),
        last=guess.feet - jnp.concatenate([place, zero])[None],
        jerks=guess.jerks,
        circles=seen,
        around=around,
        pinned=pinned,
        early=rounding(dtype),
    )


def _near(
    circles: Float[Array, "circles 3"], there: Bool[Array, " circles"], place: Float[Array, "2"], reach: float
) -> tuple[Float[Array, "some 3"], Bool[Array, " some"]]:
    """The nearest `MOST` circles relative to a place, and which of them are within reach."""
    moved = jnp.where(there[:, None], circles, 0.0) - jnp.concatenate([place, jnp.zeros_like(place[:1])])[None]
    away = jnp.where(there, jnp.hypot(moved[:, 0], moved[:, 1]) - moved[:, 2], jnp.inf)
    if len(circles) > MOST:
        order = jnp.argsort(away)[:MOST]
        moved, away = moved[order], away[order]
    return moved, away <= reach


def _solved(
    fixed: _Fixed,
    tables: rows.Tables,
    state: BatchState,
    walker: rows.Walker,
    guess: BatchPlan,
) -> BatchPlan:
    """The programme's answer; the status says whether it may be used."""
    numbers = fixed.numbers
    found = rows.factor(tables, numbers, walker)
    hard = rows.foot_rows(tables, numbers, walker, found)
    balance = [part(tables, numbers, walker, found) for part in (rows.zmp_rows, rows.capture_rows)]
    clear = []
    if len(walker.circles):
        clear = [part(tables, numbers, walker, found) for part in (rows.foot_clearance, rows.body_clearance)]
    parts = [hard, *balance, *clear]
    matrix, low, high, used, slack = (jnp.concatenate(column) for column in zip(*parts, strict=True))
    y = jnp.concatenate([found.y.reshape(-1), jnp.zeros_like(walker.drawn[:, 0])])
    moved = rows.product(matrix, y)
    low, high = jnp.where(used, low + moved, -rows.NO), jnp.where(used & (high < rows.NO), high + moved, rows.NO)
    axes, kept = rows.held(numbers, walker, found)
    axes, kept = jnp.where(walker.pinned, axes, 0.0), jnp.where(walker.pinned, kept, 0.0)
    start = rows.product(kept, axes)
    off = rows.product(matrix, start)
    free = matrix - rows.product(rows.product(matrix, axes.T), axes)
    says = (free * free).sum(axis=1) > _LEFT * (matrix * matrix).sum(axis=1)
    free = jnp.where(says[:, None], free, 0.0)
    u = start + interior_point(free, low - off, high - off, slack, fixed.iterations).u
    value = rows.product(matrix, u)
    beyond = jnp.where(used, jnp.maximum(jnp.maximum(low - value, value - high), 0.0), 0.0)
    first, second = len(hard.low), len(hard.low) + sum(len(part.low) for part in balance)
    jerks, feet, moved, zmp = _unfolded(tables, numbers, walker, found, u - y)
    place = state.support[:2]
    feet = jnp.concatenate(
        [feet + place[None], (walker.yaws[1:] + _turns(numbers, fixed.gait.steps, u))[:, None]], axis=1
    )
    broken = beyond[:first].max()
    finite = jnp.isfinite(jerks).all() & jnp.isfinite(feet).all()
    status = jnp.where(finite, jnp.where(broken <= _BROKEN, _SOLVED, _INFEASIBLE), _NOT_FINITE)
    status = status.astype(jnp.int32)
    active = (used & (value - low < _ACTIVE))[second:].any()
    violation, overlap = beyond[first:second].max(), beyond[second:].max(initial=0.0)
    return BatchPlan(
        feet, moved, jerks, zmp + place[None], status, active, violation, overlap, guess.known, state
    )  # fmt: skip


def _turns(numbers: rows.Numbers, feet: int, u: Float[Array, " unknowns"]) -> Float[Array, " steps"]:
    return jnp.cumsum(u[-feet:]) / numbers.yaw


def _unfolded(
    tables: rows.Tables, numbers: rows.Numbers, walker: rows.Walker, found: rows.Factor, w: Float[Array, " unknowns"]
) -> tuple[Array, Array, Array, Array]:
    """Jerks, feet, displacements and the ZMP's reference that a point stands for, relative to the foot that stands."""
    count, feet = found.base.shape
    axes = w[: 2 * (count + feet)].reshape(2, count + feet)
    steps = rows.product(axes[:, count:], found.inverse)
    jerks = rows.product(axes[:, :count] - rows.product(steps, found.lower), tables.inverse)
    moved = jnp.diff(steps, axis=1, prepend=jnp.zeros_like(steps[:, :1]))
    zmp = found.shares[:, :1] * walker.origin[None] + rows.product(found.shares[:, 2:], steps.T)
    return jerks, steps.T, moved.T, zmp


def _finite(state: BatchState, velocity: Float[Array, "3"]) -> Bool[Array, ""]:
    parts = [*jax.tree.leaves(state), velocity]
    return jnp.stack([jnp.isfinite(part).all() for part in parts]).all()


def _either(which: Bool[Array, ""], one: BatchPlan, other: BatchPlan) -> BatchPlan:
    return jax.tree.map(lambda a, b: jnp.where(which, a, b), one, other)


class BatchWalk(NamedTuple):
    """Walkers between two iterations; see `reduced.ReducedState`.

    Attributes:
        at: where they are.
        plan: the last one.
        shift: part of this step's double support that brings the weight over out of standing [s].
    """

    at: BatchState
    plan: BatchPlan
    shift: Float[Any, "*walkers"]


def start_batch(problem: Nmpc, walkers: int, dtype: type[np.floating] = np.float32) -> BatchWalk:
    """Walkers that stand."""
    one = Reduced(problem.gait, problem.weights).start().at
    at = jax.tree.map(lambda part: jnp.asarray(np.repeat(part, walkers, axis=0)), stacked([one], dtype))
    plan = jax.vmap(partial(nominal, problem.gait))(at, jnp.zeros((walkers, 3), dtype))
    return BatchWalk(at, plan, jnp.zeros(walkers, dtype))


def step_batch(
    problem: Nmpc,
    walk: BatchWalk,
    velocities: Float[Any, "walkers 3"],
    circles: Float[Any, "walkers circles 3"] | None = None,
    iterations: int = ITERATIONS,
) -> BatchWalk:
    """One iteration of each; it lasts a sample, or what is left of the step. Commands are capped to what fits.

    As `reduced.Reduced.step`; the plan in the answer is the one that was followed. A landing has to be held for
    longer than a sample: make the problem with ``freeze`` of one and a half, as `reduced.Reduced` does.
    """
    dtype = walk.at.com.dtype
    velocities = jax.vmap(partial(cap, problem.gait))(jnp.asarray(velocities, dtype))
    at, shift = jax.vmap(partial(_commanded, problem.gait))(walk, velocities)
    found = plan_batch(problem, at, velocities, circles, walk.plan, iterations)
    return jax.vmap(partial(_advanced, problem.gait))(at, found, shift)


def _commanded(gait: Gait, walk: BatchWalk, velocity: Float[Array, "3"]) -> tuple[BatchState, Array]:
    """The state with what the command makes of it: begin, go on, or halt; and the weight shift's time."""
    at = walk.at
    moving, stands = jnp.abs(velocity).max() > _MOVING, at.halt == 0
    halting = jnp.where(at.halt == NEVER, jnp.where(at.phase < walk.shift, 1, 2), at.halt)
    going = at._replace(halt=jnp.where(stands, 0, jnp.where(moving, NEVER, halting)))
    long = max(round(gait.step_time / 2 / gait.sample), 1) * gait.sample
    begun = _begun(gait, walk, velocity, long)
    begin = stands & moving
    state = jax.tree.map(lambda a, b: jnp.where(begin, a, b), begun, going)
    return state, jnp.where(begin, long, jnp.where(stands, 0.0, walk.shift))


def _begun(gait: Gait, walk: BatchWalk, velocity: Float[Array, "3"], long: float) -> BatchState:
    """Out of standing: the sole that the centre of mass is over carries, else the one the command leads away from."""
    at = walk.at
    is_left = at.side == LEFT
    left, right = jnp.where(is_left, at.support, at.lifted), jnp.where(is_left, at.lifted, at.support)
    to_left, to_right = (jnp.hypot(*(at.com[:, 0] - foot[:2])) for foot in (left, right))
    led = velocity[1] + 0.1 * velocity[2] <= 0
    carries_left = jnp.where(jnp.abs(to_left - to_right) > gait.foot_distance / 2, to_left < to_right, led)
    pressed = jnp.where(walk.plan.known, walk.plan.zmp[0], at.com[:, 0])
    return at._replace(
        side=jnp.where(carries_left, 0, 1).astype(at.side.dtype),
        support=jnp.where(carries_left, left, right),
        lifted=jnp.where(carries_left, right, left),
        origin=pressed,
        phase=jnp.zeros_like(at.phase),
        remaining=jnp.full_like(at.phase, long + gait.step_time),
        double_support=jnp.full_like(at.phase, long + gait.double_support),
        halt=jnp.full_like(at.halt, NEVER),
    )


def _advanced(gait: Gait, at: BatchState, plan: BatchPlan, shift: Float[Array, ""]) -> BatchWalk:
    """Where the first jerk leads (2.29), and who carries then."""
    stands = at.halt == 0
    last = at.remaining < gait.sample + rounding(at.phase.dtype) * 1e3
    t = jnp.where(stands | ~last, gait.sample, at.remaining)
    p, v, a = at.com.T
    jerk = plan.jerks[:, 0]
    com = jnp.stack([p + t * v + t**2 / 2 * a + t**3 / 6 * jerk, v + t * a + t**2 / 2 * jerk, a + t * jerk], axis=1)
    along = at._replace(com=com, phase=at.phase + t, remaining=jnp.where(stands, at.remaining, at.remaining - t))
    landed = BatchState(
        com,
        1 - at.side,
        plan.feet[0],
        at.support,
        at.support[:2],
        jnp.zeros_like(t),
        jnp.full_like(t, gait.step_time),
        jnp.full_like(t, gait.double_support),
        jnp.where(at.halt > 0, at.halt - 1, NEVER),
    )
    ends = last & ~stands
    state = jax.tree.map(lambda a, b: jnp.where(ends, a, b), landed, along)
    return BatchWalk(state, plan, jnp.where(ends | stands, 0.0, shift))
