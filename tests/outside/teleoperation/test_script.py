"""Scripts of velocity commands: what is read, and each mistake with its file and line."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from toddle.failures import BadInput
from toddle.outside.teleoperation.commands import follow, script_seconds, until
from toddle.outside.teleoperation.script import read_script
from toddle.signals import STILL, Velocity
from toddle.walk.scenarios import Leg

GOOD = (Leg(0.0, Velocity(0.1, 0.0, 0.0)), Leg(2.5, Velocity(0.0, -0.05, 0.1)), Leg(4.0, STILL))


@pytest.mark.parametrize(
    "text",
    [
        "0 .1 0 0\n2.5 0 -.05 .1\n4 0 0 0\n",
        "t,vx,vy,omega\n0,0.1,0,0\n2.5,0,-0.05,0.1\n4,0,0,0",
        "# a walk\n\n T VX VY OMEGA\n0;.1;0;0 # ahead\n\n2.5;\t0;-5e-2;.1\r\n4 0 0 0\n# done",
        "﻿0\t.1\t0\t0\n2.5\t0\t-.05\t.1\n4\t0\t0\t0",
    ],
)
def test_a_script_is_read(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.txt").write_text(text, encoding="utf-8")
    assert read_script(tmp_path / "a.txt") == GOOD


BAD = {
    "a word for a number": ("0 .1 0 0\n1 fast 0 0\n", "line 2: vx is not a number: 'fast'"),
    "nan": ("0 nan 0 0\n", "line 1: vx is not a finite number: 'nan'"),
    "infinity": ("0 0 inf 0\n", "line 1: vy is not a finite number"),
    "overflow": ("0 0 0 1e999\n", "line 1: omega is not a finite number"),
    "time running backwards": ("0 .1 0 0\n\n2 0 0 0\n1 0 0 0\n", "line 4: its time 1 s doesn't come after 2 s"),
    "time standing still": ("1 .1 0 0\n1 0 0 0\n", "line 2: its time 1 s doesn't come after 1 s"),
    "negative time": ("-1 .1 0 0\n", "line 1: t is out of range: -1"),
    "endless time": ("1e9 .1 0 0\n", "line 1: t is out of range"),
    "nan time": ("nan .1 0 0\n", "line 1: t is not a finite number"),
    "a missing column": ("0 .1 0 0\n1 .1 0\n", "line 2: it has 3 columns, not 4"),
    "a column too many": ("0 .1 0 0 0\n", "line 1: it has 5 columns, not 4"),
    "an absurd speed": ("0 300000 0 0\n", "line 1: vx is out of range: 300000"),
    "a decimal comma": ("0 0,1 0 0\n", "line 1: it has 5 columns"),
    "a head in the middle": ("0 .1 0 0\nt vx vy omega\n", "line 2: t is not a number"),
    "another head": ("time x y w\n", "line 1: t is not a number"),
    "empty": ("", "it holds no command"),
    "blank": ("\n \t\n", "it holds no command"),
    "only comments": ("# nothing\n", "it holds no command"),
    "only a head": ("t vx vy omega\n", "it holds no command"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_mistake_is_named_with_file_line_and_remedy(tmp_path: Path, name: str) -> None:
    text, says = BAD[name]
    path = tmp_path / "bad.txt"
    path.write_text(text)
    with pytest.raises(BadInput) as caught:
        read_script(path)
    assert str(caught.value).startswith(f"{path}")
    assert says in str(caught.value)
    assert caught.value.remedy


def test_what_is_no_text_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "picture").write_bytes(b"\x89PNG\xff\xfe\x00")
    with (tmp_path / "large").open("wb") as file:
        file.truncate(2**21)
    for name, says in (("folder", "no file"), ("pipe", "no file"), ("picture", "no text"), ("large", "larger"),
                       ("nowhere", "no such file"), ("picture/in", "can't be read")):  # fmt: skip
        with pytest.raises(BadInput, match=says):
            read_script(tmp_path / name)


def test_a_source_ends_when_its_time_is_over_or_somebody_stops_it() -> None:
    asked: list[bool] = []
    source = until(lambda: bool(asked), follow(GOOD, 3.0))
    assert [source(t) for t in (0.0, 2.6, 2.999)] == [GOOD[0].velocity, GOOD[1].velocity, GOOD[1].velocity]
    assert source(3.0) is None
    assert source(1.0) is not None
    asked.append(True)
    assert source(1.0) is None


def test_a_script_that_ends_in_motion_goes_on_for_a_while() -> None:
    assert script_seconds(GOOD) == 4.0
    assert script_seconds(GOOD[:2]) == 12.5
