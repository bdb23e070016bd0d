"""The folder that a run of ``toddle walk`` leaves, and what it prints of it."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from toddle.failures import BadInput

if TYPE_CHECKING:
    from toddle.outside.walk_record import Record
    from toddle.robots.gait import Gait
    from toddle.signals import Circle

FILES = (
    "config.json", "figures.json", "trajectory.parquet", "footprints.png", "feet.png", "zmp_error.png",
    "velocity.png", "walk.mp4",
)  # fmt: skip


def refuse_used(out: Path | None) -> None:
    """Refuse a folder in which a new run would write over something."""
    if out is None:
        return
    if os.path.lexists(out) and not os.path.isdir(out):
        raise BadInput("it is no folder", where=f"--out {out}", remedy="name another")
    found = [name for name in FILES if os.path.lexists(out / name)]
    if found:
        raise BadInput(f"its {found[0]} would be written over", where=str(out), remedy="name another with --out")


def leave(
    folder: Path,
    record: Record,
    gait: Gait,
    figures: Mapping[str, Any],
    config: Mapping[str, Any],
    circles: Sequence[Circle],
) -> None:
    """Write configuration, trajectory, figures and pictures."""
    from toddle.outside.files import write_json
    from toddle.outside.versions import versions
    from toddle.outside.walk_trajectory import write_trajectory

    write_json(folder / "config.json", {**config, "versions": versions()})
    write_trajectory(folder / "trajectory.parquet", record)
    write_json(folder / "figures.json", figures)
    if len(record.t) > 1:
        _draw(folder, record, gait, f"{figures['robot']}, {figures['scenario']}", circles)


def _draw(folder: Path, record: Record, gait: Gait, title: str, circles: Sequence[Circle]) -> None:
    from toddle.outside import walk_pictures

    walk_pictures.footprints(folder / "footprints.png", record, gait, circles, title=title)
    walk_pictures.feet_over_time(folder / "feet.png", record, title=f"{title}: interpolated feet")
    walk_pictures.velocity_tracking(folder / "velocity.png", record, title=f"{title}: velocity")
    if record.measured is not None:
        walk_pictures.zmp_error(folder / "zmp_error.png", record, title=f"{title}: zero moment point")


def tell(figures: Mapping[str, Any], folder: Path, *, as_json: bool) -> None:
    """The figures on standard output: one JSON object, or a table."""
    from toddle.outside.files import finite
    from toddle.outside.terminal import print_table

    if as_json:
        print(json.dumps(finite({**figures, "folder": str(folder)})))
        return
    rows = [(name.replace("_", " "), _figure(value)) for name, value in figures.items() if not isinstance(value, dict)]
    print_table(f"{figures['robot']}, {figures['scenario']}", ("", "this run"), rows)
    print(f"figures, trajectory and pictures: {folder}")


def _figure(value: object) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.3g}" if isinstance(value, float) else str(value)
