"""Calls of ``toddle walk`` that can't be answered: each gets one line and exit code 2, and nothing is written."""

from __future__ import annotations

import os
import pickle
from pathlib import Path

import pytest

from toddle.cli import main

NUMBERS = {"nan": "finite", "inf": "finite", "1e999": "finite", "": "not a number", "soon": "not a number",
           "1,5": "not a number", "0x10": "not a number"}  # fmt: skip
OPTIONS: dict[str, dict[str, str]] = {
    "--for": NUMBERS | {"0": "range", "-1": "range", "1e9": "range"},
    "--iterations": {"0": "range", "-5": "range", "1.5": "whole", "nan": "finite", "1e30": "range", "many": "not a"},
    "--deadline": NUMBERS | {"-1": "range"},
    "--noise": NUMBERS | {"-1": "range", "1e9": "range"},
    "--delay": NUMBERS | {"-1": "range", "15": "multiple"},
    "--lag": NUMBERS | {"-1": "range"},
    "--friction": NUMBERS | {"0": "range", "-1": "range"},
    "--tilt": NUMBERS | {"90": "range", "-1": "range"},
    "--mass-error": NUMBERS | {"1": "range", "-0.1": "range"},
    "--seed": {"-1": "range", "1.5": "whole", "nan": "finite", "1e30": "range", "": "not a number"},
    "--weights": {"docment": "did you mean document", "": "no choice", "heavy": "no choice"},
    "--scenario": {"streight": "did you mean straight", "": "empty", "dance": "no scenario", "x\0": "NUL"},
    "--push": {"": "empty", "6": "no push", "6@": "no push", "@5": "no push", "6@five": "no push", "6@5@6@7": "no push",
               "nan@5": "range", "6@inf": "range", "-6@5": "range", "6@-5": "range", "1e9@5": "range",
               "6@5@nan": "range", "6 @ 5 now": "no push"},
    "--script": {"": "empty", "nowhere.txt": "no such file", "folder": "no file", "pipe": "no file",
                 "picture": "no text", "/dev/zero": "no file", "loop": "can't be read"},
    "--config": {"": "empty", "nowhere.toml": "nowhere.toml", "folder": "folder", "picture": "not TOML",
                 "misspelt.toml": "did you mean step_time", "word.toml": "not a finite number",
                 "nan.toml": "not a finite number", "negative.toml": "step_time"},
    "--out": {"": "empty", "picture": "no folder", "picture/in": "no folder", "loop": "no folder",
              "taken": "its walk.mp4 would be written over", "/proc/run": "no folder", "y" * 300: "no folder"},
}  # fmt: skip
SCRIPTS: dict[str, tuple[str, str]] = {
    "word.txt": ("0 .1 0 0\n1 fast 0 0\n", "word.txt, line 2: vx is not a number"),
    "nan.txt": ("0 .1 0 nan\n", "nan.txt, line 1: omega is not a finite number"),
    "backwards.txt": ("0 .1 0 0\n2 .1 0 0\n1 .1 0 0\n", "backwards.txt, line 3: its time 1 s doesn't come after 2 s"),
    "short.txt": ("0 .1 0\n", "short.txt, line 1: it has 3 columns, not 4"),
    "empty.txt": ("", "empty.txt: it holds no command"),
    "early.txt": ("-1 .1 0 0\n", "early.txt, line 1: t is out of range"),
}
CONFIGS = {
    "misspelt.toml": "step_tiem = 0.6\n",
    "word.toml": "step_time = 'short'\n",
    "nan.toml": "step_time = nan\n",
    "negative.toml": "step_time = -1\n",
}
WORDS: dict[str, tuple[tuple[str, ...], str]] = {
    "an unknown robot": (("heicup",), "did you mean heicub"),
    "an arm": (("nicu",), "no humanoid named 'nicu'"),
    "a lost file": (("nowhere.urdf",), "nowhere.urdf"),
    "a picture": (("picture.urdf",), "not XML"),
    "a gait alone": (("hrp2",), "without a body"),
    "an empty robot": (("",), "empty"),
    "two robots": (("heicub", "icub"), "one word too many"),
    "two numbers": (("--command", "0.1", "0"), "needs 3 values, got 2"),
    "four numbers": (("--command", "0.1", "0", "0", "0", "--pattern-only"), "no humanoid named '0'"),
    "a word": (("--command", "0.1", "left", "0"), "not a number"),
    "nan": (("--command", "0.1", "nan", "0"), "finite"),
    "infinity": (("--command", "0.1", "0", "-inf"), "finite"),
    "faster than sound": (("--command", "1e6", "0", "0"), "out of range"),
    "a command twice": (("--command", "0", "0", "0", "--command", "0", "0", "0"), "given twice"),
    "a command and keys": (("--command", "0", "0", "0", "--keys"), "exclude each other"),
    "a command and a script": (("--command", "0", "0", "0", "--script", "word.txt"), "exclude each other"),
    "a script and a scenario": (("--script", "word.txt", "--scenario", "curve"), "exclude each other"),
    "two lengths": (("--for", "5", "--iterations", "5"), "exclude each other"),
    "an obstacle without radius": (("--obstacle", "1", "0"), "needs 3 values, got 2"),
    "a flat obstacle": (("--obstacle", "1", "0", "0"), "out of range"),
    "an obstacle inside out": (("--obstacle", "1", "0", "-1"), "out of range"),
    "a second bad obstacle": (("--obstacle", "1", "0", "1", "--obstacle", "1", "nan", "1"), "finite"),
    "a far obstacle": (("--obstacle", "1e9", "0", "1"), "out of range"),
    "pushing a pattern": (("--pattern-only", "--push", "6@5"), "a pattern has no body"),
    "driving a pattern": (("--pattern-only", "--keys"), "a pattern has no body"),
    "filming a pattern": (("--pattern-only", "--video"), "a pattern has no body"),
    "a noisy pattern": (("--pattern-only", "--noise", "1"), "a pattern has no body"),
    "a robot that the document does not know": (("icub", "--weights", "document"), "take heicub"),
    "a misspelt option": (("--comand", "0", "0", "0"), "did you mean --command"),
    "for_": (("--for_", "5"), "did you mean --for"),
}


def _calls() -> dict[str, tuple[tuple[str, ...], str]]:
    calls = {f"{flag} {v[:20]!r}": ((flag, v), says) for flag, values in OPTIONS.items() for v, says in values.items()}
    calls |= {name: (("--script", name), says) for name, (_, says) in SCRIPTS.items()}
    return calls | WORDS


CALLS = _calls()


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("hostile_walk")
    for name, (text, _) in SCRIPTS.items():
        (path / name).write_text(text)
    for name, text in CONFIGS.items():
        (path / name).write_text(text)
    (path / "folder").mkdir()
    (path / "taken").mkdir()
    (path / "taken" / "walk.mp4").touch()
    (path / "picture").write_bytes(b"\x89PNG\xff\xfe\x00")
    (path / "picture.urdf").write_bytes(pickle.dumps({"robot": 1}))
    (path / "loop").symlink_to("loop")
    os.mkfifo(path / "pipe")
    return path


@pytest.mark.usefixtures("unchecked")
@pytest.mark.parametrize("name", CALLS)
def test_a_hostile_call_is_answered_by_one_line(
    name: str, place: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    words, says = CALLS[name]
    monkeypatch.chdir(place)
    before = sorted(os.walk(place))
    code = main(["walk", *words])
    said = capfd.readouterr()
    *_, line = said.err.removesuffix("\n").split("\n")
    assert code == 2, said.err
    assert said.out == ""
    assert line.startswith("toddle: ")
    assert line.isprintable(), line
    assert says in line
    assert "Traceback" not in said.err
    assert "fault of toddle" not in said.err
    assert sorted(os.walk(place)) == before
