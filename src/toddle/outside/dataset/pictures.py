"""Small pictures as a video without loss, and depth as PNG with 16 bits, in millimetres.

The video is H.264 in RGB at quantiser 0 (High 4:4:4 Predictive), which players of this format decode exactly. It costs
three times the bytes of what an eye would call the same, and a colour that marks the target survives.
"""

from __future__ import annotations

import subprocess
import warnings
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float32, UInt8, UInt16

from toddle.failures import ToddleError
from toddle.outside.dataset.layout import FPS

FARTHEST = 65.535
"""Depth beyond it is kept as this [m]."""

_KEY = 10  # pictures from one that stands alone to the next


def write_video(path: Path, pictures: UInt8[np.ndarray, "looks rows columns 3"]) -> None:
    """Encode pictures into an MP4.

    Raises:
        ToddleError: ffmpeg refused.
    """
    import imageio_ffmpeg

    rows, columns = pictures.shape[1:3]
    command = [
        imageio_ffmpeg.get_ffmpeg_exe(), "-hide_banner", "-loglevel", "error", "-y",
        "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{columns}x{rows}", "-r", str(FPS), "-i", "-",
        "-c:v", "libx264rgb", "-qp", "0", "-preset", "veryfast", "-g", str(_KEY), "-bf", "0", "-threads", "1",
        "-fflags", "+bitexact", "-flags:v", "+bitexact", "-f", "mp4", str(path),
    ]  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # JAX warns of any fork; this one becomes ffmpeg at once
        done = subprocess.run(
            command, input=np.ascontiguousarray(pictures).tobytes(), capture_output=True,
            start_new_session=True,  # Ctrl-C is not meant for it
        )  # fmt: skip
    if done.returncode:
        said = done.stderr.decode(errors="replace").strip().partition("\n")[0]
        raise ToddleError(f"the pictures can't be written ({said or done.returncode})", where=str(path))


def read_video(path: Path) -> UInt8[np.ndarray, "looks rows columns 3"]:
    """All pictures of an MP4; none where it can't be opened."""
    film = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    pictures = []
    try:
        while True:
            there, picture = film.read()
            if not there:
                break
            pictures.append(picture[..., ::-1])
    finally:
        film.release()
    return np.array(pictures, np.uint8).reshape(-1, *(pictures[0].shape if pictures else (1, 1, 3)))


def millimetres(depth: Float32[np.ndarray, "*looks rows columns"]) -> UInt16[np.ndarray, "*looks rows columns"]:
    """Depth as it is kept."""
    return np.rint(1000 * np.clip(depth.astype(float), 0.0, FARTHEST)).astype(np.uint16)


def metres(depth: UInt16[np.ndarray, "*looks rows columns"]) -> Float32[np.ndarray, "*looks rows columns"]:
    """Depth as it is read."""
    return (depth / 1000).astype(np.float32)


def png(depth: UInt16[np.ndarray, "rows columns"]) -> bytes:
    """One depth map as a file."""
    return cv2.imencode(".png", depth)[1].tobytes()


def from_png(content: bytes) -> UInt16[np.ndarray, "rows columns"] | None:
    """The depth map of a file; None: it is none."""
    found = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED) if content else None
    return found if found is not None and found.dtype == np.uint16 and found.ndim == 2 else None
