"""A command's arguments, derived from its frozen dataclass; every mistake is one line that names the remedy.

`parse` reads ``--learning-rate 0.1``, ``--learning-rate=0.1``, flags (``--json``, ``--no-json``), lists
(``--joints a b c``) and positional words into the fields of the same names. A field's type says what it
takes; the docstring's ``Attributes:`` say what it is for.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence
from dataclasses import MISSING
from typing import Any, TypeVar

from toddle.cli.options import Option, options_of, shown
from toddle.cli.usage import usage
from toddle.failures import BadInput

Config = TypeVar("Config")

_OPTION = re.compile(r"-(?![\d.]|inf\b|nan\b)\w*|--.*", re.IGNORECASE | re.DOTALL)


def parse(config: type[Config], argv: Sequence[str], *, prog: str) -> Config:
    """The configuration that the words of a command line ask for.

    Args:
        config: a frozen dataclass; see `toddle.cli.options.Option` for the types its fields may have.
        argv: the words after the command's name.
        prog: the command as the user calls it, for the help and the messages ("toddle reach").

    Raises:
        BadInput: an option that is unknown, given twice, lacks a value or has a bad one; a word too many; a
            field that must be given and was not.
        SystemExit: with code 0 after ``--help`` was printed.
    """
    options = options_of(config)
    if any(word in ("-h", "--help") for word in argv):
        print(usage(config, options, prog))
        raise SystemExit(0)
    given = _read(options, list(argv), prog)
    for option in options:
        if option.default is MISSING and option.name not in given:
            raise BadInput(f"{option.flag} is missing", where=prog, remedy=f"give it: {option.example}")
    try:
        return config(**given)
    except (TypeError, ValueError) as fault:
        raise BadInput(str(fault), where=prog) from fault


def _read(options: tuple[Option, ...], words: list[str], prog: str) -> dict[str, Any]:
    """The values given, by field name."""
    flags = {flag: (option, value) for option in options for flag, value in option.flags.items()}
    waiting = [option for option in options if option.positional]
    given: dict[str, Any] = {}
    while words:
        word = words.pop(0)
        name, equals, attached = word.partition("=")
        if not _OPTION.fullmatch(word):
            if not waiting:
                raise _one_word_too_many(word, flags, prog)
            option = waiting.pop(0)
            words.insert(0, word)
            value = option.convert(_values(option, words))
        elif name not in flags:
            raise _unknown_option(name, [*flags, "--help"], prog)
        else:
            option, fixed = flags[name]
            if fixed is not None and equals:
                raise BadInput(f"takes no value, got {shown(attached)}", where=name, remedy=f"write {name} alone")
            attachments = [attached] if equals else None
            value = fixed if fixed is not None else option.convert(attachments or _values(option, words))
        if option.repeated:
            value = (*given.pop(option.name, ()), value)
        if option.name in given:
            raise BadInput("given twice", where=option.flag, remedy="give it once")
        given[option.name] = value
    return given


def _values(option: Option, words: list[str]) -> list[str]:
    """Take an option's words off the front: up to the next option, or as many as it takes."""
    values: list[str] = []
    while words and (option.most is None or len(values) < option.most) and not _OPTION.fullmatch(words[0]):
        values.append(words.pop(0))
    return values


def _unknown_option(name: str, known: Sequence[str], prog: str) -> BadInput:
    bare = {flag.strip("-"): flag for flag in known}  # the dashes, which all have, would make all look alike
    near = difflib.get_close_matches(name.strip("-").replace("_", "-"), bare, n=2, cutoff=0.6)
    remedy = f"did you mean {' or '.join(bare[n] for n in near)}?" if near else f"known: {', '.join(known)}"
    return BadInput(f"no option named {shown(name)}", where=prog, remedy=remedy)


def _one_word_too_many(word: str, flags: dict[str, tuple[Option, bool | None]], prog: str) -> BadInput:
    near = difflib.get_close_matches(f"--{word}", flags, n=1, cutoff=0.8)
    remedy = f"did you mean {near[0]}?" if near else f"{prog} --help tells what it takes"
    return BadInput(f"one word too many: {shown(word)}", where=prog, remedy=remedy)
