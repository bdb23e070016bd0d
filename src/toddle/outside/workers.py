"""Many tasks on the cores of this machine; each process makes a worker of its own and keeps it between tasks."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from typing import Any, TypeVar

from toddle.failures import ToddleError
from toddle.outside.orphans import end_with_parent

Task = TypeVar("Task")
Result = TypeVar("Result")

_PATIENCE = 0.1  # between two looks whether to stop [s]


def shared(
    make: Callable[..., Callable[[Task], Result]],
    given: tuple[Any, ...],
    tasks: Sequence[Task],
    *,
    processes: int | None = None,
    stopped: Callable[[], bool] = lambda: False,
) -> Iterator[tuple[int, Result]]:
    """Every task once: its number and its result, as they end.

    Args:
        make: a class or function of a module, called in each process as ``make(*given)`` when its first task comes.
        given: what can be sent to a process, as the tasks and results can.
        tasks: what each worker is called with.
        processes: how many; None: one for each core; 1: this one alone.
        stopped: asked now and then; once it says so no further task begins, and those under way end.

    Raises:
        ToddleError: a process was killed; or whatever a worker raises.
    """
    count = min(processes or len(os.sched_getaffinity(0)), len(tasks))
    if count > 1:
        yield from _on_processes(make, given, tasks, count, stopped)
        return
    worker: Callable[[Task], Result] | None = None
    for number, task in enumerate(tasks):
        if stopped():
            return
        worker = worker or make(*given)
        yield number, worker(task)


def _on_processes(
    make: Callable[..., Callable[[Task], Result]],
    given: tuple[Any, ...],
    tasks: Sequence[Task],
    count: int,
    stopped: Callable[[], bool],
) -> Iterator[tuple[int, Result]]:
    left = list(reversed(list(enumerate(tasks))))
    with ProcessPoolExecutor(count, get_context("spawn"), _begin, (make, given)) as pool:
        try:
            waiting: dict[Future[Result], int] = {}
            while waiting or (left and not stopped()):
                while left and len(waiting) < count and not stopped():
                    number, task = left.pop()
                    waiting[pool.submit(_one, task)] = number
                done, _ = wait(waiting, timeout=_PATIENCE, return_when=FIRST_COMPLETED)
                for future in done:
                    yield waiting.pop(future), future.result()
        except BrokenProcessPool:
            raise ToddleError("a process was killed", where="workers", remedy="is there memory enough?") from None


_told: list[tuple[Callable[..., Callable[[Any], Any]], tuple[Any, ...]]] = []  # a process was told
_own: list[Callable[[Any], Any]] = []  # and made of it


def _begin(make: Callable[..., Callable[[Any], Any]], given: tuple[Any, ...]) -> None:
    _ = signal.signal(signal.SIGINT, signal.SIG_IGN)  # who started the processes hears it, and asks them to stop
    end_with_parent()
    _told.append((make, given))


def _one(task: Any) -> Any:
    if not _own:
        make, given = _told[0]
        _own.append(make(*given))
    return _own[0](task)
