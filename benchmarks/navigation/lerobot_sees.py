"""What LeRobot's own loader sees of a dataset of toddle's; runs where LeRobot is installed, toddle need not be.

    python -m venv lerobot && lerobot/bin/pip install 'lerobot[dataset]'     (3 GB; Python 3.12 or newer)
    lerobot/bin/python benchmarks/navigation/lerobot_sees.py runs/drives seen.npz

Prints what each column of a row is, and keeps every row's arrays under their names, so that they can be set beside what
was written: ``tests/outside/dataset/test_lerobot.py`` does, given that Python in ``TODDLE_LEROBOT_PYTHON``.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
import time
from typing import Any

import numpy as np

_NAMES = (
    "observation.images.left",
    "observation.images.depth",
    "observation.state",
    "action",
    "taught",
    "truth.circles",
)


def main(folder: str, out: str) -> None:
    """Read all rows of a dataset, and write them."""
    os.environ.setdefault("HF_HUB_OFFLINE", "1")
    module = importlib.import_module("lerobot.datasets.lerobot_dataset")
    began = time.perf_counter()
    dataset = module.LeRobotDataset("toddle/drives", root=folder, video_backend="pyav")
    opened = time.perf_counter() - began
    rows = [dataset[number] for number in range(len(dataset))]
    arrays: dict[str, Any] = {name: np.stack([np.asarray(row[name]) for row in rows]) for name in _NAMES}
    arrays["episode_index"] = np.array([int(row["episode_index"]) for row in rows])
    np.savez(out, **arrays)
    told = {
        "lerobot": importlib.import_module("lerobot").__version__,
        "rows": len(dataset),
        "episodes": dataset.num_episodes,
        "lengths": [int(length) for length in dataset.meta.episodes["length"]],
        "fps": dataset.fps,
        "depth_keys": dataset.meta.depth_keys,
        "tasks": sorted({row["task"] for row in rows}),
        "opened_s": opened,
        "row_ms": 1e3 * (time.perf_counter() - began - opened) / len(rows),
        "columns": {name: [str(value.dtype), list(value.shape)] for name, value in rows[0].items() if name != "task"},
    }
    print(json.dumps(told))


if __name__ == "__main__":
    main(*sys.argv[1:3])
