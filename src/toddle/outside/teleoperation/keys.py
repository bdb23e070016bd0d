"""Driving from the terminal: keys change the velocity; losing the terminal stops the robot.

The terminal is switched so that each key is heard at once, and is switched back whatever happens. A velocity holds
until the next key. Whoever lets this process stand still for longer than the dead-man's timeout (it was suspended,
the machine hangs) finds the robot standing.
"""

from __future__ import annotations

import contextlib
import os
import re
import select
import signal
import sys
import termios
import time
import tty
from collections.abc import Callable
from types import FrameType
from typing import Any

from toddle.failures import BadInput
from toddle.signals import STILL, Velocity
from toddle.walk.gate import SILENCE

HELP = """\
up, down or w, s      faster, slower      left, right or a, d   turn
, and .               sideways            + and -               all of it more, less
space                 stop                q                     quit"""
"""What a person needs to know."""

QUIT, LOST, TOLD = "quit", "the terminal is lost", "told to end"
"""How driving ends."""

_STEP = Velocity(0.05, 0.02, 0.1)
_FASTER = 1.25
_KEYS = {
    b"\x1b[A": "up", b"\x1b[B": "down", b"\x1b[C": "right", b"\x1b[D": "left",
    b"\x1bOA": "up", b"\x1bOB": "down", b"\x1bOC": "right", b"\x1bOD": "left",
    b"w": "up", b"s": "down", b"a": "left", b"d": "right", b",": "aside left", b".": "aside right",
    b"+": "faster", b"=": "faster", b"-": "slower", b"_": "slower", b" ": "stop", b"q": "quit",
    b"\x03": "quit", b"\x04": "quit",
}  # fmt: skip
_CHANGES = {
    "up": Velocity(1.0, 0.0, 0.0), "down": Velocity(-1.0, 0.0, 0.0),
    "left": Velocity(0.0, 0.0, 1.0), "right": Velocity(0.0, 0.0, -1.0),
    "aside left": Velocity(0.0, 1.0, 0.0), "aside right": Velocity(0.0, -1.0, 0.0),
}  # fmt: skip
_SEQUENCE = re.compile(
    rb"\x1b\[[0-9;]*[@-~] | \x1bO[@-~] | [^\x1b]"
    rb"| \x1b(?= [^\[O] | \[[0-9;]*[^0-9;@-~] | O[^@-~])",  # an escape that begins nothing: what follows counts
    re.DOTALL | re.VERBOSE,
)


def keys_in(heard: bytes) -> tuple[tuple[str, ...], bytes]:
    """The keys that bytes from a terminal stand for, and the beginning of one that isn't whole yet."""
    keys, place = [], 0
    while found := _SEQUENCE.match(heard, place):
        place = found.end()
        name = _KEYS.get(found[0].lower() if len(found[0]) == 1 else found[0])
        if name is not None:
            keys.append(name)
    return tuple(keys), heard[place:][:16]


def pressed(velocity: Velocity, key: str, fastest: Velocity) -> Velocity:
    """The velocity after one key, never above the fastest [m/s, m/s, rad/s]."""
    if key == "stop":
        return STILL
    if key in ("faster", "slower"):
        factor = _FASTER if key == "faster" else 1 / _FASTER
        wanted = [factor * part for part in velocity]
    elif key in _CHANGES:
        wanted = [part + change * step for part, change, step in zip(velocity, _CHANGES[key], _STEP, strict=True)]
    else:
        return velocity
    within = (min(max(part, -most), most) for part, most in zip(wanted, fastest, strict=True))
    return Velocity(*(round(part, 6) for part in within))  # five steps up and five down end at nought


class Keyboard:
    """A command source behind a terminal; within ``with``, each key is heard at once.

    Attributes:
        velocity: what was asked last.
        ended: why it ended: `QUIT`, `LOST`, `TOLD` by a signal, or nothing yet.
    """

    def __init__(self, fastest: Velocity, *, clock: Callable[[], float] = time.monotonic) -> None:
        self.velocity, self.ended = STILL, ""
        self._fastest, self._clock, self._pending = fastest, clock, b""
        self._heard = clock()

    def __enter__(self) -> Keyboard:
        try:
            self._terminal = sys.stdin.fileno()
            self._before = termios.tcgetattr(self._terminal)
        except (AttributeError, OSError, ValueError, termios.error):
            raise BadInput("standard input is no terminal", where="--keys", remedy="run it in a terminal") from None
        self._screens = [number for number in (1, 2) if os.isatty(number)]
        self._handlers = {number: signal.signal(number, self._signalled) for number in (signal.SIGHUP, signal.SIGTERM)}
        _listen(self._terminal)
        self._heard = self._clock()
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(OSError, termios.error):  # it may be gone
            termios.tcsetattr(self._terminal, termios.TCSAFLUSH, self._before)
        for number, handler in self._handlers.items():
            signal.signal(number, handler)

    def __call__(self, t: float) -> Velocity | None:
        """What the keys ask for now; None once they ended."""
        now = self._clock()
        if now - self._heard > SILENCE:
            self.velocity = STILL
        self._heard = now
        for key in self._read():
            if key == "quit":
                self.ended = self.ended or QUIT
            self.velocity = pressed(self.velocity, key, self._fastest)
        return None if self.ended else self.velocity

    def _read(self) -> tuple[str, ...]:
        """The keys since the last time; a terminal that answers with an end or a fault is lost."""
        if self.ended:
            return ()
        try:
            if not select.select([self._terminal], [], [], 0)[0]:
                return ()
            heard = os.read(self._terminal, 1024)
        except OSError:
            heard = b""
        if not heard:
            self._lose()
            return ()
        keys, self._pending = keys_in(self._pending + heard)
        return keys

    def _signalled(self, number: int, _frame: FrameType | None) -> None:
        if number == signal.SIGHUP:
            self._lose()
        self.ended = self.ended or TOLD

    def _lose(self) -> None:
        """End, and write no more to a terminal that is gone: each write would be a fault."""
        self.ended = self.ended or LOST
        nowhere = os.open(os.devnull, os.O_WRONLY)
        for number in self._screens:
            os.dup2(nowhere, number)
        os.close(nowhere)


def _listen(terminal: int) -> None:
    """Each key at once and unseen; Ctrl-C still interrupts, Ctrl-Z and Ctrl-\\ don't leave the terminal so."""
    tty.setcbreak(terminal, termios.TCSAFLUSH)
    settings: list[Any] = termios.tcgetattr(terminal)
    settings[6][termios.VSUSP] = settings[6][termios.VQUIT] = b"\0"
    termios.tcsetattr(terminal, termios.TCSANOW, settings)
