"""``toddle doctor``: what this machine has and lacks, as a table, as lines, or as one JSON object."""

from __future__ import annotations

import dataclasses
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass

from toddle.cli.arguments import parse
from toddle.outside.doctor import Finding, examine


@dataclass(frozen=True)
class Doctor:
    """Say what this machine has and lacks, each lack with the command that mends it.

    The exit code is 1 where a part is missing without which nothing works, else 0.

    Attributes:
        json: print one JSON object, and nothing else.
    """

    json: bool = False


def main(argv: Sequence[str]) -> int:
    """Examine the machine, tell, and return the exit code."""
    arguments = parse(Doctor, argv, prog="toddle doctor")
    findings = examine()
    whole = all(finding.present for finding in findings if finding.core)
    if arguments.json:
        print(json.dumps({"whole": whole, "parts": [dataclasses.asdict(finding) for finding in findings]}))
    elif sys.stdout.isatty():
        _table(findings)
    else:
        print("\n".join(map(_line, findings)))
    return 0 if whole else 1


def _state(finding: Finding) -> str:
    return "ok" if finding.present else "MISSING" if finding.core else "lacks"


def _line(finding: Finding) -> str:
    remedy = "" if finding.present else f"; mend it: {finding.remedy}"
    return f"{_state(finding):<8}{finding.part:<20}{finding.found}{remedy}"


def _table(findings: tuple[Finding, ...]) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    colours = {"ok": "green", "lacks": "yellow", "MISSING": "bold red"}
    table = Table("", "part", "found", "what mends it")
    for finding in findings:
        state = _state(finding)
        remedy = "" if finding.present else finding.remedy
        table.add_row(Text(state, colours[state]), Text(finding.part), Text(finding.found), Text(remedy))
    Console().print(table)
