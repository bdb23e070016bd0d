"""Tables of docs/walking-proof.md and docs/push-map.md, written from the files of results between their markers.

A marker is a line ``<!-- PART -->``; what stands between it and ``<!-- /PART -->`` is replaced. A part that was not run
says so. Nothing here judges: figures are printed as they are, short of the aim or not.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from benchmarks.walking.pushes import DIRECTIONS, PHASES, SPEEDS, stance_in_words

Content = dict[str, Any]
PICTURE = "pictures/push-map.png"


def write_report(results: Path, docs: Path) -> None:
    """Fill both pages, and draw the push map."""
    tables = {name: _section(results, name, table) for name, table in TABLES.items()}
    for page in ("walking-proof.md", "push-map.md"):
        path = docs / page
        path.write_text(filled(path.read_text(), tables))
        print(f"wrote {path}")
    if (content := _read(results, "pushes")) is not None:
        from benchmarks.walking.picture import draw_push_map

        draw_push_map(content, docs / PICTURE)


def filled(text: str, tables: dict[str, str]) -> str:
    """A page with every marked place replaced; markers without a table, and text around them, stay."""
    for name, table in tables.items():
        between = re.compile(rf"(<!-- {name} -->\n).*?(<!-- /{name} -->)", re.DOTALL)
        text = between.sub(lambda found, table=table: f"{found[1]}\n{table}\n\n{found[2]}", text)
    return text


def _read(results: Path, part: str) -> Content | None:
    path = results / f"walking_{part}.json"
    return json.loads(path.read_text()) if path.exists() else None


def _section(results: Path, name: str, table: Callable[[Content], str]) -> str:
    content = _read(results, "pushes" if name == "push_map" else name)
    if content is None or not content["cases"]:
        return "Not run yet."
    part = "" if content["complete"] else " Not all cases were run."
    source = f"`{content['command']}`, commit {content['commit']}, {content['date']}, {content['machine']}"
    return f"{table(content)}\n\n{source}; {content['cpu_seconds']:.0f} s of processor time.{part}"


def table_of(head: Iterable[str], rows: Iterable[Iterable[Any]]) -> str:
    """A table in Markdown; None is a dash, False "no"."""
    names = list(head)
    lines = [names, ["---"] * len(names), *([_word(value) for value in row] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _word(value: Any) -> str:
    if value is None or value == [] or value == {}:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.3g}"
    return ", ".join(map(_word, value)) if isinstance(value, list) else str(value)


def _walks(content: Content) -> str:
    head = (
        "walk", "fell", "seconds", "true velocity", "error of velocity, yaw rate [%]", "by its own sensors [%]",
        "ZMP error mean, std [cm]", "slip mean, most [mm]", "servos at their limit [%]", "real time x",
    )  # fmt: skip
    return table_of(head, (_walk_row(case) for case in content["cases"]))


def _walk_row(case: dict[str, Any]) -> list[Any]:
    row, name = case["row"], case["name"]
    if row["fell"] is None:
        return [name, f"refused: {row['refused']}", *[None] * 8]
    slip = row["slip_mm"]
    return [
        name, row["fell"], row["seconds"], row.get("true_velocity"), row.get("true_error_percent"),
        row.get("measured_error_percent"), [row["zmp_error_mean_cm"], row["zmp_error_std_cm"]],
        [slip["mean"], slip["most"]] if slip else None, row["saturation_percent"], row["real_time_factor"],
    ]  # fmt: skip


def _fields(content: Content) -> str:
    rows = [case["row"] for case in content["cases"]]
    summary = content["summary"]
    least = summary["least_clearance_cm"]
    through = "past" if "past" in summary else "reached"
    return table_of(
        ("fields", "fell", "touched", "got through", "not through", "least clearance of feet, legs, body [cm]"),
        [
            [
                len(rows), len(summary["fell"]), len(summary["touched"]), summary[through], summary[f"not_{through}"],
                [least["feet"], least["legs"], least["body"]],
            ]
        ],
    )  # fmt: skip


def _pushes(content: Content) -> str:
    head = ("", "cells", "least [N s]", "mean [N s]", "at least 6", "at least 8", "at least 10")
    return table_of(
        head,
        (
            [name, line["cells"], line["least"], line["mean"]]
            + [f"{100 * line[f'share_of_at_least_{limit}']:.0f} %" for limit in (6, 8, 10)]
            for name, line in content["summary"].items()
        ),
    )


def _push_map(content: Content) -> str:
    largest = {(case["speed"], case["phase"], case["direction"]): case["row"]["largest"] for case in content["cases"]}
    stances = [(0.0, None), *((speed, phase) for speed in SPEEDS for phase in PHASES)]
    return (
        table_of(
            ("", *(f"{direction}°" for direction in DIRECTIONS)),
            ([stance_in_words(*stance), *(largest.get((*stance, turn)) for turn in DIRECTIONS)] for stance in stances),
        )
        + f"\n\n![Roses of the largest push survived]({PICTURE})"
    )


def _ablation(content: Content) -> str:
    head = ("off", "pushes survived", "fell at 0.25 m/s", "after [s]", "error of velocity [%]", "ZMP error [cm]")
    return table_of(
        head,
        (
            [f"`{term}`", f"{line['survived']} of {line['pushes']}"]
            + ([walk["fell"], walk["seconds"], _first(walk["true_error_percent"]), walk["zmp_error_mean_cm"]]
               if (walk := line.get("walk")) else [None] * 4)
            for term, line in content["summary"].items()
        ),
    )  # fmt: skip


def _first(values: list[Any] | None) -> Any:
    return values[0] if values else None


def _deadline(content: Content) -> str:
    return table_of(
        ("case", "fell", "plans", "late"),
        (
            [case["name"], case["row"]["fell"], case["row"]["plans"], case["row"]["fallbacks"]]
            for case in content["cases"]
        ),
    )


TABLES: dict[str, Callable[[Content], str]] = {
    **dict.fromkeys(("walks", "random", "random_unlimited", "sensors", "humanoids", "bumps"), _walks),
    **dict.fromkeys(("obstacles_stubborn", "obstacles_guided"), _fields),
    "pushes": _pushes,
    "push_map": _push_map,
    "ablation": _ablation,
    "deadline": _deadline,
}
