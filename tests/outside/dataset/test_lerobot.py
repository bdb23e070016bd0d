"""LeRobot's own loader reads what was written; where ``TODDLE_LEROBOT_PYTHON`` names a Python that has it."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from drives import drive

from toddle.outside.dataset import layout
from toddle.outside.dataset.pictures import millimetres
from toddle.outside.dataset.writer import Writer

PYTHON = os.environ.get("TODDLE_LEROBOT_PYTHON")
SCRIPT = Path(__file__).parents[3] / "benchmarks" / "navigation" / "lerobot_sees.py"


@pytest.mark.skipif(PYTHON is None, reason="TODDLE_LEROBOT_PYTHON names no Python that has lerobot[dataset]")
def test_lerobot_sees_what_was_written(tmp_path: Path) -> None:
    kept = [drive(seed, 3 + seed, 4 + seed) for seed in range(3)]
    with Writer(tmp_path / "d") as writer:
        for recording in kept:
            writer.add(recording)
    assert PYTHON is not None
    command = [PYTHON, str(SCRIPT), str(tmp_path / "d"), str(tmp_path / "seen.npz")]
    environment = {**os.environ, "HF_HOME": str(tmp_path / "hf")}
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, env=environment)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert (told["rows"], told["episodes"], told["lengths"], told["fps"]) == (12, 3, [3, 4, 5], 5)
    assert told["depth_keys"] == [layout.DEPTH]
    assert told["tasks"] == sorted(layout.ORDERS[one.room.scenario] for one in kept)
    seen = np.load(tmp_path / "seen.npz")
    pictures = np.rint(255 * seen[layout.PICTURE].transpose(0, 2, 3, 1)).astype(np.uint8)
    assert np.array_equal(pictures, np.concatenate([one.picture for one in kept]))
    assert np.array_equal(seen[layout.DEPTH][:, 0], np.concatenate([millimetres(one.depth) for one in kept]))
    assert np.array_equal(seen[layout.ACTION], np.concatenate([one.asked for one in kept]).astype(np.float32))
    circles = seen[layout.CIRCLES].reshape(12, -1, 3)
    assert np.array_equal(circles[:3, :4], kept[0].circles.astype(np.float32))
    assert (circles[:3, 4:, 2] == -1).all()
    assert seen["episode_index"].tolist() == [0] * 3 + [1] * 4 + [2] * 5
