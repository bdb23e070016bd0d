"""``toddle``: the first word chooses, and every failure becomes one line and an exit code."""

from __future__ import annotations

import errno
import importlib.metadata
import os
import subprocess
import sys
import types

import pytest

from toddle.cli import COMMANDS, main
from toddle.failures import BadInput, ToddleError


def toddle(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", "import sys; from toddle.cli import main; sys.exit(main())", *words]
    return subprocess.run(command, env={**os.environ, **environment}, capture_output=True, text=True, timeout=60)


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch) -> types.ModuleType:
    """A command of our own, ``toddle try``."""
    module = types.ModuleType("toddle.cli.try")
    monkeypatch.setitem(sys.modules, "toddle.cli.try", module)
    monkeypatch.setitem(COMMANDS, "try", "a command of the test's own")
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", "unused")
    return module


def test_help_shows_both_loops_and_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    assert main(["--help"]) == 0
    text = capsys.readouterr().out
    for part in ("the control loop", "the learning loop", "explore --> body --> learn --> solve", *COMMANDS):
        assert part in text
    assert max(map(len, text.splitlines())) <= 110


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"toddle {importlib.metadata.version('toddle')}\n"


@pytest.mark.parametrize(
    ("word", "line"),
    [
        ("raech", "toddle: no command named 'raech'; did you mean reach?"),
        ("zzz", "toddle: no command named 'zzz'; known: doctor, experiment, navigate, reach, see, walk"),
        ("--verison", "toddle: no option named '--verison'; did you mean --version?"),
        ("", "toddle: no command named ''; known: doctor, experiment, navigate, reach, see, walk"),
    ],
)
def test_an_unknown_word_is_answered_with_the_nearest(word: str, line: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([word]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err == line + "\n"


@pytest.mark.parametrize(
    ("failure", "code", "line"),
    [
        (
            BadInput("no such thing", where="a.urdf", remedy="try b"),
            2,
            "toddle: a.urdf: no such thing; try b",
        ),
        (ToddleError("it fell"), 1, "toddle: it fell"),
        (KeyboardInterrupt(), 130, "toddle: interrupted"),
        (
            OSError(errno.ENOSPC, "No space left on device", "runs/a"),
            1,
            "toddle: runs/a: No space left on device",
        ),
        (
            ZeroDivisionError("a\nb"),
            1,
            "toddle: ZeroDivisionError: a b; this is a fault of toddle: run again with TODDLE_DEBUG=1 "
            "for the traceback",
        ),
    ],
)
def test_a_failure_becomes_one_line_and_an_exit_code(
    failure: BaseException,
    code: int,
    line: str,
    command: types.ModuleType,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(argv: list[str]) -> int:
        raise failure

    command.main = fail  # pyright: ignore[reportAttributeAccessIssue]
    assert main(["try", "word"]) == code
    said = capsys.readouterr()
    assert (said.out, said.err) == ("", line + "\n")


def test_a_fault_of_ours_shows_its_traceback_when_asked(
    command: types.ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TODDLE_DEBUG", "1")
    with pytest.raises(AttributeError):
        main(["try"])


def test_a_command_gets_its_words_and_its_exit_code_is_returned(command: types.ModuleType) -> None:
    command.main = lambda argv: len(argv)  # pyright: ignore[reportAttributeAccessIssue]
    assert main(["try", "a", "b", "c"]) == 3


def test_a_reader_that_has_gone_is_no_failure_to_tell() -> None:
    script = "import sys; from toddle.cli import main; sys.exit(main(['--help']))"
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run([sys.executable, "-c", script], stdout=writing, stderr=subprocess.PIPE, timeout=60)
    os.close(writing)
    assert done.stderr == b""


def test_help_imports_nothing_heavy() -> None:
    script = (
        "import sys; from toddle.cli import main; main(['--help']);"
        "print([m for m in ('jax', 'numpy', 'mujoco', 'matplotlib', 'rich', 'tyro') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_doctor_answers_through_the_door() -> None:
    done = toddle("doctor", "--jsno")
    assert done.returncode == 2
    assert done.stderr == "toddle: toddle doctor: no option named '--jsno'; did you mean --json?\n"
