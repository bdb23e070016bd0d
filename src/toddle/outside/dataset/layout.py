"""What lies where in a LeRobot v3.0 dataset, and what its columns mean.

The format lets each file hold any number of episodes. Here each episode has a file of its own in ``data`` and in
``videos``: it is there whole or not at all, and what befalls one file befalls one episode. An episode counts from the
moment when its file lies in ``data``; ``meta`` follows it, and can be made again from ``data``.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from toddle.navigate.scenarios.rooms import SCENARIOS, Scenario
from toddle.navigate.sight import COLUMNS, PERIOD, ROWS

PICTURE, DEPTH = "observation.images.left", "observation.images.depth"
STATE, ACTION, TAUGHT = "observation.state", "action", "taught"
TIME, PLACE, CIRCLES, PIXELS = "truth.time", "truth.place", "truth.circles", "truth.pixels"

MOST_THINGS = 24
"""As many circles a look can have; rooms have up to 14. Those that are not there have a radius of -1."""

FPS = round(1 / PERIOD)
CHUNK = 1000
"""Files in a folder; rows in a file of `episodes_file`."""

INFO, STATS, TASKS = "meta/info.json", "meta/stats.json", "meta/tasks.parquet"
_DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_VIDEO = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
_EPISODES = "meta/episodes/chunk-000/file-{0:03d}.parquet"
_NUMBERED = re.compile(r"chunk-(\d{3})/file-(\d{3})\.parquet")

ORDERS: dict[Scenario, str] = {
    "straight": "Walk to the fire extinguisher straight ahead.",
    "curve": "Walk to the fire extinguisher ahead, to one side.",
    "obstacle": "Walk around what is in the way to the fire extinguisher.",
    "search": "Look for the fire extinguisher and walk to it.",
    "person": "Walk to the fire extinguisher and touch nobody on the way.",
    "decoys": "Walk to the fire extinguisher, not to other things of its colour.",
}
"""What the robot was to do, by scenario; the task's number is the scenario's place in `SCENARIOS`."""

_VELOCITY = ["vx", "vy", "omega"]


def _column(dtype: str, shape: Sequence[int], names: Any = None, **more: Any) -> dict[str, Any]:
    return {"dtype": dtype, "shape": list(shape), "names": names, **more}


def features() -> dict[str, dict[str, Any]]:
    """The columns, as ``meta/info.json`` tells them."""
    frame = ["height", "width", "channels"]
    # without video.pix_fmt: LeRobot's tools copy these files whole, but refuse to hear of gbrp
    video = {
        "video.height": ROWS, "video.width": COLUMNS, "video.codec": "h264", "video.fps": FPS, "video.channels": 3,
        "is_depth_map": False, "has_audio": False,
    }  # fmt: skip
    deep = {"is_depth_map": True, "depth_unit": "mm"}
    return {
        PICTURE: _column("video", (ROWS, COLUMNS, 3), frame, info=video),
        DEPTH: _column("image", (ROWS, COLUMNS, 1), frame, info=deep),
        STATE: _column("float64", (3,), _VELOCITY),
        ACTION: _column("float64", (3,), _VELOCITY),
        TAUGHT: _column("float64", (3,), _VELOCITY),
        TIME: _column("float64", (1,)),
        PLACE: _column("float64", (3,), ["x", "y", "yaw"]),
        CIRCLES: _column("float64", (3 * MOST_THINGS,)),
        PIXELS: _column("int64", (MOST_THINGS,)),
        "timestamp": _column("float32", (1,)),
        **{name: _column("int64", (1,)) for name in ("frame_index", "episode_index", "index", "task_index")},
    }


def info(episodes: int, frames: int, robot: str) -> dict[str, Any]:
    """``meta/info.json``."""
    return {
        "codebase_version": "v3.0",
        "robot_type": robot,
        "total_episodes": episodes,
        "total_frames": frames,
        "total_tasks": len(SCENARIOS),
        "chunks_size": CHUNK,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": FPS,
        "splits": {"train": f"0:{episodes}"},
        "data_path": _DATA,
        "video_path": _VIDEO,
        "features": features(),
    }


def data_file(folder: Path, number: int) -> Path:
    """Of an episode: all but its pictures."""
    return folder / _DATA.format(chunk_index=number // CHUNK, file_index=number % CHUNK)


def video_file(folder: Path, number: int) -> Path:
    """Of an episode: its pictures."""
    return folder / _VIDEO.format(video_key=PICTURE, chunk_index=number // CHUNK, file_index=number % CHUNK)


def episodes_file(folder: Path, number: int) -> Path:
    """Facts of an episode and its neighbours."""
    return folder / _EPISODES.format(number // CHUNK)


def numbers(folder: Path) -> tuple[int, ...]:
    """Of the episodes whose files lie in ``data``."""
    paths = (path.relative_to(folder / "data").as_posix() for path in folder.glob("data/*/*.parquet"))
    found = (_NUMBERED.fullmatch(path) for path in paths)
    return tuple(sorted(CHUNK * int(match[1]) + int(match[2]) for match in found if match))
