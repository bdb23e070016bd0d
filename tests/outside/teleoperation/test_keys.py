"""Driving from the terminal, with a real pseudo-terminal: keys, a lost terminal, and that it is always restored."""

from __future__ import annotations

import contextlib
import os
import pty
import select
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.failures import BadInput
from toddle.outside.teleoperation.keys import LOST, QUIT, TOLD, Keyboard, keys_in, pressed
from toddle.signals import STILL, Velocity

FASTEST = Velocity(0.3, 0.1, 0.3)


class Clock:
    """A clock that stands still until it is set."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[int, int]]:
    """Both ends of a pseudo-terminal; standard input is one of them."""
    master, slave = pty.openpty()
    with os.fdopen(os.dup(slave), "rb", buffering=0) as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        yield master, slave
    for end in (master, slave):
        with contextlib.suppress(OSError):  # the test may have closed it
            os.close(end)


def test_every_key_does_what_the_help_says() -> None:
    says = {
        b"w": Velocity(0.05, 0, 0), b"\x1b[A": Velocity(0.05, 0, 0), b"s": Velocity(-0.05, 0, 0),
        b"\x1bOB": Velocity(-0.05, 0, 0), b"a": Velocity(0, 0, 0.1), b"\x1b[D": Velocity(0, 0, 0.1),
        b"d": Velocity(0, 0, -0.1), b"\x1b[C": Velocity(0, 0, -0.1), b",": Velocity(0, 0.02, 0),
        b".": Velocity(0, -0.02, 0), b"W": Velocity(0.05, 0, 0), b"x": STILL,
    }  # fmt: skip
    for typed, velocity in says.items():
        keys, rest = keys_in(typed)
        assert rest == b""
        now = STILL
        for key in keys:
            now = pressed(now, key, FASTEST)
        assert now == pytest.approx(velocity), typed
    assert pressed(Velocity(0.1, 0.04, 0.2), "stop", FASTEST) == STILL
    assert pressed(Velocity(0.1, 0.04, 0.2), "faster", FASTEST) == pytest.approx((0.125, 0.05, 0.25))
    assert pressed(Velocity(0.1, 0.04, 0.2), "slower", FASTEST) == pytest.approx((0.08, 0.032, 0.16))


@given(st.lists(st.sampled_from(["up", "down", "left", "right", "aside left", "aside right", "faster", "slower"])))
def test_no_keys_ask_for_more_than_the_fastest(keys: list[str]) -> None:
    velocity = STILL
    for key in keys:
        velocity = pressed(velocity, key, FASTEST)
        assert all(abs(part) <= most for part, most in zip(velocity, FASTEST, strict=True))


@given(st.binary(max_size=40), st.integers(0, 40))
def test_keys_are_the_same_however_the_bytes_arrive(typed: bytes, cut: int) -> None:
    whole, rest = keys_in(typed)
    first, pending = keys_in(typed[:cut])
    second, last = keys_in(pending + typed[cut:])
    if len(rest) < 16 and len(pending) < 16:  # a longer beginning is cut short
        assert (first + second, last) == (whole, rest)


@given(st.binary(max_size=20))
def test_whatever_was_typed_before_two_spaces_and_quits_are_heard(typed: bytes) -> None:
    keys, _ = keys_in(typed + b"  qq")
    assert "stop" in keys
    assert "quit" in keys


def test_half_an_arrow_is_waited_for(terminal: tuple[int, int]) -> None:
    with Keyboard(FASTEST, clock=Clock()) as keyboard:
        os.write(terminal[0], b"\x1b")
        assert keyboard(0.0) == STILL
        os.write(terminal[0], b"[Aw")
        assert keyboard(0.01) == Velocity(0.1, 0.0, 0.0)


def test_space_stops_and_q_ends(terminal: tuple[int, int]) -> None:
    with Keyboard(FASTEST, clock=Clock()) as keyboard:
        os.write(terminal[0], b"wwa")
        assert keyboard(0.0) == Velocity(0.1, 0.0, 0.1)
        assert keyboard(5.0) == Velocity(0.1, 0.0, 0.1)
        os.write(terminal[0], b" ")
        assert keyboard(6.0) == STILL
        os.write(terminal[0], b"wq")
        assert keyboard(7.0) is None
        assert keyboard(8.0) is None
        assert keyboard.ended == QUIT


def test_a_process_that_stood_still_finds_the_robot_standing(terminal: tuple[int, int]) -> None:
    clock = Clock()
    with Keyboard(FASTEST, clock=clock) as keyboard:
        os.write(terminal[0], b"ww")
        clock.now = 0.4
        assert keyboard(0.0) == Velocity(0.1, 0.0, 0.0)
        clock.now = 0.8
        assert keyboard(0.1) == Velocity(0.1, 0.0, 0.0)
        clock.now = 1.4
        assert keyboard(0.2) == STILL


def test_the_terminal_is_as_it_was(terminal: tuple[int, int]) -> None:
    before = termios.tcgetattr(terminal[1])
    handlers = [signal.getsignal(number) for number in (signal.SIGHUP, signal.SIGTERM)]
    with contextlib.suppress(ZeroDivisionError), Keyboard(FASTEST):
        changed = termios.tcgetattr(terminal[1])
        assert not changed[3] & (termios.ICANON | termios.ECHO)
        assert changed[3] & termios.ISIG  # Ctrl-C interrupts
        assert changed[6][termios.VSUSP] == b"\0"
        raise ZeroDivisionError
    assert termios.tcgetattr(terminal[1]) == before
    assert [signal.getsignal(number) for number in (signal.SIGHUP, signal.SIGTERM)] == handlers


def test_a_terminal_that_is_closed_ends_it(terminal: tuple[int, int]) -> None:
    with Keyboard(FASTEST) as keyboard:
        os.write(terminal[0], b"w")
        assert keyboard(0.0) is not None
        os.close(terminal[0])
        assert keyboard(0.1) is None
        assert keyboard.ended == LOST


def test_without_a_terminal_it_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with open(os.devnull) as nothing:
        monkeypatch.setattr(sys, "stdin", nothing)
        with pytest.raises(BadInput, match="standard input is no terminal"), Keyboard(FASTEST):
            pass


DRIVER = """
import sys, time
from toddle.outside.teleoperation.keys import Keyboard
from toddle.outside.teleoperation.panel import Panel, Status
from toddle.signals import Velocity
with Keyboard(Velocity(.3, .1, .3)) as keyboard, Panel("robot", "keys") as panel:
    print("ready", flush=True)
    began = time.monotonic()
    while (velocity := keyboard(0.0)) is not None and time.monotonic() - began < 20:
        panel.tell(Status(1.0, velocity, velocity, velocity, 0.02, 0, "solved", 1.0, 0.5))
        time.sleep(0.01)
open(sys.argv[1], "w").write(keyboard.ended)
"""


def _driven(path: object) -> tuple[subprocess.Popen[bytes], int, int]:
    """A driver in a session of its own, whose terminal is a pseudo-terminal."""
    master, slave = pty.openpty()
    code = "import fcntl, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0)\n" + DRIVER
    child = subprocess.Popen(
        [sys.executable, "-c", code, str(path)], stdin=slave, stdout=slave, stderr=slave, start_new_session=True
    )
    heard = b""
    while b"ready" not in heard:
        heard += os.read(master, 1000)
    return child, master, slave


@pytest.mark.parametrize("ending", ["hangup", "term", "quit"])
def test_a_driver_ends_well_however_it_ends(tmp_path: object, ending: str) -> None:
    path = f"{tmp_path}/ended"
    child, master, slave = _driven(path)
    before = termios.tcgetattr(slave)
    if ending == "hangup":
        os.close(slave)
        os.close(master)  # the kernel sends SIGHUP, and every write to it is a fault
    elif ending == "term":
        child.send_signal(signal.SIGTERM)
    else:
        os.write(master, b"q")
    if ending != "hangup":
        deadline = time.monotonic() + 10
        while child.poll() is None and time.monotonic() < deadline:
            if select.select([master], [], [], 0.1)[0]:
                _ = os.read(master, 4096)  # who writes to a terminal waits until it is read
    assert child.wait(timeout=10) == 0
    with open(path) as file:
        assert file.read() == {"hangup": LOST, "term": TOLD, "quit": QUIT}[ending]
    if ending != "hangup":
        after = termios.tcgetattr(slave)
        assert before[3] & termios.ICANON == 0
        assert after[3] & termios.ICANON
        assert after[3] & termios.ECHO
        os.close(slave)
        os.close(master)
