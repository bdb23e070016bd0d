"""A person who sees what the robot sees: the picture on the terminal, the bars below it, real time, the keys."""

from __future__ import annotations

import io
import re
import sys
from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.failures import BadInput
from toddle.navigate.driver import Driver, Situation
from toddle.navigate.sight import COLUMNS, PERIOD, ROWS, Sight
from toddle.outside.teleoperation.keys import Keyboard
from toddle.outside.teleoperation.person import Person
from toddle.outside.teleoperation.seen import Seen, blocks, nearest, nearness
from toddle.signals import STILL, Velocity

FASTEST = Velocity(0.3, 0.1, 0.3)


def painted(lines: list[str]) -> np.ndarray:
    """What a terminal that knows 24-bit colours makes of lines of half blocks."""
    rows = []
    for line in lines:
        upper, lower = [], []
        front = back = (0, 0, 0)
        for code, colour, block in re.findall(r"\x1b\[([34]8);2;([\d;]+)m|(▀)", line):
            if block:
                upper.append(front)
                lower.append(back)
            elif code == "38":
                front = tuple(map(int, colour.split(";")))
            else:
                back = tuple(map(int, colour.split(";")))
        rows += [upper, lower]
    return np.array(rows, np.uint8)


@given(seed=st.integers(0, 99), flat=st.booleans())
def test_a_terminal_shows_every_pixel(seed: int, flat: bool) -> None:
    picture = np.random.default_rng(seed).integers(0, 2 if flat else 256, (6, 8, 3)).astype(np.uint8)
    assert np.array_equal(painted(blocks(picture, full=True)), picture)


def test_a_terminal_of_256_colours_shows_the_nearest_of_its_cube() -> None:
    picture = np.array([[[255, 0, 0], [10, 10, 10]], [[0, 255, 255], [128, 128, 128]]], np.uint8)
    assert blocks(picture, full=False) == ["\x1b[38;5;196m\x1b[48;5;51m▀\x1b[38;5;16m\x1b[48;5;145m▀\x1b[0m"]


@given(st.integers(0, 99))
def test_the_nearest_tenth_is_that_of_numpy(seed: int) -> None:
    draw = np.random.default_rng(seed)
    depth = np.where(draw.random((60, 80)) < 0.4, 0.0, draw.uniform(0.3, 6.0, (60, 80))).astype(np.float32)
    depth[:, 5] = 0.0
    found = nearest(depth)
    for column in range(80):
        known = depth[8:34, column][depth[8:34, column] > 0].astype(float)
        if len(known):
            assert found[column] == np.percentile(known, 10, method="inverted_cdf")
        else:
            assert np.isnan(found[column])


def test_what_is_near_has_a_high_bar() -> None:
    depth = np.zeros((60, 80), np.float32)
    depth[:, :20], depth[:, 20:40], depth[:, 40:60] = 0.4, 1.75, 9.0
    assert nearness(depth) == "█" * 20 + "▄" * 20 + " " * 20 + "·" * 20


def test_the_screen_is_left_as_it_was(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    sight = Sight(np.zeros((ROWS, COLUMNS, 3), np.uint8), np.ones((ROWS, COLUMNS), np.float32))
    with Seen(full=True) as seen:
        seen.show(sight, ("hello", "you"))
    said = capsys.readouterr().err
    assert said.startswith("\x1b[?1049h\x1b[?25l")
    assert said.endswith("\x1b[?25h\x1b[?1049l")
    assert "hello" in said
    gone = io.StringIO()
    gone.close()
    monkeypatch.setattr(sys, "stderr", gone)
    seen.show(sight, ("the terminal is gone",))


@dataclass
class Clock:
    """Time that passes only when somebody waits, or when it is told to."""

    now: float = 100.0
    waits: list[float] = field(default_factory=list)

    def __call__(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.waits.append(seconds)
        self.now += seconds


def driven(clock: Clock, steps: list[float]) -> list[float]:
    """The clock at each look of a person, who needs a while for each, besides waiting."""
    keyboard = Keyboard(FASTEST, clock=clock)
    person = Person(keyboard, Seen(full=False), "Walk.", clock.sleep, clock)
    assert isinstance(person, Driver)
    memory, times = person.start(), []
    sight = Sight(np.zeros((ROWS, COLUMNS, 3), np.uint8), np.zeros((ROWS, COLUMNS), np.float32))
    keyboard._read = lambda: ()  # nobody presses a key
    for number, seconds in enumerate(steps):
        situation = Situation(number * PERIOD, np.zeros(3), (1.0, 0.0), STILL, sight=sight)
        velocity, memory = person.decide(memory, situation)
        assert velocity == STILL
        times.append(clock.now)
        clock.now += seconds
    return times


def test_the_robot_keeps_to_the_clock() -> None:
    times = driven(Clock(), [0.05, 0.1, 0.0, 0.15, 0.05])
    assert np.diff(times) == pytest.approx([PERIOD] * 4)


def test_what_was_late_is_not_made_up_for() -> None:
    times = driven(Clock(), [0.05, 0.9, 0.05, 0.05])
    assert np.diff(times) == pytest.approx([PERIOD, 0.9, PERIOD])


def test_without_eyes_nobody_can_drive() -> None:
    person = Person(Keyboard(FASTEST), Seen(), "Walk.")
    with pytest.raises(BadInput, match="nobody looks"):
        person.decide(person.start(), Situation(0.0, np.zeros(3), (1.0, 0.0), STILL))
