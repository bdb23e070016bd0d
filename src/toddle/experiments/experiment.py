"""What an experiment is: it is given a task, and gives back its figures beside the document's, and a verdict."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Task:
    """What an experiment is asked to do.

    Attributes:
        full: as the document did; else in under a minute.
        seed: of all randomness.
        seeds: how many runs of each kind; None: the experiment's own number.
        folder: where its pictures go.
        tell: called with how much is done (0 to 1) and what is new.
        stopped: whether somebody asked to stop; what is there is then evaluated.
        data: a folder with files of the document's author, to be set beside ours; None: they are left out.
    """

    full: bool
    seed: int
    seeds: int | None
    folder: Path
    tell: Callable[[float, str], None]
    stopped: Callable[[], bool]
    data: Path | None = None

    def part(self, begins: float, ends: float) -> Task:
        """The same task for a part of the work, which lies between these shares of the whole."""
        return replace(self, tell=lambda done, news: self.tell(begins + done * (ends - begins), news))


@dataclass(frozen=True)
class Row:
    """One figure, ours beside the document's.

    Attributes:
        what: the figure.
        ours: what we measured; None: nothing, because somebody stopped us.
        document: what the document prints; None: nothing.
        unit: of both.
    """

    what: str
    ours: float | None
    document: float | None = None
    unit: str = ""


@dataclass(frozen=True)
class Outcome:
    """What an experiment found.

    Attributes:
        rows: the figures to print.
        verdict: one sentence.
        holds: whether the document's claim was reproduced.
        parameters: the dataclass it ran with.
        figures: everything measured, for the JSON file.
    """

    rows: tuple[Row, ...]
    verdict: str
    holds: bool
    parameters: Any
    figures: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Experiment:
    """A table or figure of a document, to be made again.

    Attributes:
        name: on the command line.
        reproduces: which tables and figures of which document.
        run: does it.
    """

    name: str
    reproduces: str
    run: Callable[[Task], Outcome]
