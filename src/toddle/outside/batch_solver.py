"""A batch of walkers on the cores of this machine: each process takes a share of them through `batch_daqp`.

Processes, not threads: most of a walker's iteration is Python's and holds its lock.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any

import numpy as np
from jaxtyping import Float

from toddle.robots.gait import Gait
from toddle.walk.pattern.batch_daqp import plan_each
from toddle.walk.pattern.batch_state import BatchPlan, BatchState
from toddle.walk.pattern.nmpc import nmpc
from toddle.walk.pattern.nmpc_problem import Nmpc, Weights

_own: list[Nmpc] = []  # of a worker process


@dataclass(frozen=True)
class Cores:
    """Processes that wait for work. Made by `cores`.

    Attributes:
        pool: of the processes.
        count: how many.
    """

    pool: ProcessPoolExecutor
    count: int

    def plan(
        self,
        states: BatchState,
        velocities: Float[np.ndarray, "walkers 3"],
        circles: Float[np.ndarray, "walkers circles 3"] | None = None,
        last: BatchPlan | None = None,
    ) -> BatchPlan:
        """One iteration of each walker; arguments as in `batch_daqp.plan_each`."""
        given = (states, velocities, circles, last)
        shares = np.array_split(np.arange(len(velocities)), min(self.count, len(velocities)))
        parts = list(self.pool.map(_share, [_taken(given, share) for share in shares]))
        return _joined(parts)


@contextmanager
def cores(problem: Nmpc, count: int | None = None) -> Iterator[Cores]:
    """Starts processes, which end with the block.

    Args:
        problem: of the gait, the same for all walkers.
        count: of processes; None: one for each core.
    """
    count = count or len(os.sched_getaffinity(0))
    made = (problem.gait, problem.weights, problem.freeze, problem.numbers.body)
    with ProcessPoolExecutor(count, get_context("spawn"), _begin, made) as pool:
        yield Cores(pool, count)


def _begin(gait: Gait, weights: Weights, freeze: float, body: float) -> None:
    _own[:] = [nmpc(gait, weights, freeze=freeze, body=body)]


def _share(given: tuple[Any, ...]) -> BatchPlan:
    return plan_each(_own[0], *given)


def _taken(part: Any, share: np.ndarray) -> Any:
    """The share of each array in a record."""
    if part is None:
        return None
    if isinstance(part, tuple):
        taken = [_taken(one, share) for one in part]
        return type(part)(*taken) if hasattr(part, "_fields") else tuple(taken)
    return np.asarray(part)[share]


def _joined(parts: list[Any]) -> Any:
    """The arrays of records of one kind, one after the other."""
    if isinstance(parts[0], tuple):
        return type(parts[0])(*(_joined(list(column)) for column in zip(*parts, strict=True)))
    return np.concatenate(parts)
