"""The command line: ``toddle COMMAND ...``.

Only this file is imported to answer ``toddle --help``; each command's module, and with it JAX and MuJoCo, is
imported when the command is called. Here, and only here, a failure becomes a line and an exit code.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Sequence

from toddle.failures import ToddleError, unknown_name
from toddle.outside.compile_cache import use_compile_cache

_LOOPS = """\
 the control loop                                  the learning loop

 command --> pattern --> posture --> robot         explore --> body --> learn --> solve --> evaluate
    ^                                  |              ^                   |          |
    +----- decide <---- see <----- senses             +-------------------+----------+
                                                   what was learned steers what is tried next"""

COMMANDS = {
    "reach": "an arm learns to reach, and is asked to",
    "walk": "a humanoid walks, by itself or under your keys",
    "navigate": "the humanoid learns to find its way",
    "see": "two cameras: calibrated, rectified, and how far everything is",
    "experiment": "a document's table or figure, ours beside theirs",
    "doctor": "what this machine has, and lacks",
}

_EXAMPLES = """\
  toddle reach nicu                                a humanoid's arm learns, live
  toddle reach my/arm.urdf --tip hand              your own robot
  toddle walk                                      a humanoid walks, in physics
  toddle walk --keys                               drive it from the terminal
  toddle navigate ppo                              it learns to walk to goals
  toddle doctor                                    is everything here?"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns:
        The exit code: 0 done, 1 it failed or its verdict is no, 2 the call was wrong, 130 interrupted.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    try:
        exit_code = _dispatch(words)
        sys.stdout.flush()
        return exit_code
    except ToddleError as failure:
        return _tell(failure.line, failure.exit_code)
    except KeyboardInterrupt:
        return _tell("interrupted", 130)
    except BrokenPipeError:
        _silence_stdout()
        return 1
    except OSError as fault:
        return _tell(f"{fault.filename or 'the system'}: {fault.strerror or fault}", 1)
    except Exception as fault:
        if os.environ.get("TODDLE_DEBUG"):
            raise
        what = " ".join(f"{type(fault).__name__}: {fault}".split())
        remedy = "this is a fault of toddle: run again with TODDLE_DEBUG=1 for the traceback"
        return _tell(f"{what}; {remedy}", 1)


def _dispatch(words: list[str]) -> int:
    """Answer the first word: an option of toddle itself, or a command's name."""
    if not words or words[0] in ("-h", "--help", "help"):
        print(_help())
        return 0
    if words[0] in ("-V", "--version"):
        from importlib.metadata import version

        print(f"toddle {version('toddle')}")
        return 0
    if words[0].startswith("-"):
        raise unknown_name("option", words[0], ["--help", "--version"])
    if words[0] not in COMMANDS:
        raise unknown_name("command", words[0], COMMANDS)
    use_compile_cache()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # for matrices as small as these a second thread only waits
    return importlib.import_module(f"toddle.cli.{words[0]}").main(words[1:])


def _help() -> str:
    commands = "\n".join(f"  {name:<12}{what}" for name, what in COMMANDS.items())
    return (
        f"toddle: a robot that learns to reach and to walk\n\n{_LOOPS}\n\n"
        f"usage: toddle COMMAND ...       (toddle COMMAND --help tells more)\n\n{commands}\n\n{_EXAMPLES}"
    )


def _tell(line: str, exit_code: int) -> int:
    """One line on standard error; control characters of a file's or a name's own don't reach the terminal."""
    shown = "".join(c if c.isprintable() else c.encode("unicode_escape", "backslashreplace").decode() for c in line)
    print(f"toddle: {shown}", file=sys.stderr)
    return exit_code


def _silence_stdout() -> None:
    """Whoever read us has gone: keep the interpreter from complaining when it flushes at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
