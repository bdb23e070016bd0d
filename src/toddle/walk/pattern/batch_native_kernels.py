"""Walkers closed over themselves, compiled: what `reduced.Reduced.step` and `nmpc.plan` do, for many.

Functions bear the names of those that do the same for a single walker; commands are `command_kernels`', the programme
`nmpc_kernels`', the solver `active_set_kernels`'. Arrays of `BatchState` and `BatchPlan` are changed in place. Nothing
here holds Python's lock.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from toddle.walk.pattern.active_set_kernels import SOLVED, nearest
from toddle.walk.pattern.command_kernels import cap, displacement, drawn_to, gate, turn_of, widening
from toddle.walk.pattern.nmpc_kernels import Moment, assemble, shift, unfold

NEVER, MOVING = -1, 1e-6
INFEASIBLE, NOT_FINITE = 1, 3  # places in `batch_state.STATUSES`
BROKEN = 1e-5  # a hard row may be exceeded by so much [m], [rad]
MOST = 8  # circles


@njit(cache=True)
def near(circles, x, y, reach):
    """`obstacles.near`; whether a circle isn't finite comes with it. A negative radius is none."""
    away, found = np.empty(MOST), np.empty((MOST, 3))
    count, finite = 0, True
    for c in range(circles.shape[0]):
        radius = circles[c, 2]
        if radius < 0:
            continue
        dx, dy = circles[c, 0] - x, circles[c, 1] - y
        far = math.hypot(dx, dy) - radius
        finite = finite and math.isfinite(circles[c, 0] + circles[c, 1] + radius)
        if not far <= reach or (count == MOST and far >= away[MOST - 1]):
            continue
        count = min(count + 1, MOST)
        place = count - 1
        while place > 0 and away[place - 1] > far:
            away[place] = away[place - 1]
            found[place] = found[place - 1]
            place -= 1
        away[place] = far
        found[place, 0], found[place, 1], found[place, 2] = dx, dy, radius
    return found[:count], finite


@njit(cache=True)
def finite_state(at, w):
    """Whether all numbers of a walker's state are finite."""
    total = at.com[w].sum() + at.support[w].sum() + at.lifted[w].sum() + at.origin[w].sum()
    return math.isfinite(total + at.phase[w] + at.remaining[w] + at.double_support[w])


@njit(cache=True)
def commanded(tables, numbers, stride, at, plan, late, w, velocity):
    """`reduced.Reduced._commanded`: begin, go on, or halt. ``late`` is the weight shift's time."""
    moving = max(abs(velocity[0]), abs(velocity[1]), abs(velocity[2])) > MOVING
    if at.halt[w] != 0:
        if moving:
            at.halt[w] = NEVER
        elif at.halt[w] == NEVER:
            at.halt[w] = 1 if at.phase[w] < late[w] else 2
        return
    late[w] = 0.0
    if not moving:
        return
    left, right = (at.support[w], at.lifted[w]) if at.side[w] == 0 else (at.lifted[w], at.support[w])
    to_left = math.hypot(at.com[w, 0, 0] - left[0], at.com[w, 1, 0] - left[1])
    to_right = math.hypot(at.com[w, 0, 0] - right[0], at.com[w, 1, 0] - right[1])
    carries_left = velocity[1] + 0.1 * velocity[2] <= 0
    if abs(to_left - to_right) > stride.foot_distance / 2:
        carries_left = to_left < to_right
    if carries_left != (at.side[w] == 0):
        for j in range(3):
            at.support[w, j], at.lifted[w, j] = at.lifted[w, j], at.support[w, j]
        at.side[w] = 1 - at.side[w]
    for j in range(2):
        at.origin[w, j] = plan.zmp[w, 0, j] if plan.known[w] else at.com[w, j, 0]
    at.phase[w] = 0.0
    at.remaining[w] = stride.shift + numbers.step_time
    at.double_support[w] = stride.shift + numbers.double_support
    at.halt[w] = NEVER
    late[w] = stride.shift


@njit(cache=True)
def nominal(numbers, at, plan, w, drawn, velocity):
    """`nmpc.nominal`, written to the plan."""
    turn = turn_of(numbers, velocity)
    x, y, yaw = at.support[w, 0], at.support[w, 1], at.support[w, 2]
    plan.zmp[w, :, 0] = x
    plan.zmp[w, :, 1] = y
    plan.jerks[w] = 0.0
    for k in range(drawn.shape[0]):
        x += drawn[k, 0]
        y += drawn[k, 1]
        plan.feet[w, k, 0], plan.feet[w, k, 1], plan.feet[w, k, 2] = x, y, yaw + (k + 1) * turn
    plan.displacement[w] = drawn
    plan.obstacle[w] = False
    plan.violation[w] = plan.overlap[w] = 0.0


@njit(cache=True)
def shifted(numbers, apart, at, plan, w, velocity):
    """`nmpc.shifted`, written to the plan."""
    before = plan.state
    switched = at.side[w] != before.side[w]
    elapsed = before.remaining[w] + at.phase[w] if switched else at.phase[w] - before.phase[w]
    if not math.isfinite(elapsed):
        return
    count, feet = plan.jerks.shape[2], plan.feet.shape[1]
    late = int(min(max(np.rint(elapsed / numbers.sample), 0.0), float(count)))
    step, turn = np.zeros(2), 0.0
    if switched:
        side, yaw = (before.side[w] + feet) % 2, plan.feet[w, feet - 1, 2]
        step[0], step[1] = displacement(apart, numbers.step_time, velocity, 1.0 - 2.0 * side, yaw)
        turn = yaw + turn_of(numbers, velocity)
    jerks, zmp, steps, moved = shift(
        plan.jerks[w], plan.zmp[w], plan.feet[w], plan.displacement[w], late, switched, step, turn
    )
    plan.jerks[w], plan.zmp[w], plan.feet[w], plan.displacement[w] = jerks, zmp, steps, moved


@njit(cache=True, inline="always")
def planned(tables, numbers, stride, at, plan, w, velocity, circles):
    """`nmpc.plan`: the last plan of walker w becomes the next one; ``velocity`` is 0 for one that halts."""
    feet = plan.feet.shape[1]
    sign = 1.0 - 2.0 * at.side[w]
    apart = stride.foot_distance + max(widening(tables.hull, numbers, stride, velocity), 0.0)
    drawn = np.empty((feet, 2))
    drawn_to(numbers, apart, velocity, sign, at.support[w, 2], drawn)
    known = plan.known[w]
    finite = finite_state(at, w)
    if known:
        shifted(numbers, apart, at, plan, w, velocity)
    elif finite:
        nominal(numbers, at, plan, w, drawn, velocity)
    place = np.array([at.support[w, 0], at.support[w, 1], 0.0])
    around, sound = near(circles, place[0], place[1], feet * numbers.reach + numbers.body + 0.5)
    remember(at, plan, w, finite)
    if not (finite and sound):
        plan.status[w] = NOT_FINITE
        return
    yaws = at.support[w, 2] + turn_of(numbers, velocity) * np.arange(feet + 1)
    pinned = known and 0 < at.remaining[w] <= stride.freeze and at.halt[w] != 0
    if pinned:
        landing = plan.feet[w, 0, 2]
        yaws[1:] = landing + turn_of(numbers, velocity) * np.arange(feet)
        drawn_to(numbers, apart, velocity, -sign, landing, drawn[1:])
    plan.status[w] = solved(tables, numbers, at, plan, w, velocity, sign, place, drawn, yaws, around, pinned)


@njit(cache=True)
def remember(at, plan, w, finite):
    """The state that the plan is made at."""
    then = plan.state
    if finite:
        then.com[w], then.support[w], then.lifted[w], then.origin[w] = (
            at.com[w],
            at.support[w],
            at.lifted[w],
            at.origin[w],
        )
        then.phase[w], then.remaining[w], then.double_support[w] = at.phase[w], at.remaining[w], at.double_support[w]
        then.side[w], then.halt[w] = at.side[w], at.halt[w]
        plan.known[w] = True


@njit(cache=True, inline="always")
def solved(tables, numbers, at, plan, w, velocity, sign, place, drawn, yaws, around, pinned):
    """Linearised at the plan, which stays as it is where there is no better one; the status."""
    com = at.com[w].copy()
    com[0, 0] -= place[0]
    com[1, 0] -= place[1]
    moment = Moment(
        at.support[w, 2],
        sign,
        at.lifted[w, 0] - place[0],
        at.lifted[w, 1] - place[1],
        at.origin[w, 0] - place[0],
        at.origin[w, 1] - place[1],
        at.phase[w],
        at.remaining[w],
        at.double_support[w],
        float(at.halt[w]),
        velocity[0],
        velocity[1],
        velocity[2],
    )
    matrix, low, high, marks, slack, y, lower, inverse, shares, hard, zmp = assemble(
        tables, numbers, moment, com, drawn, yaws, plan.feet[w] - place, plan.jerks[w], around, pinned
    )
    u = np.empty(matrix.shape[1])
    if nearest(matrix, low, high, marks, slack, u) != SOLVED:
        return INFEASIBLE
    jerks, steps, moved, reference, figures = unfold(
        u, tables, numbers, moment, matrix, low, high, y, lower, inverse, shares, yaws, hard, zmp, place
    )
    if not figures[0] <= BROKEN:
        return INFEASIBLE if math.isfinite(figures[0]) else NOT_FINITE
    plan.jerks[w], plan.feet[w], plan.displacement[w], plan.zmp[w] = jerks, steps, moved, reference
    plan.violation[w], plan.overlap[w], plan.obstacle[w] = figures[1], figures[2], figures[3] > 0
    return 0


@njit(cache=True)
def advance(numbers, at, plan, late, w):
    """Where the first jerk leads (2.29), and who carries then."""
    stands = at.halt[w] == 0
    ends = not stands and at.remaining[w] < numbers.sample + 1e-6
    t = at.remaining[w] if ends else numbers.sample
    for axis in range(2):
        p, v, a = at.com[w, axis, 0], at.com[w, axis, 1], at.com[w, axis, 2]
        jerk = plan.jerks[w, axis, 0]
        at.com[w, axis, 0] = p + t * v + t * t / 2 * a + t * t * t / 6 * jerk
        at.com[w, axis, 1] = v + t * a + t * t / 2 * jerk
        at.com[w, axis, 2] = a + t * jerk
    at.phase[w] += t
    if not stands:
        at.remaining[w] -= t
    if ends:
        at.lifted[w] = at.support[w]
        at.origin[w] = at.support[w, :2]
        at.support[w] = plan.feet[w, 0]
        at.side[w] = 1 - at.side[w]
        at.phase[w] = 0.0
        at.remaining[w] = numbers.step_time
        at.double_support[w] = numbers.double_support
        at.halt[w] = at.halt[w] - 1 if at.halt[w] > 0 else NEVER
        late[w] = 0.0


@njit(cache=True, nogil=True)
def walk_on(tables, numbers, stride, at, plan, late, allowed, asked, circles, gated, hold, first, last):
    """``hold`` iterations of walkers ``first`` to, without, ``last``."""
    still = np.zeros(3)
    for w in range(first, last):
        for _ in range(hold):
            if gated:
                gate(stride, allowed[w], asked[w], numbers.sample)
            else:
                allowed[w] = asked[w]
            velocity = cap(tables.hull, numbers, stride, allowed[w])
            commanded(tables, numbers, stride, at, plan, late, w, velocity)
            moves = at.halt[w] == NEVER
            planned(tables, numbers, stride, at, plan, w, velocity if moves else still, circles[w])
            advance(numbers, at, plan, late, w)
