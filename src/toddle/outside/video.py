"""A film of a run: pictures in, one MP4 out, whole or not at all."""

from __future__ import annotations

import contextlib
import os
import warnings
from collections.abc import Generator
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import UInt8

from toddle.failures import ToddleError


class Film:
    """Writes pictures of one size to an MP4 (H.264); nothing lies under its name before it is closed."""

    def __init__(self, path: Path, rate: int) -> None:
        """Write to ``path``, so many pictures a second."""
        self._path, self._part = path, path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
        self._rate = rate
        self._writer: Generator[Any, Any, None] | None = None
        self._size: tuple[int, ...] = ()
        self.pictures = 0

    def __enter__(self) -> Film:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Close it; after a fault, drop it."""
        if kind is None:
            self.close()
        else:
            self.drop()

    def add(self, picture: UInt8[np.ndarray, "height width 3"]) -> None:
        """One picture more.

        Raises:
            ToddleError: the film can't be written.
            ValueError: it has another size than the first one.
        """
        if self._writer is None:
            self._size = picture.shape
            self._writer = self._open()
        if picture.shape != self._size:
            raise ValueError(f"a picture of {picture.shape} in a film of {self._size}")
        try:
            self._writer.send(np.ascontiguousarray(picture))
        except OSError as fault:
            self.drop()
            raise ToddleError(f"the film can't be written ({_first_line(fault)})", where=str(self._path)) from fault
        self.pictures += 1

    def close(self) -> None:
        """The film lies under its name; without a picture there is none."""
        if self._writer is None:
            return
        self._writer.close()
        try:
            os.replace(self._part, self._path)
        except OSError as fault:
            raise ToddleError(f"the film can't be written ({fault.strerror})", where=str(self._path)) from fault

    def drop(self) -> None:
        """Leave nothing behind."""
        if self._writer is not None:
            with contextlib.suppress(OSError):
                self._writer.close()
            self._writer = None
        with contextlib.suppress(OSError):
            self._part.unlink(missing_ok=True)

    def _open(self) -> Generator[Any, Any, None]:
        import imageio_ffmpeg

        height, width = self._size[:2]
        writer = imageio_ffmpeg.write_frames(
            str(self._part), (width, height), fps=self._rate, codec="libx264", quality=7, macro_block_size=2,
            ffmpeg_log_level="error",
        )  # fmt: skip
        with warnings.catch_warnings():
            # JAX warns of any fork; this one becomes ffmpeg at once
            warnings.simplefilter("ignore", RuntimeWarning)
            writer.send(None)
        return writer


def _first_line(fault: OSError) -> str:
    return (fault.strerror or str(fault)).strip().partition("\n")[0]
