"""Two cameras calibrated from painted boards, whose truth is known: how near does it come?

    python -m benchmarks.seeing.calibration [--seeds 8] [--out benchmarks/results/seeing_calibration.json]

The document's two cameras, distortion and all, are turned from each other by about a degree (drawn anew for each seed)
and see boards of 8 by 6 corners with noise of 3 of 255. Four rows: 60 pairs in which the board is found; the same with
18 spoiled (6 blurred, 6 partly hidden, 6 moved by up to 3 to 8 mm between the exposures); those again with nothing
dropped that shows a board, as a control; and the first 16 pairs alone. True figures are of points that no board
touched, 0.5 to 2.5 m away.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from toddle.failures import ToddleError
from toddle.geometry.camera import StereoCameras
from toddle.outside.versions import versions
from toddle.see.calibrate import Calibration, Dropped, calibrate
from toddle.see.chessboard import Chessboard
from toddle.see.gate import judge
from toddle.see.lens import pixels_of
from toddle.see.painted_boards import Shown, misaligned, shown_boards
from toddle.see.rectify import rectification, rectified_points
from toddle.see.sightings import sharp, sight

SIZE, PAIRS, SPOILED, FEW = (320, 240), 60, 6, 16
BASELINE = 0.068
WAYS = ("blurred", "hidden", "moved")


class Pair(NamedTuple):
    """Two pictures and what was done to them."""

    name: str
    left: np.ndarray
    right: np.ndarray


def taken(cameras: StereoCameras, board: Chessboard, rng: np.random.Generator) -> tuple[list[Pair], list[Shown], int]:
    """Pairs in which the board is found, and how many had to be taken."""
    pairs: list[Pair] = []
    boards: list[Shown] = []
    for tried, shown in enumerate(shown_boards(cameras, board, rng), start=1):
        if not isinstance(sight("", shown.left, shown.right, board), Dropped):
            pairs.append(Pair(f"good{len(pairs):02d}", shown.left, shown.right))
            boards.append(shown)
        if len(pairs) == PAIRS:
            return pairs, boards, tried
    raise AssertionError("boards have no end")


def spoil(
    pairs: Sequence[Pair], boards: Sequence[Shown], cameras: StereoCameras, board: Chessboard, rng: np.random.Generator
) -> list[Pair]:
    """18 of the pairs blurred, hidden or exchanged for moved ones; the rest as they are."""
    spoiled = list(pairs)
    chosen = rng.permutation(len(pairs))[: SPOILED * len(WAYS)].reshape(len(WAYS), -1)
    for way, numbers in zip(WAYS, chosen, strict=True):
        for number in numbers:
            left, right = pairs[number].left, pairs[number].right
            if way == "blurred":
                size = int(rng.integers(7, 12))
                right = cv2.filter2D(right, -1, np.eye(size) / size)  # the head turned while the shutter was open
            elif way == "hidden":
                low, high = boards[number].corners[0].min(axis=0), boards[number].corners[0].max(axis=0)
                middle, half = (low + high) / 2, (high - low) / 4
                (x, y), (across, down) = (middle + rng.uniform(-1, 1, 2) * half).astype(int), half.astype(int) + 1
                left = left.copy()
                left[max(y - down, 0) : y + down, max(x - across, 0) : x + across] = 90
            else:
                left, right = moved(cameras, board, rng)
            spoiled[number] = Pair(f"{way}{number:02d}", left, right)
    return spoiled


def moved(cameras: StereoCameras, board: Chessboard, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A board that moved by up to 3 to 8 mm between the two exposures, and is found in both."""
    shift = float(rng.uniform(0.003, 0.008))
    for shown in shown_boards(cameras, board, rng, moved=shift):
        if not isinstance(sight("", shown.left, shown.right, board), Dropped):
            return shown.left, shown.right
    raise AssertionError("boards have no end")


def calibrated(pairs: Sequence[Pair], board: Chessboard) -> tuple[Calibration, tuple[Dropped, ...]]:
    """The whole chain, from pictures on; and what never came to be calibrated from."""
    looked = [sight(*pair, board) for pair in pairs]
    views, blurred = sharp([one for one in looked if not isinstance(one, Dropped)])
    unseen = tuple(one for one in looked if isinstance(one, Dropped))
    return calibrate(views, board, SIZE), (*unseen, *blurred)


def everything(pairs: Sequence[Pair], board: Chessboard) -> tuple[Calibration, tuple[Dropped, ...]]:
    """The same with nothing dropped that shows a board."""
    looked = [sight(*pair, board) for pair in pairs]
    views = [one.view for one in looked if not isinstance(one, Dropped)]
    return calibrate(views, board, SIZE, outlying=float("inf")), ()


def truth(found: Calibration, cameras: StereoCameras) -> dict[str, float]:
    """Of points that both true cameras see: how far their rows are apart, and the error of their depth."""
    x, y, z = np.meshgrid(np.linspace(-0.5, 0.5, 9), np.linspace(-0.35, 0.35, 7), np.linspace(0.5, 2.5, 9))
    points = np.stack([x * z, y * z, z], axis=-1).reshape(-1, 3)
    seen = pixels_of(cameras.left, points), pixels_of(cameras.right, points @ cameras.rotation.T + cameras.translation)
    inside = np.all([(s >= 0) & (s <= np.array(SIZE) - 1) for s in seen], axis=(0, 2))
    made = rectification(found.cameras)
    ideal = made.cameras.camera
    left, right = (
        rectified_points(camera, turn, ideal, pixels[inside])
        for camera, turn, pixels in zip((found.cameras.left, found.cameras.right), made.rotations, seen, strict=True)
    )
    there = points[inside] @ made.rotations[0].T
    far = there[:, 2] > 2.2
    off = made.cameras.depth(left[:, 0] - right[:, 0]) - there[:, 2]
    rows = np.abs(left[:, 1] - right[:, 1])
    return {
        "true_rows_apart_median_px": float(np.median(rows)),
        "true_rows_apart_p95_px": float(np.percentile(rows, 95)),
        "true_depth_error_mean_m": float(np.mean(np.abs(off))),
        "true_depth_error_far_percent": float(100 * np.mean(off[far] / there[far, 2])),
    }


def figures(found: Calibration, gone: Sequence[Dropped], cameras: StereoCameras, board: Chessboard) -> dict[str, Any]:
    judged = judge(found.held_out, board, found.cameras)
    dropped = [one.name for one in (*gone, *found.dropped)]
    return {
        "used": len(found.views), "held_out": len(found.held_out),
        "dropped": {way: sum(name.startswith(way) for name in dropped) for way in ("good", *WAYS)},
        "reprojection_left_px": found.alone[0], "reprojection_right_px": found.alone[1],
        "reprojection_stereo_px": found.together,
        "baseline_off_mm": 1000 * (found.cameras.baseline - BASELINE),
        "held_out_rows_apart_median_px": judged.misalignment, "held_out_rows_apart_mean_px": judged.misalignment_mean,
        "gate_depth_error_percent": 100 * judged.depth, "gate_unsure_percent": 100 * judged.depth_unsure,
        "trusted": not judged.trouble, **truth(found, cameras),
    }  # fmt: skip


def one_seed(seed: int) -> dict[str, Any]:
    rng = np.random.default_rng(seed)
    board, cameras = Chessboard(), misaligned(rng, baseline=BASELINE)
    pairs, boards, tried = taken(cameras, board, rng)
    spoiled = spoil(pairs, boards, cameras, board, rng)
    rows: dict[str, Any] = {"seed": seed, "taken": tried}
    for name, chain, some in (
        ("clean", calibrated, pairs), ("spoiled", calibrated, spoiled),
        ("spoiled, nothing dropped", everything, spoiled), ("first 16", calibrated, pairs[:FEW]),
    ):  # fmt: skip
        began = time.process_time()
        try:
            found, gone = chain(some, board)
            rows[name] = {**figures(found, gone, cameras, board), "cpu_seconds": time.process_time() - began}
        except ToddleError as fault:
            rows[name] = {"refused": fault.line}
    return rows


def spread(rows: Sequence[dict[str, Any]], name: str) -> dict[str, Any]:
    """Over the seeds: mean, least and greatest of each figure."""
    found = [row[name] for row in rows if "refused" not in row[name]]
    told: dict[str, Any] = {"seeds": len(rows), "refused": len(rows) - len(found)}
    for key in found[0] if found else ():
        if key == "dropped":
            told[key] = {way: sum(one[key][way] for one in found) for way in found[0][key]}
        else:
            values = np.array([one[key] for one in found], dtype=float)
            told[key] = {"mean": float(values.mean()), "least": float(values.min()), "most": float(values.max())}
    return told


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/seeing_calibration.json"))
    asked = parser.parse_args()
    rows = []
    for seed in range(asked.seeds):
        rows.append(one_seed(seed))
        print(json.dumps(rows[-1]), flush=True)
    content = {
        "benchmark": "seeing_calibration",
        "what": "two cameras calibrated from painted chessboards, against the truth",
        "document": {"reprojection_left_px": 0.26, "reprojection_right_px": 0.25, "pairs": 60},
        "summary": {name: spread(rows, name) for name in rows[0] if name not in ("seed", "taken")},
        "rows": rows,
        "versions": versions(),
        "command": f"python -m benchmarks.seeing.calibration --seeds {asked.seeds}",
    }
    asked.out.write_text(json.dumps(content, indent=1) + "\n")
    print(f"wrote {asked.out}")


if __name__ == "__main__":
    main()
