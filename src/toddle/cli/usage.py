"""What ``toddle COMMAND --help`` prints: the usage, what the command does, each option and its default."""

from __future__ import annotations

import shutil
import textwrap
from dataclasses import MISSING
from enum import Enum

from toddle.cli.options import Option

_COLUMN = 30


def usage(config: type, options: tuple[Option, ...], prog: str) -> str:
    """The help of one command, wrapped to the terminal's width."""
    width = min(shutil.get_terminal_size().columns, 110)
    places = [o.words if o.default is MISSING else f"[{o.words}]" for o in options if o.positional]
    purpose = (config.__doc__ or "").split("Attributes:")[0].strip()
    blocks = [" ".join(["usage:", prog, *places, "[options]"]), *_paragraphs(purpose, width)]
    blocks.append("\n".join(_line(option, width) for option in sorted(options, key=lambda o: not o.positional)))
    return "\n\n".join(blocks)


def _paragraphs(text: str, width: int) -> list[str]:
    return [textwrap.fill(" ".join(part.split()), width) for part in text.split("\n\n")]


def _line(option: Option, width: int) -> str:
    head = f"  {option.example}"
    choices = f"({', '.join(option.choices)})" if option.choices else ""
    about = " ".join(filter(None, [option.about, choices, _note(option.default)]))
    lines = textwrap.wrap(about, max(width - _COLUMN, 30)) or [""]
    if len(head) > _COLUMN - 2:
        lines.insert(0, "")
    indent = "\n" + " " * _COLUMN
    return (head.ljust(_COLUMN) + indent.join(lines)).rstrip()


def _note(default: object) -> str:
    """The default as the help shows it; a flag has none, nor what is empty."""
    if default is MISSING:
        return "(must be given)"
    if default is None or isinstance(default, bool) or default == ():
        return ""
    if isinstance(default, Enum):
        return f"[{default.value}]"
    if isinstance(default, list | tuple):
        return f"[{' '.join(map(str, default))}]"
    return f"[{default}]"
