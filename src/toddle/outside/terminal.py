"""The terminal: a live progress bar where a person looks, plain lines elsewhere, and a stop that loses nothing.

Everything here goes to standard error; standard output belongs to results.
"""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import FrameType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

_PLAIN_SECONDS = 2.0


class Reporter:
    """Tells how far a run has come: a bar on a terminal, a line every two seconds elsewhere."""

    def __init__(self, what: str, total: int, *, quiet: bool = False) -> None:
        self._what, self._total, self._quiet = what, total, quiet
        self._console = Console(stderr=True)
        self._bar: Progress | None = None
        self._last_line = 0.0

    def __enter__(self) -> Reporter:
        if self._console.is_terminal and not self._quiet:
            columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
            self._bar = Progress(
                *columns, TimeRemainingColumn(), TextColumn("{task.fields[news]}"), console=self._console
            )
            self._bar.start()
            self._task = self._bar.add_task(self._what, total=self._total, news="")
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def tell(self, done: int, news: str) -> None:
        """So much is done, and this is new ("error 31 mm")."""
        if self._quiet:
            return
        if self._bar is not None:
            self._bar.update(self._task, completed=done, news=news)
        elif time.monotonic() - self._last_line > _PLAIN_SECONDS or done >= self._total:
            self._last_line = time.monotonic()
            print(f"{self._what}: {done} of {self._total}, {news}", file=sys.stderr, flush=True)


class Stop:
    """Whether somebody asked to stop."""

    asked = False


@contextmanager
def stoppable() -> Iterator[Stop]:
    """Turn the first Ctrl-C into a request that the work looks at when it can; the second one interrupts at once."""
    stop = Stop()
    before = signal.getsignal(signal.SIGINT)

    def ask(_number: int, _frame: FrameType | None) -> None:
        stop.asked = True
        signal.signal(signal.SIGINT, signal.default_int_handler)

    signal.signal(signal.SIGINT, ask)
    try:
        yield stop
    finally:
        signal.signal(signal.SIGINT, before)


def print_table(title: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """A table on standard output: ruled on a terminal, aligned plain columns elsewhere."""
    console = Console()
    if console.is_terminal:
        table = Table(*head, title=title, title_justify="left")
        for column in table.columns[1:]:
            column.justify = "right"
        for row in rows:
            table.add_row(*row)
        console.print(table)
        return
    widths = [max(len(row[i]) for row in (head, *rows)) for i in range(len(head))]
    print(title)
    for row in (head, *rows):
        first, *rest = (
            cell.ljust(width) if i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        print("  ".join((first, *rest)).rstrip())
