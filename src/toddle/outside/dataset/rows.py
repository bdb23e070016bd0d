"""An episode as a Parquet file: a row for each look, and facts that also tell whether a byte of it has changed."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from jaxtyping import Shaped, UInt16

from toddle.failures import BadInput
from toddle.navigate.cloning.recording import Recording, RoomKey
from toddle.navigate.scenarios.rooms import SCENARIOS, SPLITS, STYLES
from toddle.navigate.sight import COLUMNS, ROWS
from toddle.navigate.task import Outcome
from toddle.outside.dataset import layout, pictures

_FACTS = b"toddle"
_VERSION = 1
_VECTORS = {layout.STATE: "velocity", layout.ACTION: "asked", layout.TAUGHT: "taught", layout.PLACE: "place"}


class Facts(NamedTuple):
    """Of an episode, what is no array.

    Attributes:
        room: where.
        driver: who steered.
        seed: of the drive.
        outcome: how it ended.
        looks: rows.
        things: circles in each row.
        video: SHA-256 of its video.
        digest: SHA-256 of all else.
    """

    room: RoomKey
    driver: str
    seed: int
    outcome: Outcome
    looks: int
    things: int
    video: str
    digest: str = ""


class Damaged(BadInput):
    """An episode that can't be read as it was written."""


def checked(recording: Recording) -> Recording:
    """The same recording.

    Raises:
        BadInput: it can't be kept.
    """
    looks = len(recording.t)
    things = recording.circles.shape[1] if recording.circles.ndim == 3 else -1
    shapes = {
        "t": (looks,), "picture": (looks, ROWS, COLUMNS, 3), "depth": (looks, ROWS, COLUMNS),
        "circles": (looks, things, 3), "pixels": (looks, things), **dict.fromkeys(_VECTORS.values(), (looks, 3)),
    }  # fmt: skip
    wrong = [name for name, shape in shapes.items() if getattr(recording, name).shape != shape]
    what = ""
    if not looks:
        what = "it holds no look"
    elif wrong:
        what = f"its {wrong[0]} has the shape {getattr(recording, wrong[0]).shape}"
    elif things > layout.MOST_THINGS:
        what = f"it has {things} circles, more than {layout.MOST_THINGS}"
    else:
        for name in ("t", "depth", "velocity", "asked", "taught"):
            if not np.isfinite(getattr(recording, name)).all():
                what = f"its {name} is not finite"
    if what:
        raise BadInput(f"the recording can't be kept: {what}", where=_called(recording.room))
    return recording


def _called(room: RoomKey) -> str:
    return f"{room.scenario} {room.number} of {room.split}, {room.style}"


def write_rows(path: Path, recording: Recording, number: int, first: int, video: Path) -> Facts:
    """Write an episode without its pictures.

    Args:
        path: where; not yet under its final name.
        recording: `checked`.
        number: of the episode.
        first: rows of all episodes before it.
        video: its pictures, written.
    """
    looks, things = recording.circles.shape[:2]
    depth = pictures.millimetres(recording.depth)
    facts = Facts(
        recording.room, recording.driver, recording.seed, recording.outcome, looks, things,
        hashlib.sha256(video.read_bytes()).hexdigest(),
    )  # fmt: skip
    facts = facts._replace(digest=_digest(facts, recording, depth))
    said = {"version": _VERSION, **facts._asdict(), "room": recording.room._asdict(), "outcome": facts.outcome.name}
    table = _table(recording, depth, number, first).replace_schema_metadata({_FACTS: json.dumps(said).encode()})
    pq.write_table(table, path, compression="zstd", write_page_checksum=True)
    return facts


def _table(recording: Recording, depth: UInt16[np.ndarray, "looks rows columns"], number: int, first: int) -> pa.Table:
    looks, things = recording.circles.shape[:2]
    circles = np.tile(np.array([0.0, 0.0, -1.0]), (looks, layout.MOST_THINGS, 1))
    circles[:, :things] = recording.circles
    pixels = np.zeros((looks, layout.MOST_THINGS), np.int64)
    pixels[:, :things] = recording.pixels
    files = [{"bytes": pictures.png(one), "path": None} for one in depth]
    frame = np.arange(looks)
    columns: dict[str, pa.Array] = {
        layout.DEPTH: pa.array(files, pa.struct({"bytes": pa.binary(), "path": pa.string()})),
        **{column: _vectors(np.asarray(getattr(recording, name), float)) for column, name in _VECTORS.items()},
        layout.TIME: pa.array(np.asarray(recording.t, float)),
        layout.CIRCLES: _vectors(circles.reshape(looks, -1)),
        layout.PIXELS: _vectors(pixels),
        "timestamp": pa.array((frame / layout.FPS).astype(np.float32)),
        "frame_index": pa.array(frame),
        "episode_index": pa.array(np.full(looks, number)),
        "index": pa.array(first + frame),
        "task_index": pa.array(np.full(looks, SCENARIOS.index(recording.room.scenario))),
    }
    order = [name for name in layout.features() if name != layout.PICTURE]
    return pa.table({name: columns[name] for name in order})


def _vectors(rows: Shaped[np.ndarray, "looks numbers"]) -> pa.Array:
    return pa.FixedSizeListArray.from_arrays(pa.array(np.ascontiguousarray(rows).ravel()), rows.shape[1])


def _digest(facts: Facts, recording: Recording, depth: UInt16[np.ndarray, "looks rows columns"]) -> str:
    """Of all that a recording is, but for its pictures."""
    found = hashlib.sha256(json.dumps(facts._replace(digest="")).encode())
    names = ("t", "velocity", "asked", "taught", "place", "circles")
    for array in (*(np.asarray(getattr(recording, name), float) for name in names), recording.pixels.astype(np.int64)):
        found.update(np.ascontiguousarray(array).tobytes())
    found.update(depth.tobytes())
    return found.hexdigest()


def read_facts(path: Path, where: str) -> Facts:
    """The facts of an episode; none of its rows is read.

    Raises:
        Damaged: there are none to read.
    """
    try:
        with path.open("rb") as file:
            said = json.loads((pq.read_schema(file).metadata or {})[_FACTS])
    except FileNotFoundError:
        raise Damaged("its file in data is gone", where=where) from None
    except (OSError, pa.ArrowException, KeyError, ValueError, RecursionError) as fault:
        raise Damaged("its file in data was altered or cut short", where=where) from fault
    return _facts(said, where)


def _facts(said: Any, where: str) -> Facts:
    """Facts from JSON, believed in nothing."""
    try:
        if said.pop("version") != _VERSION:
            raise Damaged("a newer toddle wrote it", where=where, remedy="update toddle")
        room = RoomKey(**said.pop("room"))
        known = room.scenario in SCENARIOS and room.split in SPLITS and room.style in STYLES
        facts = Facts(**said, room=room)._replace(outcome=Outcome[said["outcome"]])
        whole = all(isinstance(value, int) for value in (facts.seed, facts.looks, facts.things, room.number))
        words = all(isinstance(value, str) for value in (facts.driver, facts.video, facts.digest))
        if known and whole and words and facts.looks > 0 and 0 <= facts.things <= layout.MOST_THINGS:
            return facts
    except (AttributeError, TypeError, KeyError, ValueError):
        pass
    raise Damaged("what its file in data tells makes no sense", where=where)


def read_rows(path: Path, where: str) -> tuple[Facts, Recording]:
    """An episode whose pictures are still missing (they are of no size).

    Raises:
        Damaged: a byte of it has changed, or it is gone.
    """
    facts = read_facts(path, where)
    try:
        with path.open("rb") as file:
            table = pq.read_table(file, page_checksum_verification=True, use_threads=False)
        recording, depth = _recording(table, facts)
    except (OSError, pa.ArrowException, KeyError, ValueError, TypeError, AttributeError) as fault:
        raise Damaged("its file in data was altered or cut short", where=where) from fault
    if _digest(facts, recording, depth) != facts.digest:
        raise Damaged("its file in data was altered", where=where)
    return facts, recording


def _recording(table: pa.Table, facts: Facts) -> tuple[Recording, UInt16[np.ndarray, "looks rows columns"]]:
    looks, things = facts.looks, facts.things
    files = [pictures.from_png(one["bytes"]) for one in table[layout.DEPTH].to_pylist()]
    depth = np.array(files, np.uint16).reshape(looks, ROWS, COLUMNS)
    circles = _numbers(table, layout.CIRCLES, looks, 3 * layout.MOST_THINGS).reshape(looks, -1, 3)[:, :things]
    pixels = _numbers(table, layout.PIXELS, looks, layout.MOST_THINGS)[:, :things].astype(np.int64)
    vectors = {name: _numbers(table, column, looks, 3) for column, name in _VECTORS.items()}
    recording = Recording(
        facts.room, facts.driver, facts.seed, facts.outcome, _numbers(table, layout.TIME, looks, 1)[:, 0],
        np.zeros((looks, ROWS, COLUMNS, 3), np.uint8), pictures.metres(depth), **vectors, circles=circles.copy(),
        pixels=pixels,
    )  # fmt: skip
    return recording, depth


def _numbers(table: pa.Table, column: str, looks: int, width: int) -> Shaped[np.ndarray, "looks width"]:
    """A column as an array of its own, which may be written to."""
    flat = table[column].combine_chunks()
    while pa.types.is_list(flat.type) or pa.types.is_fixed_size_list(flat.type):
        flat = flat.flatten()
    return flat.to_numpy(zero_copy_only=False).reshape(looks, width).copy()
