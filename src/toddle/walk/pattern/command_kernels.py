"""What a command asks of a walker, compiled: the safety gate, what fits the hull, and where the next footsteps go.

Functions bear the names of those that do the same for a single walker (`gate`, `displacement`, `feasible`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

ROUNDING, HALVINGS = 1e-9, 30


class Stride(NamedTuple):
    """What of a gait isn't among the programme's numbers: lengths [m], times [s], the gate's limits."""

    foot_distance: float
    freeze: float
    shift: float
    ahead: float
    aside: float
    turning: float
    backwards: float
    acceleration: float
    turning_acceleration: float


@njit(cache=True)
def within(number, most):
    """The number, between -most and most."""
    return min(max(number, -most), most)


@njit(cache=True)
def gate(stride, allowed, asked, dt):
    """`walk.gate.gate`; ``allowed`` changes."""
    vx = vy = omega = 0.0
    if math.isfinite(asked[0]) and math.isfinite(asked[1]) and math.isfinite(asked[2]):
        vx = max(within(asked[0], stride.ahead), -stride.backwards)
        vy, omega = within(asked[1], stride.aside), within(asked[2], stride.turning)
        most = stride.ahead if vx > 0 else stride.backwards
        far = math.hypot(vx / most if most > 0 else 0.0, vy / stride.aside if stride.aside > 0 else 0.0)
        if far > 1:
            vx, vy = vx / far, vy / far
    allowed[0] += within(vx - allowed[0], stride.acceleration * dt)
    allowed[1] += within(vy - allowed[1], stride.acceleration * dt)
    allowed[2] += within(omega - allowed[2], stride.turning_acceleration * dt)


@njit(cache=True)
def displacement(distance, step_time, velocity, sign, yaw):
    """`displacement.displacement`; ``sign`` is 1 where the left foot stands, -1 where the right one does."""
    half = (distance + abs(velocity[1]) * step_time) / 2 * sign
    turn = velocity[2] * step_time
    x, y = velocity[0] * step_time, velocity[1] * step_time
    cos, sin = math.cos(yaw + turn / 2), math.sin(yaw + turn / 2)
    x, y = cos * x - sin * y, sin * x + cos * y
    x += half * (math.sin(yaw) + math.sin(yaw + turn))
    y -= half * (math.cos(yaw) + math.cos(yaw + turn))
    return x, y


@njit(cache=True)
def widening(hull, numbers, stride, velocity):
    """`feasible.widening`; -1: nothing helps."""
    turn = velocity[2] * numbers.step_time
    if abs(turn) > numbers.longest_turn + ROUNDING:
        return -1.0
    least, most = 0.0, np.inf
    cos, sin = math.cos(turn), math.sin(turn)
    apart = numbers.half_width * (1 + cos) + (numbers.half_length + abs(numbers.ahead)) * abs(sin)
    for sign in (1.0, -1.0):
        x, y = displacement(stride.foot_distance, numbers.step_time, velocity, sign, 0.0)
        y *= -sign
        beside = apart if abs(x) < 2 * numbers.half_length else 0.0
        for e in range(hull.shape[0] + 1):
            if e < hull.shape[0]:
                nx, ny, far = hull[e, 0], hull[e, 1], hull[e, 2]
            else:
                nx, ny, far = 0.0, -1.0, -beside
            slope = (nx * sign * sin + ny * (1 + cos)) / 2
            room = far - nx * x - ny * y
            if abs(slope) < 1e-12:
                if room < -ROUNDING:
                    return -1.0
            elif slope > 0:
                most = min(most, room / slope)
            else:
                least = max(least, room / slope)
    return least if least <= most + ROUNDING else -1.0


@njit(cache=True)
def cap(hull, numbers, stride, velocity):
    """`feasible.cap`."""
    if not (math.isfinite(velocity[0]) and math.isfinite(velocity[1]) and math.isfinite(velocity[2])):
        return np.zeros(3)
    if widening(hull, numbers, stride, velocity) >= 0:
        return velocity.copy()
    inside, outside = 0.0, 1.0
    while outside > 1e-3 and widening(hull, numbers, stride, outside * velocity) < 0:
        outside /= 2
    inside, outside = outside if outside > 1e-3 else 0.0, min(2 * outside, 1.0)
    for _ in range(HALVINGS):
        middle = (inside + outside) / 2
        if widening(hull, numbers, stride, middle * velocity) >= 0:
            inside = middle
        else:
            outside = middle
    return inside * velocity


@njit(cache=True)
def drawn_to(numbers, apart, velocity, sign, yaw, out):
    """`nmpc_problem.drawn_to`."""
    for k in range(out.shape[0]):
        out[k, 0], out[k, 1] = displacement(apart, numbers.step_time, velocity, sign, yaw)
        yaw += velocity[2] * numbers.step_time
        sign = -sign


@njit(cache=True)
def turn_of(numbers, velocity):
    """Of a step, by the command [rad]."""
    return within(velocity[2] * numbers.step_time, numbers.longest_turn)
