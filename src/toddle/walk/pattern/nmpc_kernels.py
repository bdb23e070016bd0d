"""The compiled part of the reduced walking controller: its quadratic programme as a least-distance problem, and back.

Huber 2019, 2.43 to 2.86, with future foot yaws instead of yaw jerks, and footsteps drawn to displacements (delta).
Unknowns: for x and for y N jerks and F feet, then F changes of the feet's yaws. With the Hessian of an axis

    H = [[J, -beta U'V], [., beta V'V + delta ...]] = L L',   L = [[R, 0], [L_F, C]],   u = L' x + L^-1 g

the programme is min |u|^2 / 2 with rows M = A L'^-1. R is constant, so only the F x F corner is factored at run time,
and the dense part of M consists of rows computed once (`Tables`). R is upper triangular: as the time-stepping is lower
triangular, so are those rows. Everything is relative to the foot that stands.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

SOFT = 8  # DAQP's mark of a row that may be violated
SLACK_ZMP, SLACK_FEET, SLACK_BODY = 1e-8, 1e-6, 1e-5  # violation e costs e^2 / (2 slack): balance before clearance
TRUST = 0.001  # a turn differs by no more from the commanded one, so that rows linearised there still hold [rad]
FOOT_PATH = (1.0, 0.7, 0.35)  # where a swing foot is kept clear: shares of its way, landing first
BODY_ROWS = 4  # how often the body is kept clear over the horizon


class Tables(NamedTuple):
    """What doesn't change between iterations; ``w_`` are rows of the time-stepping times the inverse of R'."""

    position_state: np.ndarray
    velocity_state: np.ndarray
    zmp_state: np.ndarray
    zmp_jerk: np.ndarray
    position_jerk: np.ndarray
    w_position: np.ndarray
    w_velocity: np.ndarray
    w_zmp: np.ndarray
    inverse: np.ndarray
    hull: np.ndarray


class Numbers(NamedTuple):
    """Weights and lengths, see `nmpc.Nmpc`."""

    alpha: float
    beta: float
    delta: float
    still: float
    last: float
    yaw: float
    step_time: float
    double_support: float
    sample: float
    longest_turn: float
    rear: float
    front: float
    side: float
    half_length: float
    half_width: float
    ahead: float
    gap: float
    body: float
    reach: float
    omega: float
    end_ahead: float
    end_inner: float
    end_outer: float


class Moment(NamedTuple):
    """What changes: floats that tell the state of the step, positions relative to the foot that stands."""

    yaw: float
    sign: float
    swing_x: float
    swing_y: float
    origin_x: float
    origin_y: float
    phase: float
    remaining: float
    double_support: float
    halt: float
    vx: float
    vy: float
    omega: float


@njit(cache=True)
def selection(count, feet, sample, phase, remaining, first, later, step_time, halt):
    """Shares of the ZMP's reference: origin, the foot that stands, the feet to come; one row each sample.

    l_k rises from 0 to 1 over the double support that begins when foot k lands (k = 0: began with this step; only the
    last part of a longer one counts). After the landing ``halt`` (negative: never) the weight stays half-way.
    """
    shares = np.zeros((count, feet + 2))
    waits = max(first - later, 0.0)
    for i in range(count):
        t = (i + 1) * sample
        over = min(max((phase + t - waits) / max(first - waits, 1e-9), 0.0), 1.0)
        if halt == 0:
            over *= 0.5
        shares[i, 0] = 1.0 - over
        for k in range(1, feet + 1):
            share = min(max((t - remaining - (k - 1) * step_time) / max(later, 1e-9), 0.0), 1.0)
            if 0 <= halt < k:
                share = 0.0
            elif halt == k:
                share *= 0.5
            share = min(share, over)
            shares[i, k] = over - share
            over = share
        shares[i, feet + 1] = over
    return shares


@njit(cache=True)
def inverse_root(h):
    """The inverse of the lower Cholesky factor of a small matrix, of which the lower triangle is given."""
    n = h.shape[0]
    c, inverse = np.zeros((n, n)), np.zeros((n, n))
    for j in range(n):
        for i in range(j, n):
            total = h[i, j]
            for k in range(j):
                total -= c[i, k] * c[j, k]
            c[i, j] = math.sqrt(max(total, 1e-300)) if i == j else total / c[j, j]
    for j in range(n):
        for i in range(j, n):
            total = 1.0 if i == j else 0.0
            for k in range(j, i):
                total -= c[i, k] * inverse[k, j]
            inverse[i, j] = total / c[i, i]
    return inverse


@njit(cache=True)
def corner(tables, numbers, shares, halt):
    """L_F and the inverse of C: what the feet add to the factor of one axis's Hessian."""
    count, feet = shares.shape[0], shares.shape[1] - 2
    lower, h = np.zeros((feet, count)), np.zeros((feet, feet))
    for k in range(feet):
        for i in range(count):
            share = shares[i, k + 2]
            if share > 0.0:
                for j in range(i + 1):
                    lower[k, j] -= numbers.beta * share * tables.w_zmp[i, j]
                for j in range(k + 1):
                    h[k, j] += numbers.beta * share * shares[i, j + 2]
        weight = numbers.still if k + 1 == halt else numbers.delta
        h[k, k] += weight + numbers.last
        if k > 0:
            h[k - 1, k - 1] += weight
            h[k, k - 1] -= weight
        for j in range(k + 1):
            for i in range(count):
                h[k, j] -= lower[k, i] * lower[j, i]
    return lower, inverse_root(h)


@njit(cache=True)
def gradient(tables, numbers, moment, shares, lower, inverse, com, steps, last_feet, drift, target):
    """L^-1 g of both axes; ``drift`` takes the ZMP less its reference without any unknown, at each sample."""
    count, feet = shares.shape[0], shares.shape[1] - 2
    y = np.zeros((2, count + feet))
    origin = (moment.origin_x, moment.origin_y)
    for axis in range(2):
        for i in range(count):
            z = 0.0
            v = 0.0
            for j in range(3):
                z += tables.zmp_state[i, j] * com[axis, j]
                v += tables.velocity_state[i, j] * com[axis, j]
            drift[i, axis] = z - shares[i, 0] * origin[axis]
            by_speed = numbers.alpha * (v - target[i, axis])
            by_zmp = numbers.beta * drift[i, axis]
            for j in range(i + 1):
                y[axis, j] += by_speed * tables.w_velocity[i, j] + by_zmp * tables.w_zmp[i, j]
        rest = np.zeros(feet)
        for k in range(feet):
            weight = numbers.still if k + 1 == moment.halt else numbers.delta
            rest[k] -= weight * steps[k, axis] + numbers.last * last_feet[k, axis]
            if k > 0:
                rest[k - 1] += weight * steps[k, axis]
            for i in range(count):
                rest[k] -= numbers.beta * shares[i, k + 2] * drift[i, axis]
            for j in range(count):
                rest[k] -= lower[k, j] * y[axis, j]
        for k in range(feet):
            for j in range(k + 1):
                y[axis, count + k] += inverse[k, j] * rest[j]
    return y


@njit(cache=True)
def heading(moment, step_time, t):
    """Yaw of the body some time ahead: the foot's that stands, at the middle of its step."""
    return moment.yaw + moment.omega * (moment.phase + t - step_time / 2)


@njit(cache=True)
def add_foot(row, inverse, count, feet, k, x, y):
    """Adds the coefficients of foot k (0: the next one) to a row; k < 0 is a foot that stands already."""
    if k < 0:
        return
    for j in range(k, feet):
        row[count + j] += x * inverse[j, k]
        row[2 * count + feet + j] += y * inverse[j, k]


@njit(cache=True)
def add_yaw(row, numbers, count, feet, k, slope):
    """Adds the slope by the yaw of foot k, which is the sum of the changes up to it."""
    for j in range(k + 1):
        row[2 * (count + feet) + j] += slope / numbers.yaw


@njit(cache=True)
def add_motion(row, table, base, count, feet, i, x, y):
    """Adds a row of the time-stepping (jerks) and its share of the feet, along both axes."""
    for j in range(i + 1):
        row[j] += x * table[i, j]
        row[count + feet + j] += y * table[i, j]
    for j in range(feet):
        row[count + j] += x * base[i, j]
        row[2 * count + feet + j] += y * base[i, j]


@njit(cache=True)
def foot_rows(matrix, low, high, tables, numbers, moment, inverse, yaws, last, pinned):
    """Hull of each landing (2.70 to 2.78) and the relative yaw; a landing that comes too soon is held as it was."""
    feet = inverse.shape[0]
    count = tables.inverse.shape[0]
    m = 0
    if pinned:
        for axis in range(2):
            add_foot(matrix[m], inverse, count, feet, 0, 1.0 - axis, float(axis))
            low[m] = high[m] = last[0, axis]
            m += 1
        add_yaw(matrix[m], numbers, count, feet, 0, 1.0)
        low[m] = high[m] = last[0, 2] - yaws[1]
        m += 1
    for k in range(1 if pinned else 0, feet):
        side = -moment.sign if k % 2 == 0 else moment.sign
        cos, sin = math.cos(yaws[k]), math.sin(yaws[k])
        dx = last[k, 0] - (last[k - 1, 0] if k > 0 else 0.0)
        dy = last[k, 1] - (last[k - 1, 1] if k > 0 else 0.0)
        for e in range(tables.hull.shape[0]):
            nx, ny = tables.hull[e, 0], tables.hull[e, 1] * side
            x, y = cos * nx - sin * ny, sin * nx + cos * ny
            add_foot(matrix[m], inverse, count, feet, k, x, y)
            add_foot(matrix[m], inverse, count, feet, k - 1, -x, -y)
            if k > 0:
                add_yaw(matrix[m], numbers, count, feet, k - 1, x * dy - y * dx)
            low[m], high[m] = -1e30, tables.hull[e, 2]
            m += 1
        matrix[m, 2 * (count + feet) + k] = 1.0 / numbers.yaw
        turn = yaws[k + 1] - yaws[k]
        low[m] = min(max(-numbers.longest_turn - turn, -TRUST), 0.0)
        high[m] = max(min(numbers.longest_turn - turn, TRUST), 0.0)
        m += 1
    return m


@njit(cache=True)
def zmp_rows(matrix, low, high, m, tables, numbers, moment, shares, base, drift, error, yaws):
    """The zero moment point stays in the shrunk sole around its reference (2.65 to 2.69), turned by the yaws' mean.

    Before a first step the weight is anywhere between the feet, which stand side by side.
    """
    count, feet = shares.shape[0], shares.shape[1] - 2
    for i in range(count):
        yaw = (shares[i, 0] + shares[i, 1]) * yaws[0]
        for k in range(feet):
            yaw += shares[i, k + 2] * yaws[k + 1]
        cos, sin = math.cos(yaw), math.sin(yaw)
        for axis in range(2):
            x, y = (cos, sin) if axis == 0 else (-sin, cos)
            add_motion(matrix[m], tables.w_zmp, base, count, feet, i, x, y)
            slope = x * error[i, 1] - y * error[i, 0]
            for k in range(feet):
                add_yaw(matrix[m], numbers, count, feet, k, shares[i, k + 2] * slope)
            known = x * drift[i, 0] + y * drift[i, 1]
            wider = 0.0
            if moment.phase + (i + 1) * numbers.sample < moment.double_support - numbers.double_support + 1e-9:
                wider = 0.5 * abs(x * moment.swing_x + y * moment.swing_y)
            low[m] = (numbers.rear if axis == 0 else -numbers.side) - known - wider
            high[m] = (numbers.front if axis == 0 else numbers.side) - known + wider
            m += 1
    return m


@njit(cache=True)
def capture_rows(matrix, low, high, m, tables, numbers, moment, shares, lower, inverse, com, yaws):
    """Where the horizon ends, the DCM lies where further steps can catch it; without, a plan may end in a fall.

    With r until the next landing and the ZMP on the foot that stands then, less what double support leaves to it,
    (xi - F) e^(omega r) has to lie between the offsets from which steps of the greatest drift to either side start. A
    robot that stands by then holds the DCM where the ZMP may be.
    """
    count, feet = shares.shape[0], shares.shape[1] - 2
    i = count - 1
    t = count * numbers.sample
    row = np.zeros(count + feet)
    for j in range(count):
        row[j] = tables.w_position[i, j] + tables.w_velocity[i, j] / numbers.omega
        for k in range(feet):
            for n in range(k, feet):
                row[count + n] -= inverse[n, k] * lower[k, j] * row[j]
    weights = np.zeros(feet)
    known = np.zeros(2)
    for j in range(3):
        factor = tables.position_state[i, j] + tables.velocity_state[i, j] / numbers.omega
        known += factor * com[:, j]
    landed = 0
    while landed < feet and t > moment.remaining + landed * numbers.step_time - 1e-9 and landed != moment.halt:
        landed += 1
    if landed == moment.halt:
        known[0] -= shares[i, 0] * moment.origin_x
        known[1] -= shares[i, 0] * moment.origin_y
        weights[:] = shares[i, 2:]
        rear, front, least, most = numbers.rear, numbers.front, -numbers.side, numbers.side
    else:
        over = 1.0 - shares[i, 0]
        if landed > 0:
            over = (t - moment.remaining - (landed - 1) * numbers.step_time) / max(numbers.double_support, 1e-9)
        rest = max(1.0 - over, 0.0)
        lag = numbers.omega * rest * numbers.double_support
        old = rest * (1.0 - (1.0 - math.exp(-lag)) / lag) if lag > 1e-9 else 0.0
        if landed > 0:
            weights[landed - 1] = 1.0 - old
            if landed > 1:
                weights[landed - 2] = old
        else:
            known[0] -= old * moment.origin_x
            known[1] -= old * moment.origin_y
        left = max(moment.remaining + landed * numbers.step_time - t, 0.0)
        fade = math.exp(-numbers.omega * left)
        side = -moment.sign if landed % 2 == 0 else moment.sign
        front, rear = fade * numbers.end_ahead, -fade * numbers.end_ahead
        least = fade * min(side * numbers.end_inner, side * numbers.end_outer)
        most = fade * max(side * numbers.end_inner, side * numbers.end_outer)
    cos, sin = math.cos(yaws[landed]), math.sin(yaws[landed])
    for axis in range(2):
        x, y = (cos, sin) if axis == 0 else (-sin, cos)
        for j in range(count + feet):
            matrix[m, j] = x * row[j]
            matrix[m, count + feet + j] = y * row[j]
        for k in range(feet):
            add_foot(matrix[m], inverse, count, feet, k, -x * weights[k], -y * weights[k])
        value = x * known[0] + y * known[1]
        low[m] = (rear if axis == 0 else least) - value
        high[m] = (front if axis == 0 else most) - value
        m += 1
    return m


@njit(cache=True)
def swing_share(phase, first, remaining):
    """How much of the swing foot's way lies behind it: the fifth-order polynomial of 2.97 to 2.110."""
    s = min(max((phase - first) / max(phase + remaining - first, 1e-9), 0.0), 1.0)
    return s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)


@njit(cache=True)
def foot_clearance(matrix, low, m, numbers, moment, inverse, yaws, last, circles):
    """Each previewed foot keeps clear of each circle, where it lands and on its way:

    n.((1 - b) S + b F + R offset - o) >= r + gap + h(n), n frozen at the last plan: then the sole is outside for sure.
    """
    feet = inverse.shape[0]
    count = (matrix.shape[1] - 3 * feet) // 2
    behind = swing_share(moment.phase, moment.double_support, moment.remaining)
    for k in range(feet):
        if 0 <= moment.halt < k + 1:
            break
        cos, sin = math.cos(yaws[k + 1]), math.sin(yaws[k + 1])
        sx, sy = moment.swing_x, moment.swing_y
        if k == 1:
            sx = sy = 0.0
        elif k > 1:
            sx, sy = last[k - 2, 0], last[k - 2, 1]
        for c in range(circles.shape[0]):
            distance = math.hypot(circles[c, 0], circles[c, 1]) - circles[c, 2]
            if distance > (k + 1) * numbers.reach + numbers.half_length + abs(numbers.ahead) + numbers.gap:
                continue
            for b in FOOT_PATH:
                if k == 0 and b < 1.0 and b <= behind:
                    continue
                px = (1 - b) * sx + b * last[k, 0] + cos * numbers.ahead - circles[c, 0]
                py = (1 - b) * sy + b * last[k, 1] + sin * numbers.ahead - circles[c, 1]
                length = math.hypot(px, py)
                nx, ny = (px / length, py / length) if length > 1e-6 else (-sin, cos)
                along, aside = nx * cos + ny * sin, ny * cos - nx * sin
                add_foot(matrix[m], inverse, count, feet, k, b * nx, b * ny)
                known = -nx * circles[c, 0] - ny * circles[c, 1] + along * numbers.ahead
                if k > 1:
                    add_foot(matrix[m], inverse, count, feet, k - 2, (1 - b) * nx, (1 - b) * ny)
                else:
                    known += (1 - b) * (nx * sx + ny * sy)
                half = numbers.half_length * abs(along) + numbers.half_width * abs(aside)
                # n.ex grows by n.ey, and n.ey by -n.ex, as the foot turns
                slope = numbers.ahead * aside - numbers.half_length * math.copysign(aside, along * aside)
                slope += numbers.half_width * math.copysign(along, along * aside)
                add_yaw(matrix[m], numbers, count, feet, k, slope)
                low[m] = circles[c, 2] + numbers.gap + half - known
                m += 1
    return m


@njit(cache=True)
def body_clearance(matrix, low, m, tables, numbers, lower, inverse, com, jerks, circles):
    """The centre of mass keeps the body's radius from each circle, at a few instants."""
    count, feet = tables.inverse.shape[0], inverse.shape[0]
    for b in range(1, BODY_ROWS + 1):
        i = max(b * count // BODY_ROWS, 1) - 1
        x = y = 0.0
        for j in range(3):
            x += tables.position_state[i, j] * com[0, j]
            y += tables.position_state[i, j] * com[1, j]
        rest = np.zeros(feet)
        for k in range(feet):
            total = 0.0
            for j in range(i + 1):
                total -= lower[k, j] * tables.w_position[i, j]
            for j in range(k, feet):
                rest[j] += inverse[j, k] * total
        px, py = x, y
        for j in range(i + 1):
            px += tables.position_jerk[i, j] * jerks[0, j]
            py += tables.position_jerk[i, j] * jerks[1, j]
        for c in range(circles.shape[0]):
            away = math.hypot(px - circles[c, 0], py - circles[c, 1])
            if away < 1e-6 or away - circles[c, 2] > numbers.body + 2.0 * numbers.reach:
                continue
            nx, ny = (px - circles[c, 0]) / away, (py - circles[c, 1]) / away
            for j in range(i + 1):
                matrix[m, j] = nx * tables.w_position[i, j]
                matrix[m, count + feet + j] = ny * tables.w_position[i, j]
            for j in range(feet):
                matrix[m, count + j] = nx * rest[j]
                matrix[m, 2 * count + feet + j] = ny * rest[j]
            low[m] = circles[c, 2] + numbers.body - nx * (x - circles[c, 0]) - ny * (y - circles[c, 1])
            m += 1
    return m


@njit(cache=True)
def assemble(tables, numbers, moment, com, steps, yaws, last, jerks, circles, pinned):
    """The least-distance problem: rows, bounds, marks, slacks; and what `unfold` needs to go back.

    ``com`` 2 x 3, ``steps`` F x 2 displacements, ``yaws`` F + 1 (the standing foot's first), ``last`` F x 3 the last
    plan's feet, ``jerks`` 2 x N the last plan's, ``circles`` C x 3; positions relative to the foot that stands.
    """
    count, feet = tables.inverse.shape[0], steps.shape[0]
    wide = 2 * count + 3 * feet
    shares = selection(
        count,
        feet,
        numbers.sample,
        moment.phase,
        moment.remaining,
        moment.double_support,
        numbers.double_support,
        numbers.step_time,
        moment.halt,
    )
    lower, inverse = corner(tables, numbers, shares, moment.halt)
    target = np.empty((count, 2))
    for i in range(count):
        psi = heading(moment, numbers.step_time, (i + 1) * numbers.sample)
        target[i, 0] = math.cos(psi) * moment.vx - math.sin(psi) * moment.vy
        target[i, 1] = math.sin(psi) * moment.vx + math.cos(psi) * moment.vy
    drift = np.empty((count, 2))
    y = gradient(tables, numbers, moment, shares, lower, inverse, com, steps, last, drift, target)
    base = np.zeros((count, feet))
    error = drift.copy()
    for i in range(count):
        for k in range(feet):
            value = -shares[i, k + 2]
            for axis in range(2):
                error[i, axis] -= shares[i, k + 2] * last[k, axis]
            for j in range(i + 1):
                value -= lower[k, j] * tables.w_zmp[i, j]
            for j in range(k, feet):
                base[i, j] += inverse[j, k] * value
        for j in range(i + 1):
            error[i, 0] += tables.zmp_jerk[i, j] * jerks[0, j]
            error[i, 1] += tables.zmp_jerk[i, j] * jerks[1, j]
    most = feet * (tables.hull.shape[0] + 1) + 5 + 2 * count + circles.shape[0] * (3 * feet + BODY_ROWS)
    matrix = np.zeros((most, wide))
    low, high = np.empty(most), np.full(most, 1e30)
    hard = foot_rows(matrix, low, high, tables, numbers, moment, inverse, yaws, last, pinned)
    zmp = zmp_rows(matrix, low, high, hard, tables, numbers, moment, shares, base, drift, error, yaws)
    zmp = capture_rows(matrix, low, high, zmp, tables, numbers, moment, shares, lower, inverse, com, yaws)
    m = clear = zmp
    if circles.shape[0] > 0:
        clear = foot_clearance(matrix, low, m, numbers, moment, inverse, yaws, last, circles)
        m = body_clearance(matrix, low, clear, tables, numbers, lower, inverse, com, jerks, circles)
    marks, slack = np.zeros(m, np.int32), np.ones(m)
    marks[hard:] = SOFT
    slack[hard:zmp] = SLACK_ZMP
    slack[zmp:clear] = SLACK_FEET
    slack[clear:] = SLACK_BODY
    for i in range(m):
        shift = 0.0
        for j in range(count + feet):
            shift += matrix[i, j] * y[0, j] + matrix[i, count + feet + j] * y[1, j]
        low[i] += shift
        if high[i] < 1e29:
            high[i] += shift
    return matrix[:m], low[:m], high[:m], marks, slack, y, lower, inverse, shares, hard, zmp


@njit(cache=True)
def unfold(u, tables, numbers, moment, matrix, low, high, y, lower, inverse, shares, yaws, hard, zmp, place):
    """The plan that a point u stands for, moved to the foot's ``place``.

    Jerks; feet (x, y, yaw) and their displacements; the ZMP's reference; and four numbers: greatest violation of the
    hard, the ZMP and the clearance rows, and 1 where a clearance row is active. Not finite: the first is infinite.
    """
    count, feet = tables.inverse.shape[0], inverse.shape[0]
    jerks, steps, moved = np.zeros((2, count)), np.zeros((feet, 3)), np.zeros((feet, 2))
    reference = np.empty((count, 2))
    for axis in range(2):
        w = u[axis * (count + feet) : (axis + 1) * (count + feet)] - y[axis]
        for k in range(feet):
            for j in range(k, feet):
                steps[k, axis] += inverse[j, k] * w[count + j]
            moved[k, axis] = steps[k, axis] - (steps[k - 1, axis] if k > 0 else 0.0)
        for j in range(count):
            for k in range(feet):
                w[j] -= lower[k, j] * steps[k, axis]
        for j in range(count):
            for i in range(j + 1):
                jerks[axis, j] += tables.inverse[i, j] * w[i]
        origin = moment.origin_x if axis == 0 else moment.origin_y
        for i in range(count):
            reference[i, axis] = place[axis] + shares[i, 0] * origin
            for k in range(feet):
                reference[i, axis] += shares[i, k + 2] * steps[k, axis]
        for k in range(feet):
            steps[k, axis] += place[axis]
    turned = 0.0
    for k in range(feet):
        turned += u[2 * (count + feet) + k] / numbers.yaw
        steps[k, 2] = yaws[k + 1] + turned
    figures = np.zeros(4)
    for i in range(matrix.shape[0]):
        value = 0.0
        for j in range(u.shape[0]):
            value += matrix[i, j] * u[j]
        kind = 0 if i < hard else (1 if i < zmp else 2)
        figures[kind] = max(figures[kind], low[i] - value, value - high[i])
        if kind == 2 and value - low[i] < 1e-6:
            figures[3] = 1.0
    if not (np.isfinite(jerks).all() and np.isfinite(steps).all()):
        figures[0] = np.inf
    return jerks, steps, moved, reference, figures


@njit(cache=True)
def shift(jerks, zmp, steps, moved, late, landed, step, turn):
    """A plan seen ``late`` samples on; where its first foot has ``landed``, one more is added at the end."""
    count, feet = jerks.shape[1], steps.shape[0]
    new_jerks, new_zmp = np.zeros((2, count)), np.empty((count, 2))
    new_steps, new_moved = steps.copy(), moved.copy()
    for i in range(count):
        if i + late < count:
            new_jerks[:, i] = jerks[:, i + late]
        new_zmp[i] = zmp[min(i + late, count - 1)]
    if landed:
        for k in range(feet - 1):
            new_steps[k] = steps[k + 1]
            new_moved[k] = moved[k + 1]
        new_moved[feet - 1] = step
        new_steps[feet - 1, :2] = steps[feet - 1, :2] + step
        new_steps[feet - 1, 2] = turn
    return new_jerks, new_zmp, new_steps, new_moved
