"""A batch of walkers on processors: whole iterations compiled, commands, programme and active sets, no lock held.

The same walks as `reduced.Reduced.step`, to a rounding error; records as in `batch.step_batch`, so that either may go
on where the other has stopped. Times are taken to the whole microsecond where single precision has blurred them,
since they are compared with each other; everything is worked out in double precision.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeVar

import numpy as np
from jaxtyping import Float

from toddle.walk.gate import ACCELERATION, BACKWARDS, TURNING
from toddle.walk.pattern.batch import BatchWalk
from toddle.walk.pattern.batch_native_kernels import walk_on
from toddle.walk.pattern.batch_state import PADDING, BatchPlan, BatchState, stacked
from toddle.walk.pattern.command_kernels import Stride
from toddle.walk.pattern.nmpc_problem import Nmpc
from toddle.walk.pattern.reduced import Reduced, weight_shift

Shares = Callable[[Callable[[int, int], None], int], None]
"""Runs a function of a range on ranges that cover so many walkers; threads do it side by side."""

_GRAIN = 1e-6  # [s]
_BLUR = 1.5e-7  # of a time in single precision, relative
Record = TypeVar("Record", bound=tuple)


class Gated(NamedTuple):
    """Walkers whose commands pass the safety gate.

    Attributes:
        walk: where they are.
        allowed: what the gate let through last: vx, vy [m/s], omega [rad/s].
    """

    walk: BatchWalk
    allowed: Float[np.ndarray, "walkers 3"]


def at_once(part: Callable[[int, int], None], walkers: int) -> None:
    """All walkers in one range."""
    part(0, walkers)


def start_native(problem: Nmpc, walkers: int, dtype: type[np.floating] = np.float64) -> BatchWalk:
    """Walkers that stand, without a last plan."""
    one = Reduced(problem.gait, problem.weights).start().at
    at = stacked([one] * walkers, dtype)
    gait, then = problem.gait, stacked([one] * walkers, dtype)
    feet, jerks = np.zeros((walkers, gait.steps, 3), dtype), np.zeros((walkers, 2, gait.preview), dtype)
    moved, zmp = np.zeros((walkers, gait.steps, 2), dtype), np.zeros((walkers, gait.preview, 2), dtype)
    nothing, no = np.zeros(walkers, dtype), np.zeros(walkers, bool)
    status = np.zeros(walkers, np.int32)
    plan = BatchPlan(feet, moved, jerks, zmp, status, no, nothing, nothing.copy(), no.copy(), then)
    return BatchWalk(at, plan, np.zeros(walkers, dtype))


def step_native(
    problem: Nmpc,
    walk: BatchWalk,
    velocities: Float[np.ndarray, "walkers 3"],
    circles: Float[np.ndarray, "walkers circles 3"] | None = None,
    *,
    hold: int = 1,
    shares: Shares = at_once,
) -> BatchWalk:
    """Some iterations of each, under one command; arguments and answer as in `batch.step_batch`, in NumPy's arrays.

    Args:
        problem: of the gait, the same for all; a landing is held for ``freeze`` of it.
        walk: where they are; its precision is that of the answer. It stays as it is.
        velocities: commanded: vx, vy [m/s], omega [rad/s]; capped to what fits.
        circles: obstacles: x, y, radius [m]; a negative radius for none.
        hold: iterations.
        shares: who runs the walkers.
    """
    return _walked(problem, Gated(walk, velocities), velocities, circles, hold, False, shares).walk


def step_gated(
    problem: Nmpc,
    gated: Gated,
    asked: Float[np.ndarray, "walkers 3"],
    circles: Float[np.ndarray, "walkers circles 3"] | None = None,
    *,
    hold: int = 1,
    shares: Shares = at_once,
) -> Gated:
    """As `step_native`, each iteration's command through the safety gate (`walk.gate.gate`), with a sample between.

    Args:
        problem: of the gait.
        gated: where the walkers are, and what they were allowed last.
        asked: vx, vy [m/s], omega [rad/s]; a number that isn't finite asks to stand.
        circles: obstacles: x, y, radius [m]; a negative radius for none.
        hold: iterations.
        shares: who runs the walkers.
    """
    return _walked(problem, gated, asked, circles, hold, True, shares)


def _walked(
    problem: Nmpc,
    gated: Gated,
    asked: Float[np.ndarray, "walkers 3"],
    circles: Float[np.ndarray, "walkers circles 3"] | None,
    hold: int,
    gates: bool,
    shares: Shares,
) -> Gated:
    walk, allowed = gated.walk, np.array(gated.allowed, float)
    at, plan, shift = _sharp(_doubled(walk.at)), _doubled(walk.plan), _whole(np.array(walk.shift, float))
    plan = plan._replace(state=_sharp(plan.state))
    wanted = np.array(asked, float)
    around = np.full((len(wanted), 0, 3), PADDING) if circles is None else np.array(circles, float)
    stride = stride_of(problem)

    def part(first: int, last: int) -> None:
        walk_on(
            problem.tables, problem.numbers, stride, at, plan, shift, allowed, wanted, around, gates, hold, first, last
        )  # fmt: skip

    shares(part, len(wanted))
    return _as_before(Gated(BatchWalk(at, plan, shift), allowed), gated)


def stride_of(problem: Nmpc) -> Stride:
    """The gait's numbers that the programme has no use for, and the gate's."""
    gait = problem.gait
    return Stride(
        foot_distance=gait.foot_distance,
        freeze=problem.freeze,
        shift=weight_shift(gait),
        ahead=float(gait.fastest.vx),
        aside=float(gait.fastest.vy),
        turning=float(gait.fastest.omega),
        backwards=BACKWARDS * gait.fastest.vx,
        acceleration=ACCELERATION,
        turning_acceleration=TURNING,
    )


def _doubled(record: Record) -> Record:
    """Copies, floats in double precision."""
    copies = [
        _doubled(part)
        if isinstance(part, tuple)
        else np.array(part, float if np.asarray(part).dtype.kind == "f" else None, order="C")
        for part in record
    ]
    return type(record)(*copies)


def _sharp(state: BatchState) -> BatchState:
    """Times to the whole microsecond."""
    phase, remaining, over = map(_whole, (state.phase, state.remaining, state.double_support))
    return state._replace(phase=phase, remaining=remaining, double_support=over)


def _whole(seconds: Float[np.ndarray, " walkers"]) -> Float[np.ndarray, " walkers"]:
    """Times to the whole microsecond, where it is as near as single precision tells."""
    rounded = np.round(seconds / _GRAIN) * _GRAIN
    return np.where(np.abs(seconds - rounded) <= _BLUR * np.maximum(np.abs(seconds), 1.0), rounded, seconds)


def _as_before(record: Record, before: Record) -> Record:
    """In the precision that they came in."""
    cast = [
        _as_before(part, old) if isinstance(part, tuple) else np.asarray(part, np.asarray(old).dtype)
        for part, old in zip(record, before, strict=True)
    ]
    return type(record)(*cast)
