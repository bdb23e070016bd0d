"""``toddle navigate``: learn to find the way, and judge who does. Each kind of work has a module of its own."""

from __future__ import annotations

import importlib
from collections.abc import Sequence

from toddle.failures import BadInput, unknown_name

WORK = {
    "ppo": "a policy learns by trial and error, on top of the walker or on any Gymnasium environment",
    "record": "the expert, a person or a network drives through rooms, and it is kept as a dataset",
    "clone": "a network learns to drive by what it sees, from drives that it watches",
    "evaluate": "a policy, a script or a person steers the robot in physics, and is judged",
    "export": "a policy as a file that answers without toddle",
}

_PROG = "toddle navigate"
_EXAMPLES = """\
  toddle navigate ppo                              the humanoid learns to walk to goals, its real pattern in the loop
  toddle navigate ppo obstacles                    and around obstacles
  toddle navigate ppo point                        the document's benchmark, in seconds
  toddle navigate ppo --env Pendulum-v1            any Gymnasium environment
  toddle navigate evaluate --policy runs/goal      judge what was learned, in physics
  toddle walk --policy runs/goal --goal -1 2       watch it walk there
  toddle navigate record --driver person           drive it yourself, and see what it sees"""


def main(argv: Sequence[str]) -> int:
    """Do one kind of work, and return the exit code."""
    if not argv:
        raise BadInput("say what is to be done", where=_PROG, remedy=f"one of {', '.join(WORK)}; --help tells more")
    if argv[0] in ("-h", "--help"):
        print(_help())
        return 0
    if argv[0] not in WORK:
        raise unknown_name("work", argv[0], WORK, where=_PROG)
    return importlib.import_module(f"toddle.cli.navigate_{argv[0]}").main(argv[1:])


def _help() -> str:
    works = "\n".join(f"  {name:<12}{what}" for name, what in WORK.items())
    return (
        "Find the way: from senses to a velocity.\n\n"
        f"usage: {_PROG} WORK ...       ({_PROG} WORK --help tells more)\n\n{works}\n\n{_EXAMPLES}"
    )
