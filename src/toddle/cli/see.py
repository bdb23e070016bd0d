"""``toddle see``: two cameras, calibrated and rectified, and their depth. Each kind of work has a module of its own."""

from __future__ import annotations

import importlib
from collections.abc import Sequence

from toddle.failures import BadInput, unknown_name

WORK = {
    "calibrate": "two cameras, from pictures of a chessboard",
    "rectify": "a pair of pictures: the same thing in the same row of both",
    "depth": "how far everything is, from a pair of pictures or two folders",
}

_PROG = "toddle see"
_EXAMPLES = """\
  toddle see calibrate left/ right/                cameras from two folders of chessboard pictures
  toddle see rectify l.png r.png --cameras left.yaml
  toddle see depth l.png r.png --cameras left.yaml --stages"""


def main(argv: Sequence[str]) -> int:
    """Do one kind of work, and return the exit code."""
    if not argv:
        raise BadInput("say what is to be done", where=_PROG, remedy=f"one of {', '.join(WORK)}; --help tells more")
    if argv[0] in ("-h", "--help"):
        print(_help())
        return 0
    if argv[0] not in WORK:
        raise unknown_name("work", argv[0], WORK, where=_PROG)
    return importlib.import_module(f"toddle.cli.see_{argv[0]}").main(argv[1:])


def _help() -> str:
    works = "\n".join(f"  {name:<12}{what}" for name, what in WORK.items())
    return (
        "See: two cameras, calibrated and rectified, and the depth they tell.\n\n"
        f"usage: {_PROG} WORK ...       ({_PROG} WORK --help tells more)\n\n{works}\n\n{_EXAMPLES}"
    )
