"""A chessboard, its corners in a picture (Huber 2019, figures 2.26 and 4.9), and how it would look to a camera.

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
from toddle.geometry.camera import Pinhole
from toddle.see.lens import pixels_of, rays_of

_OVERSAMPLED = 4
_MARGIN = 0.7  # paper around the squares, in squares
_INK, _PAPER, _WALL = 25.0, 215.0, 120.0


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
    half = int(np.clip(0.45 * min(across, down), 2, 8))  # the window must not reach the next corner
    stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 60, 1e-3)
    corners = cv2.cornerSubPix(picture, corners.astype(np.float32), (half, half), (-1, -1), stop)
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


@dataclass(frozen=True, eq=False)
class BoardPainter:
    """Paints boards as a camera sees them, each pixel the mean of many rays through the lens: pictures with a truth.

    Attributes:
        camera: with its distortion.
        board: what is seen.
    """

    camera: Pinhole
    board: Chessboard = Chessboard()

    def __post_init__(self) -> None:
        """Rays are found once."""
        fine = (np.arange(_OVERSAMPLED) + 0.5) / _OVERSAMPLED - 0.5
        x = (np.arange(self.camera.width)[:, None] + fine).ravel()
        y = (np.arange(self.camera.height)[:, None] + fine).ravel()
        rays = rays_of(self.camera, np.stack(np.meshgrid(x, y), axis=-1))
        object.__setattr__(self, "_rays", rays.astype(np.float32))

    def paint(
        self, rotation: Float[np.ndarray, "3 3"], translation: Float[np.ndarray, "3"]
    ) -> Float[np.ndarray, "rows columns"]:
        """The board at a pose in the camera's frame [m]: brightness 0 to 255; black where the lens has no ray."""
        rays: np.ndarray = self._rays  # type: ignore[attr-defined]
        n = _OVERSAMPLED
        light = np.where(np.isnan(rays[n // 2 :: n, n // 2 :: n, 0]), 0.0, _WALL)
        top, bottom, left, right = self._around(rotation, translation)
        rays = rays[n * top : n * bottom, n * left : n * right]
        to_plane = np.linalg.inv(np.stack([rotation[:, 0], rotation[:, 1], translation], axis=1)).astype(np.float32)
        u, v, w = (row[0] * rays[..., 0] + row[1] * rays[..., 1] + row[2] for row in to_plane)
        with np.errstate(divide="ignore", invalid="ignore"):
            column, row = u / w / self.board.square + 1, v / w / self.board.square + 1
            white = (np.floor(column) + np.floor(row)) % 2 == 1
        wide, high = self.board.columns + 1, self.board.rows + 1
        squares = (column > 0) & (row > 0) & (column < wide) & (row < high)
        m = _MARGIN
        paper = (column > -m) & (row > -m) & (column < wide + m) & (row < high + m)
        fine = np.where(squares & ~white, _INK, np.where(paper, _PAPER, _WALL))
        fine = np.where(np.isnan(rays[..., 0]), 0.0, fine)
        light[top:bottom, left:right] = fine.reshape(bottom - top, n, right - left, n).mean(axis=(1, 3))
        return light

    def _around(
        self, rotation: Float[np.ndarray, "3 3"], translation: Float[np.ndarray, "3"]
    ) -> tuple[int, int, int, int]:
        """The rows and columns of pixels that the paper covers: all, where a part of it is not seen."""
        width, height = self.camera.width, self.camera.height
        ends = np.linspace(0, 1, 9)
        u, v = np.meshgrid(ends * (self.board.columns + 1 + 2 * _MARGIN), ends * (self.board.rows + 1 + 2 * _MARGIN))
        flat = np.stack([u, v, np.zeros_like(u)], axis=-1).reshape(-1, 3) - (1 + _MARGIN, 1 + _MARGIN, 0)
        pixels = pixels_of(self.camera, flat * self.board.square @ rotation.T + translation)
        if np.isnan(pixels).any():
            return 0, height, 0, width
        (left, top), (right, bottom) = pixels.min(axis=0) - 3, pixels.max(axis=0) + 3
        rows, columns = np.clip((top, bottom), 0, height), np.clip((left, right), 0, width)
        return int(rows[0]), int(rows[1]), int(columns[0]), int(columns[1])
