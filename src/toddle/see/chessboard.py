"""A chessboard, and its corners in a picture (Huber 2019, figures 2.26 and 4.9).

Corners are found by OpenCV and refined to a fraction of a pixel. A board of 8 by 6 corners looks the same upside down,
so the order of its corners in two pictures is made the same by `same_order`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from toddle.failures import BadInput

_SMOOTHED = 0.7  # pixels: takes a quarter off the corners' error at a noise of 3 of 255


@dataclass(frozen=True)
class Chessboard:
    """A board.

    Attributes:
        columns: inner corners along its longer side.
        rows: inner corners along the other.
        square: side of a square [m].
    """

    columns: int = 8
    rows: int = 6
    square: float = 0.0225

    def __post_init__(self) -> None:
        """Refuses what is no board.

        Raises:
            BadInput: which number.
        """
        if min(self.columns, self.rows) < 3 or max(self.columns, self.rows) > 100:
            raise BadInput(f"{self.columns} x {self.rows} corners", where="board", remedy="give 3 to 100 a side")
        if not 1e-4 <= self.square <= 10:
            raise BadInput(f"squares of {self.square} m", where="board", remedy="give 0.0001 to 10 m")

    @property
    def points(self) -> Float[np.ndarray, "corners 3"]:
        """Corners in the board's own frame, z = 0 [m] (equation 2.146)."""
        rows, columns = np.mgrid[: self.rows, : self.columns]
        flat = np.stack([columns, rows, np.zeros_like(rows)], axis=-1).reshape(-1, 3)
        return flat * self.square


class Seen(NamedTuple):
    """A board in a picture.

    Attributes:
        corners: row by row [pixels].
        blur: of its edges: pixels from dark to bright.
    """

    corners: Float[np.ndarray, "corners 2"]
    blur: float


def find_board(picture: UInt8[np.ndarray, "rows columns"], board: Chessboard) -> Seen | None:
    """The board's corners in a grey picture; None: not all of them are seen."""
    size = (board.columns, board.rows)
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
    found, corners = cv2.findChessboardCorners(picture, size, flags=flags)
    if not found or corners is None:
        return None
    grid = corners.reshape(board.rows, board.columns, 2)
    across = np.linalg.norm(np.diff(grid, axis=1), axis=-1).min()
    down = np.linalg.norm(np.diff(grid, axis=0), axis=-1).min()
    half = int(np.clip(0.5 * min(across, down), 3, 8))  # the window must not reach the next corner
    stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 60, 1e-3)
    smooth = cv2.GaussianBlur(picture, (0, 0), _SMOOTHED)
    corners = cv2.cornerSubPix(smooth, corners.astype(np.float32), (half, half), (-1, -1), stop)
    corners = corners.reshape(-1, 2).astype(float)
    return Seen(corners, _blur(picture, corners.reshape(board.rows, board.columns, 2)))


def _blur(picture: UInt8[np.ndarray, "rows columns"], grid: Float[np.ndarray, "high wide 2"]) -> float:
    """The median over the edges between neighbouring corners: their step of brightness over their slope [pixels]."""
    widths = []
    for one, other in ((grid[:, :-1], grid[:, 1:]), (grid[:-1], grid[1:])):
        along = (other - one).reshape(-1, 2)
        length = np.linalg.norm(along, axis=1, keepdims=True)
        normal = along[:, ::-1] * (-1, 1) / length
        middle = ((one + other) / 2).reshape(-1, 2)
        far, near = (
            cv2.remap(picture, (middle + normal * s).astype(np.float32)[None], None, cv2.INTER_LINEAR)[0].astype(float)  # type: ignore[call-overload]
            - cv2.remap(picture, (middle - normal * s).astype(np.float32)[None], None, cv2.INTER_LINEAR)[0]  # type: ignore[call-overload]
            for s in (0.35 * length, 0.5)
        )
        widths.append(np.abs(far) / np.maximum(np.abs(near), 1.0))
    return float(np.median(np.concatenate(widths)))


def same_order(left: Float[np.ndarray, "corners 2"], right: Float[np.ndarray, "corners 2"]) -> np.ndarray:
    """The right picture's corners in the left one's order: turned by half a turn if the board was read upside down."""
    agrees = np.sum((left[-1] - left[0]) * (right[-1] - right[0])) > 0
    return right if agrees else right[::-1].copy()
