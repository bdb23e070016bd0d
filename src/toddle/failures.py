"""Our exceptions: each says what is wrong, where, and the remedy, in one line a person can act on.

Only the edge (``cli``) turns them into an exit code: `BadInput` is 2 (the call was wrong), every other
`ToddleError` is 1 (the run failed).
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class ToddleError(Exception):
    """What went wrong, where (file, element, argument), and what mends it."""

    exit_code = 1

    def __init__(self, what: str, *, where: str = "", remedy: str = "") -> None:
        self.what, self.where, self.remedy = what, where, remedy
        super().__init__(self.line)

    @property
    def line(self) -> str:
        """The whole message on one line: ``where: what; remedy``."""
        head = f"{self.where}: {self.what}" if self.where else self.what
        return " ".join((f"{head}; {self.remedy}" if self.remedy else head).split())


class BadInput(ToddleError):
    """A file, an argument or a target that cannot be used as it is."""

    exit_code = 2


class MissingExtra(BadInput):
    """A part of toddle that needs a package which is not installed."""

    def __init__(self, package: str, extra: str, *, what_for: str) -> None:
        super().__init__(
            f"{what_for} needs the package {package}, which is not installed",
            remedy=f"install it with: pip install 'toddle[{extra}]'",
        )


def unknown_name(kind: str, name: str, known: Iterable[str], *, where: str = "") -> BadInput:
    """A wrong name, answered with the nearest right ones.

    Args:
        kind: what was looked for ("robot", "link", "method").
        name: the name that is not there.
        known: the names that are.
        where: the file or argument it was looked for in.
    """
    names = sorted(known)
    near = difflib.get_close_matches(name, names, n=3, cutoff=0.5)
    if near:
        remedy = "did you mean " + " or ".join(near) + "?"
    else:
        shown = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
        remedy = f"known: {shown}" if names else "there is none"
    return BadInput(f"no {kind} named {name!r}", where=where, remedy=remedy)
