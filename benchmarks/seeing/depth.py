"""Depth through the whole chain against the truth, the document's own setting beside ours, and what trouble is noticed.

    python -m benchmarks.seeing.depth [--seeds 5] [--rooms 10] [--out benchmarks/results/seeing_depth.json]

Each seed turns the document's two cameras, distortion and all, by about a degree, and calibrates them from 60 painted
boards. They then stand somewhere in test rooms of the six scenarios, one of the room's things before them, with noise
of 3 of 255; each room is seen as it is drawn, and with rich, medium and plain surfaces; and in dim light, a quarter of
it, with noise of 6. The pictures are rectified as calibrated. An error is the distance between depth and what the pixel
truly shows, along the axis of the rectified left camera, of pixels that it saw and that show something nearer than
2.5 m; a pixel whose depth is not known counts as 10 m. Confident pixels are the valid ones. A false wall is a confident
pixel that says nearer than 1 m and is wrong by more than 0.25 m. Settings were chosen in training rooms with other
cameras. Milliseconds are CPU time of one thread from two coloured rectified pictures to depth.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from benchmarks.seeing.calibration import calibrated, taken
from benchmarks.seeing.depth_scenes import DIM, LIT, LOOKS, Stage, covered, painters, stand, true_depth
from toddle.geometry.camera import RectifiedCameras
from toddle.navigate.scenarios.draw_rooms import room
from toddle.navigate.scenarios.rooms import SCENARIOS
from toddle.outside.files import write_json
from toddle.outside.machine import machine_in_words
from toddle.outside.versions import versions
from toddle.robots.humanoids import load_humanoid
from toddle.see.chessboard import Chessboard
from toddle.see.depth import LIVE, SETTINGS, depth_of
from toddle.see.painted_boards import misaligned
from toddle.see.rectify import rectification, rectify
from toddle.see.shrink import shrunk
from toddle.see.trouble import Watch, watch
from toddle.signals import DepthImage

NEARER, UNKNOWN, WALL, WRONG = 2.5, 10.0, 1.0, 0.25  # [m]
TIMED = 60
DIM_LOOKS = ("rich", "medium")


class Scene(NamedTuple):
    """A rectified pair and its truth."""

    seed: int
    look: str
    left: np.ndarray
    right: np.ndarray
    truth: np.ndarray
    seen: np.ndarray
    cameras: RectifiedCameras


def scenes(seeds: int, rooms: int) -> Iterator[Scene]:
    """Of every seed, each room in every look."""
    humanoid, board = load_humanoid("heicub"), Chessboard()
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        cameras = misaligned(rng)
        found, _ = calibrated(taken(cameras, board, rng)[0], board)
        made, both = rectification(found.cameras), painters(cameras)
        for number in range(seed * rooms, (seed + 1) * rooms):
            drawn = room(SCENARIOS[number % 6], "test", number, "unseen" if number % 2 else "seen")
            for look in LOOKS:
                stage = Stage(humanoid, covered(drawn, look))
                draw = np.random.default_rng([seed, number])
                stand(stage.simulation, drawn, draw)
                for name, exposure in (("", LIT), ("dim, ", DIM)):
                    if name and look not in DIM_LOOKS:
                        continue
                    pair = stage.take(both, exposure, draw)
                    truth = true_depth(pair.seen, cameras, made)
                    left, right = rectify(made.left, pair.left), rectify(made.right, pair.right)
                    yield Scene(seed, name + look, left, right, truth, made.left.valid, made.cameras)
                stage.close()


def judged(scene: Scene, image: DepthImage) -> dict[str, float]:
    """One depth image against the truth."""
    known = np.isfinite(scene.truth) & scene.seen
    near = known & (scene.truth < NEARER)
    depth = np.where(np.isfinite(image.depth), np.minimum(image.depth, UNKNOWN), UNKNOWN)
    error, sure = np.abs(depth - scene.truth), image.valid & known
    false = sure & (image.depth < WALL) & (error > WRONG)
    small = shrunk(image)
    truth = cv2.resize(np.where(known, scene.truth, np.float32(UNKNOWN)), (80, 60), interpolation=cv2.INTER_AREA)
    there = (truth < NEARER) & (small > 0)
    return {
        "pixels": float(near.sum()), "all": float(error[near].sum()),
        "confident_pixels": float((near & sure).sum()), "confident": float(error[near & sure].sum()),
        "sure": float(sure.sum()), "false_walls": float(false.sum()),
        "small_pixels": float(there.sum()), "small": float(np.abs(small - truth)[there].sum()),
        "small_there": float((truth < NEARER).sum()),
    }  # fmt: skip


def table(rows: list[tuple[int, dict[str, float]]]) -> dict[str, float]:
    """Means over scenes, with standard errors over scenes and the range over calibrations."""
    some = [row for _, row in rows if row["pixels"]]
    each = np.array([row["all"] / row["pixels"] for row in some])
    sure = np.array([row["confident"] / row["confident_pixels"] for row in some if row["confident_pixels"] > 100])
    total = {key: sum(row[key] for row in some) for key in some[0]}
    seeds = {seed for seed, _ in rows}
    of_seed = [np.mean([r["all"] / r["pixels"] for s, r in rows if s == seed and r["pixels"]]) for seed in seeds]
    return {
        "scenes": len(some),
        "all_error_m": float(each.mean()), "all_error_standard_error_m": float(each.std() / np.sqrt(len(each))),
        "all_error_best_calibration_m": float(min(of_seed)), "all_error_worst_calibration_m": float(max(of_seed)),
        "confident_error_m": float(sure.mean()) if len(sure) else float("nan"),
        "confident_error_standard_error_m": float(sure.std() / np.sqrt(len(sure))) if len(sure) else float("nan"),
        "confident_share": total["confident_pixels"] / total["pixels"],
        "false_wall_percent": 100 * total["false_walls"] / max(total["sure"], 1.0),
        "small_error_m": total["small"] / max(total["small_pixels"], 1.0),
        "small_share": total["small_pixels"] / total["small_there"],
    }  # fmt: skip


def milliseconds(scene: Scene) -> dict[str, dict[str, float]]:
    """CPU time of each setting."""
    told = {}
    for name, setting in SETTINGS.items():
        spent = []
        for _ in range(TIMED):
            start = time.process_time()
            depth_of(scene.left, scene.right, scene.cameras, setting, seen=scene.seen)
            spent.append(1000 * (time.process_time() - start))
        told[name] = {"min": float(min(spent)), "median": float(np.median(spent))}
    return told


def spoiled(scene: Scene, rng: np.random.Generator) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """The pair as it is and in each kind of trouble."""
    left, right = scene.left, scene.right
    if scene.look.startswith("dim"):
        return {"dark": (left, right)}
    hidden = np.where(right > 0, noisy(np.full(right.shape, 12.0), rng), np.uint8(0))
    blank = [noisy(cv2.GaussianBlur(one, (0, 0), 30).astype(float), rng) for one in (left, right)]
    white = [np.clip(3 * one.astype(int), 0, 255).astype(np.uint8) for one in (left, right)]
    turn = cv2.getRotationMatrix2D((160, 120), 1, 1)
    return {
        "none": (left, right), "swapped": (right, left), "covered": (left, hidden), "saturated": (white[0], white[1]),
        "textureless": (blank[0], blank[1]), "misaligned by 1 px": (left, np.roll(right, 1, axis=0)),
        "misaligned by 1 degree": (left, cv2.warpAffine(right, turn, (320, 240)).astype(np.uint8)),
    }  # fmt: skip


def noisy(light: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return np.clip(np.rint(light + LIT.noise * rng.normal(size=light.shape)), 0, 255).astype(np.uint8)


class Noticing:
    """Counts what is said of each frame alone, and of five looks, a second apart, in five rooms."""

    def __init__(self) -> None:
        self.frames: dict[str, list[tuple[str, ...]]] = defaultdict(list)
        self.watched: dict[str, list[tuple[str, ...]]] = defaultdict(list)
        self._watches: dict[tuple[str, str], tuple[int, Watch]] = {}
        self._rng = np.random.default_rng(7)

    def look(self, scene: Scene) -> None:
        """One more scene."""
        for name, (left, right) in spoiled(scene, self._rng).items():
            image = depth_of(left, right, scene.cameras, LIVE, seen=scene.seen)
            key = (f"{name} ({scene.look})" if name in ("none", "dark") else name, scene.look)
            count, before = self._watches.get(key, (0, Watch()))
            now = watch(before, left, right, image, float(count))
            self.frames[key[0]].append(image.trouble)
            if count == 4:
                self.watched[key[0]].append(now.trouble)
            self._watches[key] = ((count + 1) % 5, Watch() if count == 4 else now)

    def told(self) -> dict[str, Any]:
        """How often each kind was said."""
        return {
            name: {"frames": shares(self.frames[name]), "watched_five_seconds": shares(self.watched[name])}
            for name in self.frames
        }


def shares(said: list[tuple[str, ...]]) -> dict[str, Any]:
    kinds = Counter(one.partition(":")[0] for frame in said for one in frame)
    return {"count": len(said), "silent": sum(not frame for frame in said), "said": dict(kinds)}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--rooms", type=int, default=10)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/seeing_depth.json"))
    asked = parser.parse_args()
    cv2.setNumThreads(1)
    rows: dict[str, dict[str, list[tuple[int, dict[str, float]]]]] = defaultdict(lambda: defaultdict(list))
    noticing, timed = Noticing(), None
    for number, scene in enumerate(scenes(asked.seeds, asked.rooms)):
        for name, setting in SETTINGS.items():
            image = depth_of(scene.left, scene.right, scene.cameras, setting, seen=scene.seen)
            rows[name][scene.look].append((scene.seed, judged(scene, image)))
        if scene.look != "plain":
            noticing.look(scene)
        timed = milliseconds(scene) if timed is None and scene.look == "medium" else timed
        print(number, scene.seed, scene.look, flush=True)
    content = {
        "benchmark": "seeing_depth",
        "what": "depth of stereo pictures through the whole chain, against the truth; trouble with the cameras noticed",
        "document": {"milliseconds": 7.4},
        "remark": " ".join((__doc__ or "").split("\n\n")[2].split()),
        "depth": {name: {look: table(of) for look, of in looks.items()} for name, looks in rows.items()},
        "milliseconds": timed,
        "trouble": noticing.told(),
        "seeds": list(range(asked.seeds)),
        "command": f"python -m benchmarks.seeing.depth --seeds {asked.seeds} --rooms {asked.rooms}",
        "machine": machine_in_words(),
        "versions": versions(),
    }
    write_json(asked.out, content)
    print(json.dumps({key: content[key] for key in ("depth", "milliseconds", "trouble")}, indent=1))


if __name__ == "__main__":
    main()
