"""One option of a command: what a dataclass field may be on the command line, how words become its value."""

from __future__ import annotations

import difflib
import math
import re
import typing
from collections.abc import Callable
from dataclasses import MISSING, dataclass, fields
from enum import Enum
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from toddle.failures import BadInput

POSITIONAL = "positional"
"""``robot: Annotated[str, POSITIONAL]``: given by its place, not by a flag."""

NOT_FINITE = "not finite"
"""``wait: Annotated[float, NOT_FINITE]``: infinity and nan are allowed too."""


@dataclass(frozen=True)
class Option:
    """A field of a configuration, as it is given on the command line.

    The field's type is one of str, int, float, bool, Path, a Literal or an Enum; a tuple of these, of fixed
    or any length (``tuple[float, ...]``); any number of such tuples of fixed length, one each time that the option
    is given (``tuple[tuple[float, float], ...]``); or one of all that, or None. A field that would be a word of
    Python's ends with an underscore (``for_`` is ``--for``).

    Attributes:
        name: the field's name.
        read: from one word to one value; a ValueError says what was expected.
        kind: what one word is, in the help ("NUMBER").
        fewest: how few words it takes.
        most: how many words it takes at most; None for any number, 0 for a flag.
        single: whether its one value stands alone, not in a tuple.
        default: the field's default, MISSING where it must be given.
        positional: whether it is given by its place.
        about: what it is for, from the docstring.
        choices: the words it takes, where only some are.
        repeated: whether it may be given again, each time adding a value.
    """

    name: str
    read: Callable[[str], object]
    kind: str
    fewest: int
    most: int | None
    single: bool
    default: object
    positional: bool
    about: str
    choices: tuple[str, ...] = ()
    repeated: bool = False

    @property
    def flag(self) -> str:
        """How a message calls it."""
        return self.name.upper() if self.positional else "--" + self.name.rstrip("_").replace("_", "-")

    @property
    def flags(self) -> dict[str, bool | None]:
        """Each spelling on the command line, and the value it stands for by itself."""
        if self.positional:
            return {}
        return {self.flag: True, "--no-" + self.flag[2:]: False} if self.most == 0 else {self.flag: None}

    @property
    def words(self) -> str:
        """What follows the flag, in the help."""
        kind = self.name.upper() if self.positional else self.kind
        return f"{kind} ..." if self.most is None else " ".join([kind] * self.most)

    @property
    def example(self) -> str:
        """How to give it; a flag that stands by default, how to take it away."""
        if self.default is True:
            return "--no-" + self.flag[2:]
        return self.words if self.positional else f"{self.flag} {self.words}".strip()

    def convert(self, words: list[str]) -> object:
        """The field's value from its words.

        Raises:
            BadInput: too few words, or one that cannot be read.
        """
        if len(words) < self.fewest:
            got = f", got {len(words)}" if self.fewest > 1 else ""
            many = "a value" if self.fewest == 1 else f"{self.fewest} values"
            raise BadInput(f"needs {many}{got}", where=self.flag, remedy=f"for example {self.example}")
        try:
            values = tuple(self.read(word) for word in words)
        except ValueError as fault:
            raise BadInput(str(fault), where=self.flag) from fault
        return values[0] if self.single else values


def options_of(config: type) -> tuple[Option, ...]:
    """The options of a dataclass, in the order of its fields."""
    hints = typing.get_type_hints(config, include_extras=True)
    about = _attributes(config.__doc__ or "")
    return tuple(_option(f.name, hints[f.name], _default(f), about.get(f.name, "")) for f in fields(config) if f.init)


def shown(word: str) -> str:
    """A user's word as a message shows it: quoted, on one line, not endless."""
    return repr(word if len(word) <= 60 else word[:57] + "...")


def _option(name: str, hint: Any, default: object, about: str) -> Option:
    marks: tuple[object, ...] = ()
    if get_origin(hint) is Annotated:
        hint, *rest = get_args(hint)
        marks = tuple(rest)
    if get_origin(hint) in (Union, UnionType):
        (hint,) = [kind for kind in get_args(hint) if kind is not NoneType]
    parts = get_args(hint)
    repeated = get_origin(hint) is tuple and parts[-1] is ... and get_origin(parts[0]) is tuple
    if repeated:
        hint = parts[0]
    inner, fewest, most = hint, 1, 1
    if get_origin(hint) in (tuple, list):
        inner = get_args(hint)[0]
        length = None if get_origin(hint) is list or get_args(hint)[-1] is ... else len(get_args(hint))
        fewest, most = length or 1, length
    elif hint is bool:
        fewest = most = 0
    choices = _choices(inner)
    read, kind = (_choice(choices), "NAME") if choices else _reader(inner, finite=NOT_FINITE not in marks)
    place = POSITIONAL in marks
    return Option(name, read, kind, fewest, most, hint is inner, default, place, about, tuple(choices), repeated)


def _reader(kind: Any, *, finite: bool) -> tuple[Callable[[str], object], str]:
    """How one word of a type is read, and what the help calls it."""
    readers: dict[Any, tuple[Callable[[str], object], str]] = {
        float: (lambda word: _number(word, finite=finite), "NUMBER"),
        int: (_whole_number, "INTEGER"),
        str: (_text, "TEXT"),
        bool: (bool, ""),
        Path: (lambda word: Path(_text(word)), "PATH"),
    }
    return readers[kind]


def _number(word: str, *, finite: bool) -> float:
    try:
        value = float(word)
    except ValueError:
        raise ValueError(f"{shown(word)} is not a number") from None
    if finite and not math.isfinite(value):
        raise ValueError(f"{shown(word)} is not a finite number")
    return value


def _whole_number(word: str) -> int:
    """An integer, also as ``3e5``."""
    try:
        return int(word)
    except ValueError:
        value = _number(word, finite=True)
    if not value.is_integer():
        raise ValueError(f"{shown(word)} is not a whole number")
    return int(value)


def _text(word: str) -> str:
    if not word.strip() or "\0" in word:
        raise ValueError(f"{shown(word)} is empty or holds a NUL")
    return word


def _choices(kind: Any) -> dict[str, object]:
    """The words that a Literal or an Enum takes and their values; none for any other type."""
    if get_origin(kind) is Literal:
        return {str(value): value for value in get_args(kind)}
    if isinstance(kind, type) and issubclass(kind, Enum):
        return {str(member.value): member for member in kind}
    return {}


def _choice(choices: dict[str, object]) -> Callable[[str], object]:
    def read(word: str) -> object:
        if word in choices:
            return choices[word]
        near = difflib.get_close_matches(word, choices, n=2, cutoff=0.5)
        known = "did you mean " + " or ".join(near) + "?" if near else "known: " + ", ".join(choices)
        raise ValueError(f"no choice named {shown(word)}; {known}")

    return read


def _default(field: Any) -> object:
    return field.default_factory() if field.default_factory is not MISSING else field.default


def _attributes(doc: str) -> dict[str, str]:
    """What a Google-style docstring says about each attribute."""
    section = re.search(r"^\s*Attributes:\n(.*?)(?=^\s*\w+:\n|\Z)", doc, re.MULTILINE | re.DOTALL)
    entries = re.split(r"^\s+(\w+): ", section[1], flags=re.MULTILINE)[1:] if section else []
    return {name: " ".join(text.split()) for name, text in zip(entries[::2], entries[1::2], strict=True)}
