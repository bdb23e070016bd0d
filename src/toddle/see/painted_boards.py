"""Chessboards as cameras would see them: pictures with a known truth, to prove a calibration with.

Each pixel is the mean of many rays through the lens, by our own projection (`toddle.see.lens`), not by the library that
calibrates. The cameras are the document's (Huber 2019, table 4.2), turned by about a degree from each other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Float, Float32, UInt8

from toddle.geometry.camera import Pinhole, StereoCameras
from toddle.see.chessboard import Chessboard
from toddle.see.lens import pixels_of, rays_of

DOCUMENT_LEFT = Pinhole(
    320, 240, 236.123063, 236.654407, 162.935266, 111.387432, (-0.454326, 0.289483, -0.00273052, 0.000216339, -0.121296)
)
"""The document's left camera."""
DOCUMENT_RIGHT = Pinhole(
    320, 240, 231.588900, 232.100560, 185.664910, 129.442777, (-0.4582, 0.318047, 0.000302174, 0.000762684, -0.148348)
)
"""The document's right camera."""
_OVERSAMPLED = 4
_MARGIN = 0.7  # paper around the squares, in squares
_INK, _PAPER, _WALL = 25.0, 215.0, 120.0


def misaligned(rng: np.random.Generator, *, degrees: float = 1.0, baseline: float = 0.068) -> StereoCameras:
    """The document's two cameras, badly mounted.

    Args:
        rng: draws how.
        degrees: standard deviation of the turn about each axis.
        baseline: between the centres [m].
    """
    rotation, _ = cv2.Rodrigues(np.deg2rad(degrees) * rng.normal(size=3))
    across = np.array([-1.0, 0.0, 0.0]) + 0.02 * rng.normal(size=3)
    return StereoCameras(DOCUMENT_LEFT, DOCUMENT_RIGHT, rotation, baseline * across / np.linalg.norm(across))


class Shown(NamedTuple):
    """A board in front of two cameras.

    Attributes:
        left: picture.
        right: picture.
        corners: where they truly are, left and right [pixels].
        centre: the board's middle in the left camera's frame [m].
    """

    left: UInt8[np.ndarray, "rows columns"]
    right: UInt8[np.ndarray, "rows columns"]
    corners: tuple[Float[np.ndarray, "corners 2"], Float[np.ndarray, "corners 2"]]
    centre: Float[np.ndarray, "3"]


def shown_boards(
    cameras: StereoCameras, board: Chessboard, rng: np.random.Generator, *, noise: float = 3.0,
    near: float = 0.25, far: float = 0.65, tilt: float = 0.7, spread: float = 0.8, moved: float = 0.0,
) -> Iterator[Shown]:  # fmt: skip
    """Boards in random poses, without end; not all of them are wholly seen.

    Args:
        cameras: that take the pictures.
        board: that is shown.
        rng: draws poses and noise.
        noise: standard deviation of a pixel's brightness, of 255.
        near, far: distances [m].
        tilt: about two axes, at most so much each way; half of it about the line of sight [rad].
        spread: share of the picture's width and height over which the boards' middles lie.
        moved: between the two exposures, sideways and down, at most so much each way [m].
    """
    painters = BoardPainter(cameras.left, board), BoardPainter(cameras.right, board)
    middle = board.points.mean(axis=0)
    width, height = cameras.left.width, cameras.left.height
    while True:
        pixel = (0.5 + spread * rng.uniform(-0.5, 0.5, 2)) * (width, height)
        distance = rng.uniform(near, far)
        centre = np.append((pixel - (width, height) * np.array(0.5)) / cameras.left.fx, 1.0) * distance
        turn = _turned(*(rng.uniform(-1, 1, 3) * (tilt, tilt, tilt / 2)))
        place = centre - turn @ middle
        later = place + np.append(rng.uniform(-moved, moved, 2), 0.0)
        poses = (turn, place), (cameras.rotation @ turn, cameras.rotation @ later + cameras.translation)
        pictures, corners = [], []
        for painter, (rotation, translation) in zip(painters, poses, strict=True):
            light = painter.paint(rotation, translation)
            pictures.append(np.clip(np.rint(light + noise * rng.normal(size=light.shape)), 0, 255).astype(np.uint8))
            corners.append(pixels_of(painter.camera, board.points @ rotation.T + translation))
        yield Shown(pictures[0], pictures[1], (corners[0], corners[1]), centre)


def _turned(across: float, down: float, ahead: float) -> Float[np.ndarray, "3 3"]:
    """A rotation: about z, then y, then x."""
    turns = (cv2.Rodrigues(np.array(axis))[0] for axis in ((across, 0.0, 0.0), (0.0, down, 0.0), (0.0, 0.0, ahead)))
    x, y, z = turns
    return x @ y @ z


@dataclass(frozen=True, eq=False)
class BoardPainter:
    """Paints boards as a camera sees them, each pixel the mean of many rays through the lens: pictures with a truth.

    Attributes:
        camera: with its distortion.
        board: what is seen.
    """

    camera: Pinhole
    board: Chessboard

    @cached_property
    def rays(self) -> Float32[np.ndarray, "fine_rows fine_columns 2"]:
        """Of each pixel, several each way; NaN where the lens has none."""
        fine = (np.arange(_OVERSAMPLED) + 0.5) / _OVERSAMPLED - 0.5
        x = (np.arange(self.camera.width)[:, None] + fine).ravel()
        y = (np.arange(self.camera.height)[:, None] + fine).ravel()
        return rays_of(self.camera, np.stack(np.meshgrid(x, y), axis=-1)).astype(np.float32)

    def paint(
        self, rotation: Float[np.ndarray, "3 3"], translation: Float[np.ndarray, "3"]
    ) -> Float[np.ndarray, "rows columns"]:
        """The board at a pose in the camera's frame [m]: brightness 0 to 255; black where the lens has no ray."""
        n, rays = _OVERSAMPLED, self.rays
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
