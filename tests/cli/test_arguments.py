"""The words of a command line become a frozen dataclass, and each mistake one line."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.cli.arguments import parse
from toddle.cli.options import NOT_FINITE, POSITIONAL
from toddle.failures import BadInput


class Mode(Enum):
    SHORT = "short"
    LONG = "long"


@dataclass(frozen=True)
class Everything:
    """Try every kind of option.

    The second paragraph.

    Attributes:
        robot: a robot's name,
            or a file.
        samples: movements to make.
        limit: may be infinite [s].
        late: a list given by its factory.
    """

    robot: Annotated[str, POSITIONAL]
    second: Annotated[Path | None, POSITIONAL] = None
    samples: int = 1000
    learning_rate: float = 0.1
    limit: Annotated[float, NOT_FINITE] = 1.0
    target: tuple[float, ...] | None = None
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)
    joints: tuple[str, ...] = ()
    method: Literal["goal-babbling", "motor-babbling"] = "goal-babbling"
    mode: Mode = Mode.SHORT
    out: Path | None = None
    json: bool = False
    picture: bool = True
    late: tuple[int, ...] = field(default_factory=lambda: (1, 2))

    def __post_init__(self) -> None:
        if self.samples == 13:
            raise ValueError("13 samples bring bad luck")


def read(*words: str) -> Everything:
    return parse(Everything, words, prog="toddle try")


def refused(*words: str) -> str:
    with pytest.raises(BadInput) as failure:
        read(*words)
    assert "\n" not in failure.value.line
    return failure.value.line


@pytest.mark.parametrize(
    ("words", "name", "value"),
    [
        ([], "samples", 1000),
        (["--samples", "5"], "samples", 5),
        (["--samples=5"], "samples", 5),
        (["--samples", "3e5"], "samples", 300_000),
        (["--samples", "-5"], "samples", -5),
        (["--learning-rate", "-1e-3"], "learning_rate", -0.001),
        (["--limit", "inf"], "limit", math.inf),
        (["--limit", "-inf"], "limit", -math.inf),
        (["--target", "0.1", "-.2", "3"], "target", (0.1, -0.2, 3.0)),
        (["--target", "0.1", "--json"], "target", (0.1,)),
        (["--place", "1", "2", "3"], "place", (1.0, 2.0, 3.0)),
        (["--joints", "a", "b"], "joints", ("a", "b")),
        (["--method", "motor-babbling"], "method", "motor-babbling"),
        (["--mode", "long"], "mode", Mode.LONG),
        (["--out", "a/b"], "out", Path("a/b")),
        (["a/b.urdf"], "second", Path("a/b.urdf")),
        (["--json"], "json", True),
        (["--no-picture"], "picture", False),
        ([], "late", (1, 2)),
    ],
)
def test_words_become_values(words: list[str], name: str, value: Any) -> None:
    assert getattr(read("nicu", *words), name) == value


def test_a_fixed_length_leaves_the_rest_to_the_places() -> None:
    assert read("--place", "1", "2", "3", "nicu", "file").second == Path("file")


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("--samples 5", "toddle try: ROBOT is missing; give it: ROBOT"),
        ("nicu --sampels 5", "toddle try: no option named '--sampels'; did you mean --samples?"),
        ("nicu --learning_rate 5", "did you mean --learning-rate"),
        ("nicu -x", "toddle try: no option named '-x'; known: --"),
        ("nicu -- file", "no option named '--'"),
        ("nicu a b", "toddle try: one word too many: 'b'; toddle try --help tells what it takes"),
        ("nicu a json", "toddle try: one word too many: 'json'; did you mean --json?"),
        ("nicu --samples", "--samples: needs a value; for example --samples INTEGER"),
        ("nicu --samples --json", "--samples: needs a value"),
        ("nicu --samples x", "--samples: 'x' is not a number"),
        ("nicu --samples 0.5", "--samples: '0.5' is not a whole number"),
        ("nicu --samples=", "--samples: '' is not a number"),
        ("nicu --samples 1e999", "--samples: '1e999' is not a finite number"),
        ("nicu --samples 1 --samples 2", "--samples: given twice; give it once"),
        ("nicu --samples 13", "toddle try: 13 samples bring bad luck"),
        ("nicu --learning-rate nan", "--learning-rate: 'nan' is not a finite number"),
        ("nicu --target 1 inf", "--target: 'inf' is not a finite number"),
        ("nicu --target", "--target: needs a value; for example --target NUMBER ..."),
        ("nicu --place 1 2", "--place: needs 3 values, got 2; for example --place NUMBER NUMBER NUMBER"),
        ("nicu --place 1 2 3 a 4", "one word too many: '4'"),
        (
            "nicu --method goal-bablbing",
            "--method: no choice named 'goal-bablbing'; did you mean goal-babbling",
        ),
        ("nicu --method zzz", "--method: no choice named 'zzz'; known: goal-babbling, motor-babbling"),
        ("nicu --mode medium", "--mode: no choice named 'medium'; known: short, long"),
        ("nicu --json=no", "--json: takes no value, got 'no'; write --json alone"),
        ("nicu --json --no-json", "--json: given twice"),
        ("nicu --out=", "--out: '' is empty"),
    ],
)
def test_a_mistake_is_one_line_that_names_the_remedy(words: str, line: str) -> None:
    assert line in refused(*words.split(" "))


def test_a_word_of_any_length_is_told_shortly() -> None:
    assert len(refused("nicu", "--samples", "9" * 100_000)) < 120
    assert len(refused("nicu", "--samples", "a\nb" * 1000)) < 120


@given(st.lists(st.text(max_size=8) | st.sampled_from(["--samples", "--target", "--json", "-1"]), max_size=5))
def test_no_words_whatever_end_in_a_traceback(words: list[str]) -> None:
    try:
        read(*words)
    except (BadInput, SystemExit) as ending:
        line = ending.line if isinstance(ending, BadInput) else ""  # a SystemExit is the help's
        assert len(line.splitlines()) <= 1


@given(st.floats(allow_nan=False, allow_infinity=False, width=32), st.integers(-(10**9), 10**9))
def test_numbers_come_back_as_they_were_given(number: float, whole: int) -> None:
    arguments = read("nicu", "--learning-rate", repr(number), "--samples", str(whole + (whole == 13)))
    assert arguments.learning_rate == number
    assert arguments.samples == whole + (whole == 13)


def test_help_tells_purpose_places_options_choices_and_defaults(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        read("--help")
    text = " ".join(capsys.readouterr().out.split())
    assert left.value.code == 0
    for part in (
        "usage: toddle try ROBOT [SECOND] [options]",
        "Try every kind of option. The second paragraph.",
        "ROBOT a robot's name, or a file. (must be given)",
        "--samples INTEGER movements to make. [1000]",
        "--place NUMBER NUMBER NUMBER [0.0 0.0 0.0]",
        "--method NAME (goal-babbling, motor-babbling) [goal-babbling]",
        "--mode NAME (short, long) [short]",
        "--no-picture",
    ):
        assert part in text
