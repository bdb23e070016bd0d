"""The answer that is exported: damped least squares in float32, from the stored postures that are nearest.

As in `toddle.reach.solve.damped_kernels`, each step solves (J J' + lambda I) y = e and moves the joints by J' y, with
lambda = 0.02 |e|^2 + 1e-9 (Wampler 1986; Sugihara 2011), and a joint that would pass its limit stops there while the
others take over. Eight starts go side by side; where none arrives in fourteen steps, the next eight have their turn.
Every target goes its own way: an answer doesn't depend on what else is in the batch.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.outside.export_ops import Ops, State, Tensor

LANES, ROUNDS, STEPS, SETTLE = 8, 4, 14, 40
_REACHED = 1e-5  # [m]
_DAMPING, _LEAST = 0.02, 1e-8
_LIMITED = 2  # solves in a step, each without the joints that the one before would have carried past a limit
_FAR = 1e30
_CALMER, _BOLDER = 0.4, 10.0


class Miss(NamedTuple):
    """What is missing at postures, all (batch, lanes, ...).

    Attributes:
        error: what the tip still has to do [m] (rows, 1).
        slope: how the joints do it, each by its scale [m] (rows, joints).
        square: squared distance to the target [m^2] (1).
        angle: between the orientation there and the one asked for [rad] (1).
    """

    error: Tensor
    slope: Tensor
    square: Tensor
    angle: Tensor


@dataclass(frozen=True)
class Problem:
    """A body to be exported, as numbers and as what its model computes.

    Attributes:
        lower: lower limits [rad or m].
        upper: upper limits.
        scale: what a joint moves for a step of one [rad or m].
        stride: the longest step.
        starts: stored postures.
        places: where they put the tip, and how it is turned [m].
        rows: of the task: position, and orientation where it is known.
        lever: what an angle counts for [m/rad].
        freest: whether the freest of all postures that arrive is taken, else the first one to arrive.
        goal: operations and the inputs to the target as ``places`` has it, and what ``miss`` is to know of it.
        miss: operations, postures and goal to what is missing there.
    """

    lower: Float[np.ndarray, " joints"]
    upper: Float[np.ndarray, " joints"]
    scale: Float[np.ndarray, " joints"]
    stride: float
    starts: Float[np.ndarray, "starts joints"]
    places: Float[np.ndarray, "starts places"]
    rows: int
    lever: float
    freest: bool
    goal: Callable[..., tuple[Tensor, Tensor]]
    miss: Callable[[Ops, Tensor, Tensor], Miss]


def answered(ops: Ops, problem: Problem, *inputs: Tensor) -> dict[str, Tensor]:
    """The outputs: joint values (batch, joints), distance [m] and angle [rad] (batch)."""
    place, goal = problem.goal(ops, *inputs)
    lanes, joints = min(LANES, len(problem.starts)), len(problem.lower)
    rounds = min(ROUNDS, len(problem.starts) // lanes)
    far = np.sum(problem.places**2, axis=1)[None]
    cost = ops.constant(far) - 2.0 * ops.matmul(place, ops.constant(problem.places.T))
    starts = ops.shape(ops.rows(problem.starts, cost, lanes * rounds), (rounds, lanes, joints))
    first = ops.shape(ops.take(starts, [0], 1), (lanes, joints))
    none = 0.0 * ops.sum(first, -1) + _FAR

    def descent(number: Tensor, best: State) -> tuple[State, Tensor]:
        found = _descended(ops, problem, goal, ops.at(starts, number, 1), best[1], STEPS)
        better = (found[1] < best[1]) & _unsolved(ops, best[1])
        best = ops.where(better, found[0], best[0]), ops.where(better, found[1], best[1])
        return best, _unsolved(ops, best[1])

    q, total = ops.repeat(rounds, descent, (first, none))
    q, total = _descended(ops, problem, goal, q, total, SETTLE, careful=True)
    level = ops.maximum(total, ops.constant(_REACHED**2))  # all that arrived are as good: the nearest start's is taken
    if problem.freest:
        level = ops.where(total > _REACHED**2, total, -_freedom(ops, problem, problem.miss(ops, q, goal).slope, q))
    chosen = ops.sum(q * ops.first_least(level, lanes, 1), 1)
    end = problem.miss(ops, chosen, goal)
    outputs = {"joints": ops.shape(chosen, (joints,)), "distance": ops.shape(ops.sqrt(end.square), ())}
    return outputs if problem.rows <= 3 else {**outputs, "angle": ops.shape(end.angle, ())}


def _unsolved(ops: Ops, total: Tensor) -> Tensor:
    """(batch, 1, 1) whether no lane of a target has arrived."""
    return ops.least(total, 1) > _REACHED**2


def _descended(
    ops: Ops, problem: Problem, goal: Tensor, q: Tensor, other: Tensor, steps: int, *, careful: bool = False
) -> State:
    """Postures of least error on the way down, and that error squared [m^2] (batch, lanes, 1).

    Args:
        ops, problem, goal: what is computed, and towards what.
        q: where to start from (batch, lanes, joints).
        other: what was come to before; where that is enough there is nothing left to do.
        steps: at most.
        careful: whether a step that leads up is taken back, and the next is damped more (Marquardt 1963).
    """

    def step(_: Tensor, state: State) -> tuple[State, Tensor]:
        q, kept, least, growth = state
        miss = problem.miss(ops, q, goal)
        total = miss.square + problem.lever**2 * miss.angle * miss.angle
        better = total <= least
        kept, least = ops.where(better, q, kept), ops.where(better, total, least)
        if careful:
            growth = ops.where(better, ops.maximum(_CALMER * growth, ops.constant(1.0)), _BOLDER * growth)
        onward = _moved(ops, problem, miss, growth * (_DAMPING * total + _LEAST), q)
        if careful:
            onward = ops.where(better, onward, kept)
        if problem.freest:
            left = _unsolved(ops, other) & (least > _REACHED**2)
        else:
            left = _unsolved(ops, ops.minimum(least, other))
        return (ops.where(left, onward, q), kept, least, growth), left

    none = 0.0 * ops.sum(q, -1)
    return ops.repeat(steps, step, (q, q, none + _FAR, none + 1.0))[1:3]


def _freedom(ops: Ops, problem: Problem, slope: Tensor, q: Tensor) -> Tensor:
    """How far postures are from being stuck (batch, lanes, 1); see `toddle.reach.solve.gauss_newton.freedom`.

    Its smallest singular value stands here as the root of 1 / trace (J J')^-1, which is at most that.
    """
    lanes = min(LANES, len(problem.starts))
    unit = ops.constant(np.eye(problem.rows)[None, None])
    inverse = _solved(
        ops,
        ops.matmul(slope, ops.turned(slope)),
        unit + 0.0 * ops.take(slope, [0], -1),
        ops.constant(_LEAST),
        problem.rows,
        problem.rows,
    )
    trace = ops.shape(ops.sum(ops.sum(unit * inverse, -1), -2), (lanes, 1))
    lower, upper = (ops.constant(part[None, None]) for part in (problem.lower, problem.upper))
    margin = ops.least(ops.minimum(q - lower, upper - q) / (upper - lower), -1)
    return ops.minimum(ops.maximum(margin * 10.0, ops.constant(0.02)), ops.constant(1.0)) / ops.sqrt(trace)


def _moved(ops: Ops, problem: Problem, miss: Miss, damping: Tensor, q: Tensor) -> Tensor:
    """The postures after a damped step within the limits."""
    lower, upper, scale = (ops.constant(part[None, None]) for part in (problem.lower, problem.upper, problem.scale))
    lanes, joints = min(LANES, len(problem.starts)), len(problem.scale)
    damping = ops.shape(damping, (lanes, 1, 1))
    error, slope, held = miss.error, miss.slope, 0.0 * q
    for _ in range(_LIMITED - 1):
        aim = q + _step(ops, problem, error, slope, damping) * scale
        end = ops.minimum(ops.maximum(aim, lower), upper)
        free = (lower <= aim) & (aim <= upper)
        stopped = ops.where(free, 0.0 * q, (end - q) / scale)
        held = held + stopped
        error = error - ops.matmul(slope, ops.shape(stopped, (lanes, joints, 1)))
        slope = ops.where(ops.shape(free, (lanes, 1, joints)), slope, 0.0 * slope)
    step = held + _step(ops, problem, error, slope, damping)
    longest = ops.maximum(ops.greatest(step, -1), -ops.least(step, -1))
    part = ops.minimum(ops.constant(1.0), problem.stride / ops.maximum(longest, ops.constant(1e-12)))
    return ops.minimum(ops.maximum(q + part * step * scale, lower), upper)


def _step(ops: Ops, problem: Problem, error: Tensor, slope: Tensor, damping: Tensor) -> Tensor:
    """J' y with (J J' + lambda I) y = e."""
    across = ops.turned(slope)
    pull = _solved(ops, ops.matmul(slope, across), error, damping, problem.rows)
    return ops.shape(ops.matmul(across, pull), (-1, len(problem.scale)))


def _solved(ops: Ops, matrix: Tensor, right: Tensor, damping: Tensor, rows: int, sides: int = 1) -> Tensor:
    """(A + lambda I)^-1 b for a positive A, by Gauss and Jordan: it needs no pivoting then, and no linear algebra."""
    unit = np.eye(rows)
    table = ops.join([matrix + damping * ops.constant(unit[None, None]), right], -1)
    for k in range(rows):
        row = ops.take(table, [k], -2)
        row = row / ops.maximum(ops.take(row, [k], -1), damping)
        table = table - (ops.take(table, [k], -1) - ops.constant(unit[None, None, :, k : k + 1])) * row
    return ops.take(table, range(rows, rows + sides), -1)
