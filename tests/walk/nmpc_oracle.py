"""The reduced controller's problem once more, written from the physics: costs and constraints of simulated motions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from toddle.signals import Velocity
from toddle.walk.pattern.nmpc_kernels import TRUST
from toddle.walk.pattern.nmpc_problem import GAP, Nmpc, Plan, PlanState, drawn_to, turned


class Row(NamedTuple):
    kind: str
    value: float
    low: float
    high: float


def rotation(yaw):
    return np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])


def unpacked(problem: Nmpc, x):
    """Jerks 2 x N, feet F x 2, yaws F from the vector (jerks, feet of x; of y; yaws)."""
    count, feet = problem.gait.preview, problem.gait.steps
    axes = x[: 2 * (count + feet)].reshape(2, -1)
    return axes[:, :count], axes[:, count:].T, x[2 * (count + feet) :]


def packed(plan: Plan):
    return np.concatenate([plan.jerks[0], plan.feet[:, 0], plan.jerks[1], plan.feet[:, 1], plan.feet[:, 2]])


def motion(problem: Nmpc, state: PlanState, jerks):
    """Position, velocity, acceleration at each sample: integrated one after the other."""
    t, now, rows = problem.gait.sample, np.array(state.com, dtype=float), []
    for jerk in jerks.T:
        p, v, a = now.T
        now = np.stack([p + v * t + a * t**2 / 2 + jerk * t**3 / 6, v + a * t + jerk * t**2 / 2, a + jerk * t], axis=1)
        rows.append(now)
    return np.array(rows)


def blend(problem: Nmpc, state: PlanState, quantities, t):
    """Of origin, standing foot, next feet: the weight passes on by ramps, one after each landing."""
    gait = problem.gait
    value = quantities[0]
    waits = max(state.double_support - gait.double_support, 0.0)
    starts = [waits - state.phase] + [state.remaining + k * gait.step_time for k in range(gait.steps)]
    spans = [state.double_support - waits] + [gait.double_support] * gait.steps
    for k, (start, span) in enumerate(zip(starts, spans, strict=True)):
        if 0 <= state.halt < k:
            break
        share = float(np.clip((t - start) / span, 0, 1)) * (0.5 if k == state.halt else 1.0)
        value = value + share * (quantities[k + 1] - quantities[k])
    return value


def cost(problem: Nmpc, state: PlanState, velocity: Velocity, x) -> float:
    gait, w = problem.gait, problem.weights
    jerks, feet, yaws = unpacked(problem, x)
    moved = motion(problem, state, jerks)
    foot = np.array([state.support.x, state.support.y])
    total = w.gamma / 2 * (jerks**2).sum()
    for i, row in enumerate(moved):
        t = (i + 1) * gait.sample
        heading = state.support.yaw + velocity.omega * (state.phase + t - gait.step_time / 2)
        wanted = rotation(heading) @ np.array([velocity.vx, velocity.vy])
        zmp = row[:, 0] - gait.com_height / 9.81 * row[:, 2]
        aim = blend(problem, state, [np.array(state.origin), foot, *feet], t)
        total += w.alpha / 2 * ((row[:, 1] - wanted) ** 2).sum() + w.beta / 2 * ((zmp - aim) ** 2).sum()
    steps = np.diff(np.vstack([foot, feet]), axis=0) - drawn_to(problem, state, velocity)
    for k, step in enumerate(steps):
        total += (1e6 if k + 1 == state.halt else w.delta) / 2 * (step**2).sum()
    nominal = turned(problem, state.support.yaw, velocity)
    turns = np.diff(np.concatenate([[state.support.yaw], yaws])) - np.diff(nominal)
    return total + w.yaw / 2 * (turns**2).sum()


def rows(problem: Nmpc, state: PlanState, velocity: Velocity, circles, last, x) -> list[Row]:
    """Constraints in the kernels' order, but capture; normals to circles as seen from ``last``."""
    gait = problem.gait
    jerks, feet, yaws = unpacked(problem, x)
    last_jerks, last_feet, last_yaws = unpacked(problem, last)
    foot, origin = np.array([state.support.x, state.support.y]), np.array(state.origin)
    line, angle = np.vstack([foot, feet]), np.concatenate([[state.support.yaw], yaws])
    found = []
    corners = np.array(gait.hull or box(gait))
    sign = 1.0 if state.support.side == 0 else -1.0
    commanded = turned(problem, state.support.yaw, velocity)
    for k in range(gait.steps):
        side = -sign * (-1) ** k
        local = rotation(angle[k]).T @ (line[k + 1] - line[k]) * [1, side]
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            out = np.array([a[1] - b[1], b[0] - a[0]]) / np.linalg.norm(b - a)
            found.append(Row("hull", float(out @ (local - a)), -np.inf, 0.0))
        turn, asked = angle[k + 1] - angle[k], commanded[k + 1] - commanded[k]
        most = gait.longest_turn
        found.append(Row("turn", turn, max(-most, asked - TRUST), min(most, asked + TRUST)))
    moved, last_moved = motion(problem, state, jerks), motion(problem, state, last_jerks)
    half = np.array([gait.foot_length / 2 - gait.margin[0], gait.foot_width / 2 - gait.margin[1]])
    for i, row in enumerate(moved):
        t = (i + 1) * gait.sample
        zmp = row[:, 0] - gait.com_height / 9.81 * row[:, 2]
        off = zmp - blend(problem, state, [origin, *line], t)
        off = rotation(blend(problem, state, [angle[0], *angle], t)).T @ off
        found.append(Row("zmp", off[0], min(gait.foot_ahead - half[0], 0), gait.foot_ahead + half[0]))
        found.append(Row("zmp", off[1], -half[1], half[1]))
    behind = passed(gait, state)
    around = circles[np.argsort(np.hypot(*(circles[:, :2] - foot).T) - circles[:, 2], kind="stable")]
    starts = [np.array([state.lifted.x, state.lifted.y]), foot, *feet]
    last_starts = [starts[0], foot, *last_feet]
    reach, sole = problem.numbers.reach, gait.foot_length / 2 + abs(gait.foot_ahead) + GAP
    for k in range(gait.steps if state.halt < 0 else min(state.halt, gait.steps)):
        for x0, y0, radius in around:
            if np.hypot(x0 - foot[0], y0 - foot[1]) - radius > (k + 1) * reach + sole:
                continue
            for b in (1.0, 0.7, 0.35):
                if k == 0 and b < 1 and b <= behind:
                    continue
                ahead = np.array([gait.foot_ahead, 0.0])
                seen = (1 - b) * last_starts[k] + b * last_feet[k] + rotation(last_yaws[k]) @ ahead - [x0, y0]
                n = seen / np.linalg.norm(seen)
                middle = (1 - b) * starts[k] + b * feet[k] + rotation(yaws[k]) @ ahead - [x0, y0]
                half = np.abs(rotation(yaws[k]).T @ n) @ [gait.foot_length / 2, gait.foot_width / 2]
                found.append(Row("foot", float(n @ middle - half), radius + GAP, np.inf))
    for b in range(1, 5):
        i = b * gait.preview // 4 - 1
        for x0, y0, radius in around:
            n = last_moved[i][:, 0] - [x0, y0]
            if np.linalg.norm(n) - radius > problem.numbers.body + 2 * reach:
                continue
            n /= np.linalg.norm(n)
            found.append(Row("body", float(n @ (moved[i][:, 0] - [x0, y0])), radius + problem.numbers.body, np.inf))
    return found


def passed(gait, state):
    single = state.phase + state.remaining - state.double_support
    s = float(np.clip((state.phase - state.double_support) / single, 0, 1))
    return 10 * s**3 - 15 * s**4 + 6 * s**5


def box(gait):
    k = gait.com_height / 0.465
    inner, outer = gait.foot_distance - 0.02 * k, gait.foot_distance + 0.16 * k
    return ((-0.24 * k, inner), (-0.24 * k, outer), (0.24 * k, outer), (0.24 * k, inner))
