"""Tables of docs/peers.md, written from the stored figures between their markers; nothing is measured here.

A marker is a line ``<!-- PART -->``; what stands between it and ``<!-- /PART -->`` is replaced. Ratios are over ours in
the same run. Where a peer is ahead of ours, a list says so.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

Content = dict[str, Any]
Row = dict[str, Any]
NAMES = {
    "toddle": "**toddle**",
    "damped_numpy": "damped least squares in NumPy",
    "roboticstoolbox": "roboticstoolbox-python",
    "pink": "Pink",
    "ikpy": "IKPy",
    "placo": "PlaCo",
    "trac_ik": "TRAC-IK (pytracik)",
}
TIMES = (("median_us", "median"), ("p99_us", "99th percentile"))


def write_report(result: Path, page: Path) -> None:
    """Fill the page from the file of results."""
    tables = tables_of(json.loads(result.read_text()))
    page.write_text(filled(page.read_text(), tables))
    print(f"wrote {page}")


def filled(text: str, tables: dict[str, str]) -> str:
    """A page with every marked place replaced; the text around them stays."""
    for name, table in tables.items():
        between = re.compile(rf"(<!-- {name} -->\n).*?(<!-- /{name} -->)", re.DOTALL)
        text = between.sub(lambda found, table=table: f"{found[1]}\n{table}\n\n{found[2]}", text)
    return text


def tables_of(content: Content) -> dict[str, str]:
    """Every table of the page, by its marker."""
    return {
        "success": _matrix(content, lambda row, _: _success(row)),
        "first_try": _matrix(content, lambda row, _: f"{row['first_try_success_percent']:.4g}"),
        "median": _matrix(content, lambda row, ours: _ratio(row, ours, "median_us")),
        "p99": _matrix(content, lambda row, ours: _ratio(row, ours, "p99_us")),
        "batch": _batches(content),
        "behind": _behind(content),
        "settings": _settings(content),
        "run": _run(content),
    }


def ahead(ours: Row, row: Row) -> list[str]:
    """In what a peer is ahead of ours on an arm, in words."""
    found = []
    if row["success_percent"] > ours["success_percent"]:
        found.append(f"success, {row['success_percent']:.4g} % to {ours['success_percent']:.4g} %")
    for key, word in TIMES:
        if row[key] < ours[key]:
            found.append(f"{word}, {row[key]:.3g} µs to {ours[key]:.3g} µs")
    batch = "batch_us_per_target"
    if batch in row and row[batch] < ours[batch]:
        found.append(f"batch, {row[batch]:.3g} µs a target to {ours[batch]:.3g} µs")
    return found


def _peers(content: Content) -> list[str]:
    ours = content["ours"]
    found = dict.fromkeys(peer for body in content["bodies"].values() for peer in body["peers"])
    return [ours, *(peer for peer in found if peer != ours)]


def _matrix(content: Content, cell: Callable[[Row, Row], str]) -> str:
    lines = []
    for peer in _peers(content):
        line = [NAMES.get(peer, peer)]
        for body in content["bodies"].values():
            row, ours = body["peers"].get(peer), body["peers"][content["ours"]]
            line.append("-" if row is None or "refused" in row or "refused" in ours else cell(row, ours))
        lines.append(line)
    return table_of(["", *content["bodies"]], lines)


def _success(row: Row) -> str:
    return f"{row['success_percent']:.4g} (of {row['targets']})"


def _ratio(row: Row, ours: Row, key: str) -> str:
    return (
        f"{row[key]:.3g} µs"
        if row is ours
        else f"{row[key] / ours[key]:.2g} x"
        if row[key] < 10 * ours[key]
        else (f"{row[key] / ours[key]:,.0f} x")
    )


def _batches(content: Content) -> str:
    lines = []
    for name, body in content["bodies"].items():
        for peer, row in body["peers"].items():
            if "batch_us_per_target" in row:
                ratio = row["batch_us_per_target"] / body["peers"][content["ours"]]["batch_us_per_target"]
                lines.append(
                    [
                        name,
                        NAMES.get(peer, peer),
                        f"{row['batch_us_per_target']:.3g}",
                        "" if peer == content["ours"] else f"{ratio:,.0f} x",
                        f"{row['batch_success_percent']:.4g}",
                    ]
                )
    return table_of(["", "", "µs a target", "over ours", "success [%]"], lines)


def _behind(content: Content) -> str:
    lines = []
    for name, body in content["bodies"].items():
        ours = body["peers"][content["ours"]]
        for peer, row in body["peers"].items():
            if peer != content["ours"] and "refused" not in row and (told := ahead(ours, row)):
                lines.append(f"- {name}: {NAMES.get(peer, peer)} is ahead of ours in {'; '.join(told)}.")
    return "\n".join(lines) or "In this run no peer is ahead of ours on any arm, neither in success nor in either time."


def _settings(content: Content) -> str:
    lines = []
    for peer in _peers(content):
        rows = [body["peers"][peer] for body in content["bodies"].values() if peer in body["peers"]]
        used = next((row["settings"] for row in rows if "settings" in row), "-")
        refused = [f"{name}: {body['peers'][peer]['refused']}" for name, body in content["bodies"].items()
                   if "refused" in body["peers"].get(peer, {})]  # fmt: skip
        versions = ", ".join(f"{name} {version}" for name, version in content["versions"].get(peer, {}).items())
        lines.append([NAMES.get(peer, peer), versions, used, "; ".join(refused) or "none"])
    lines += [[NAMES.get(peer, peer), "-", "-", f"all: {reason}"] for peer, reason in content["skipped"].items()]
    return table_of(["", "versions", "used as", "skipped on"], lines)


def _run(content: Content) -> str:
    plan = content["plan"]
    return (
        f"`{content['command']}`: {plan['targets']} targets for each arm, seed {plan['seed']}; {content['machine']}; "
        f"Python {content['python']}; {content['seconds']:.0f} s; load {content['load_average']:.1f} at the end."
    )


def table_of(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table in Markdown."""
    names = list(head)
    return "\n".join("| " + " | ".join(line) + " |" for line in [names, ["---"] * len(names), *map(list, rows)])
