"""What ``meta`` tells of a dataset: a row for each episode, statistics of all, and how many there are."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import pyarrow as pa
import pyarrow.parquet as pq

from toddle.navigate.scenarios.rooms import SCENARIOS
from toddle.outside.dataset import layout
from toddle.outside.dataset.rows import Facts
from toddle.outside.dataset.statistics import Statistics, together
from toddle.outside.files import write_json

Row = dict[str, Any]
"""Of an episode, under the names that LeRobot gives, and a few of ours."""

Made = TypeVar("Made")

_STATISTICS = "stats/"


def tell(folder: Path, rows: Sequence[Row], number: int, robot: str) -> None:
    """Write what ``meta`` tells, as far as an episode changes it; how many there are comes last.

    Args:
        folder: of the dataset.
        rows: of all episodes.
        number: of the episode.
        robot: whose they are.
    """
    path = layout.episodes_file(folder, number)
    path.parent.mkdir(parents=True, exist_ok=True)
    if not (folder / layout.TASKS).exists():
        written(folder / layout.TASKS, _write_tasks)
    if rows:
        begin = number - number % layout.CHUNK
        table = pa.Table.from_pylist(list(rows[begin : begin + layout.CHUNK]))
        written(path, lambda part: pq.write_table(table, part, write_page_checksum=True))
        write_json(folder / layout.STATS, together([_statistics(row) for row in rows]))
    frames = rows[-1]["dataset_to_index"] if rows else 0
    write_json(folder / layout.INFO, layout.info(len(rows), frames, robot))


def known_rows(folder: Path) -> list[Row]:
    """What ``meta`` tells of the episodes, as far as it can be read."""
    rows: list[Row] = []
    while (path := layout.episodes_file(folder, len(rows))).exists():
        try:
            with path.open("rb") as file:
                more = pq.read_table(file, page_checksum_verification=True, use_threads=False).to_pylist()
        except (OSError, pa.ArrowException):
            break
        if not _follows(rows, more):
            break
        rows += more
        if len(rows) % layout.CHUNK:
            break
    return rows


def _follows(rows: list[Row], more: list[Row]) -> bool:
    """Whether these rows could come after those."""
    at = rows[-1]["dataset_to_index"] if rows else 0
    for number, row in enumerate(more, start=len(rows)):
        if row.get("episode_index") != number or row.get("dataset_from_index") != at:
            return False
        if row.get("dataset_to_index") != at + row.get("length", -1) or "outcome" not in row:
            return False
        at = row["dataset_to_index"]
    return bool(more)


def row_of(number: int, first: int, facts: Facts, found: Statistics) -> Row:
    """What ``meta/episodes`` tells of an episode."""
    place = {"chunk_index": number // layout.CHUNK, "file_index": number % layout.CHUNK}
    video = {**place, "from_timestamp": 0.0, "to_timestamp": facts.looks / layout.FPS}
    return {
        "episode_index": number,
        "tasks": [layout.ORDERS[facts.room.scenario]],
        "length": facts.looks,
        "dataset_from_index": first,
        "dataset_to_index": first + facts.looks,
        **{f"data/{name}": value for name, value in place.items()},
        **{f"videos/{layout.PICTURE}/{name}": value for name, value in video.items()},
        "meta/episodes/chunk_index": 0,
        "meta/episodes/file_index": number // layout.CHUNK,
        **facts.room._asdict(),
        "driver": facts.driver,
        "seed": facts.seed,
        "outcome": facts.outcome.name.lower(),
        **{f"{_STATISTICS}{column}/{name}": v for column, of in found.items() for name, v in of.items()},
    }


def _statistics(row: Row) -> Statistics:
    """The statistics in a row."""
    found: dict[str, dict[str, Any]] = {}
    for key, value in row.items():
        if key.startswith(_STATISTICS):
            column, name = key.removeprefix(_STATISTICS).rsplit("/", 1)
            found.setdefault(column, {})[name] = value
    return found


def _write_tasks(path: Path) -> None:
    """The orders by number, as pandas would write them with the order as the index."""
    orders = [layout.ORDERS[scenario] for scenario in SCENARIOS]
    told = {
        "index_columns": ["task"],
        "columns": [
            {"name": "task_index", "field_name": "task_index", "pandas_type": "int64", "numpy_type": "int64"},
            {"name": "task", "field_name": "task", "pandas_type": "unicode", "numpy_type": "object"},
        ],
        "column_indexes": [],
    }
    table = pa.table({"task_index": pa.array(range(len(orders)), pa.int64()), "task": orders})
    pq.write_table(table.replace_schema_metadata({b"pandas": json.dumps(told).encode()}), path)


def written(path: Path, write: Callable[[Path], Made]) -> Made:
    """A file under its name once it is whole, and on the disk."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        found = write(part)
        with part.open("rb+") as file:
            os.fsync(file.fileno())
        os.replace(part, path)
        return found
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)
