"""What keeping a drive costs: bytes, time, and what other codecs would make of the pictures.

    toddle navigate record --episodes 18 --noise 0.5 --anywhere 0.3 --seed 0 --out runs/drives
    python -m benchmarks.navigation.dataset runs/drives --out benchmarks/results/navigation_dataset.json

Every codec gets the pictures of all episodes, as many files as there are episodes, and is read back by OpenCV. PSNR is
over all pixels; ``red`` is over those that are clearly red, which mark the target. Then the episodes are written again
and again into one dataset, to see whether the last ones take longer than the first, and read. CPU times.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import imageio_ffmpeg
import numpy as np

from toddle.navigate.cloning.recording import Recording
from toddle.outside.dataset import layout
from toddle.outside.dataset.pictures import millimetres, png, read_video
from toddle.outside.dataset.reader import read_dataset
from toddle.outside.dataset.writer import Writer
from toddle.outside.versions import versions

RECORDED = "toddle navigate record --episodes 18 --noise 0.5 --anywhere 0.3 --seed 0 --out runs/drives"

CODECS = {
    "H.264 RGB, no loss (ours)": ("libx264rgb", "rgb24", "-qp 0 -preset veryfast -g 10 -bf 0"),
    "H.264 RGB, no loss, slow": ("libx264rgb", "rgb24", "-qp 0 -preset veryslow"),
    "H.264 4:4:4, crf 10": ("libx264", "yuv444p", "-crf 10"),
    "H.264 4:4:4, crf 18": ("libx264", "yuv444p", "-crf 18"),
    "H.264 4:2:0, crf 18": ("libx264", "yuv420p", "-crf 18"),
    "H.264 4:2:0, crf 23": ("libx264", "yuv420p", "-crf 23"),
    "PNG": ("png", "rgb24", ""),
}


def encoded(recording: Recording, codec: str, path: Path) -> None:
    """One episode's pictures by another codec."""
    name, pixels, options = CODECS[codec]
    command = [
        imageio_ffmpeg.get_ffmpeg_exe(), "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24",
        "-s", "80x60", "-r", "5", "-i", "-", "-c:v", name, "-pix_fmt", pixels, *options.split(),
        "-threads", "1", str(path),
    ]  # fmt: skip
    subprocess.run(command, input=recording.picture.tobytes(), check=True)


def psnr(errors: np.ndarray) -> float | None:
    """Peak signal to noise [dB] of squared errors; None: there are none."""
    mean = float(errors.mean())
    return 10 * np.log10(255**2 / mean) if mean > 0 else None


def codecs(recordings: Sequence[Recording], folder: Path) -> list[dict[str, Any]]:
    """A row for each codec."""
    looks, rows = sum(len(one.t) for one in recordings), []
    for codec in CODECS:
        size, errors, red, took = 0, [], [], 0.0
        for one in recordings:
            path = folder / "one.mp4"
            encoded(one, codec, path)
            size += path.stat().st_size
            began = time.process_time()
            read = read_video(path)
            took += time.process_time() - began
            error = (read.astype(float) - one.picture) ** 2
            r, g, b = np.moveaxis(one.picture.astype(int), -1, 0)
            errors.append(error.ravel())
            red.append(error[(r > 90) & (r > 2 * g) & (r > 2 * b)].ravel())
        rows.append(
            {
                "codec": codec, "bytes_per_look": size / looks, "read_ms_per_look": 1e3 * took / looks,
                "psnr_db": psnr(np.concatenate(errors)), "psnr_red_db": psnr(np.concatenate(red)),
                "worst": float(max(error.max() for error in errors)) ** 0.5,
            }
        )  # fmt: skip
    return rows


def kept(recordings: Sequence[Recording], count: int, folder: Path) -> dict[str, Any]:
    """Many episodes in one dataset: the time that each took, by itself and in all."""
    took = []
    with Writer(folder) as writer:
        for number in range(count):
            began = time.process_time()
            writer.add(recordings[number % len(recordings)])
            took.append(time.process_time() - began)
    began = time.process_time()
    Writer(folder).close()
    opened = time.process_time() - began
    began = time.process_time()
    looks = sum(len(one.t) for _, one in read_dataset(folder, lambda fault: None))
    read = time.process_time() - began
    few = len(recordings)
    files = [path for path in folder.rglob("*") if path.is_file()]
    return {
        "episodes": count, "looks": looks, "files": len(files),
        "bytes_per_look": sum(path.stat().st_size for path in files) / looks,
        "write_ms_per_episode_first": 1e3 * float(np.mean(took[:few])),
        "write_ms_per_episode_last": 1e3 * float(np.mean(took[-few:])),
        "open_again_ms": 1e3 * opened, "read_ms_per_look": 1e3 * read / looks,
    }  # fmt: skip


def main() -> None:
    """Measure, print and keep."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--episodes", type=int, default=200)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    recordings = [one for _, one in read_dataset(asked.folder, lambda fault: None)]
    depth = [len(png(one)) for recording in recordings for one in millimetres(recording.depth)]
    with tempfile.TemporaryDirectory() as folder:
        result = {
            "command": f"{RECORDED} && python -m benchmarks.navigation.dataset runs/drives --episodes {asked.episodes}",
            "source": {"episodes": len(recordings), "looks": len(depth)},
            "codecs": codecs(recordings, Path(folder)),
            "depth_png_bytes_per_look": float(np.mean(depth)),
            "kept": kept(recordings, asked.episodes, Path(folder) / "kept"),
            "layout": {"files_in_a_folder": layout.CHUNK, "looks_per_second": layout.FPS},
            "versions": versions(),
        }
    print(json.dumps(result, indent=2))
    if asked.out:
        asked.out.write_text(json.dumps(result, indent=2) + "\n")


if __name__ == "__main__":
    main()
