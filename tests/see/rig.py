"""Views of boards as corners with noise, no pictures: quick, and their truth is known."""

from __future__ import annotations

import numpy as np

from toddle.geometry.camera import StereoCameras
from toddle.see.calibrate import View
from toddle.see.chessboard import Chessboard
from toddle.see.lens import pixels_of
from toddle.see.painted_boards import misaligned

BOARD = Chessboard()
SIZE = (320, 240)


def rig(seed: int = 0) -> StereoCameras:
    return misaligned(np.random.default_rng(seed))


def turned(x: float, y: float, z: float) -> np.ndarray:
    cx, sx, cy, sy, cz, sz = np.cos(x), np.sin(x), np.cos(y), np.sin(y), np.cos(z), np.sin(z)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return about_x @ about_y @ about_z


def seen(
    cameras: StereoCameras, count: int, *, seed: int = 0, noise: float = 0.05, tilt: float = 0.6, moved: float = 0.0
) -> list[View]:
    """Views of boards that both cameras see wholly; `moved` [m] sideways before the right one looks."""
    rng = np.random.default_rng(seed)
    views: list[View] = []
    while len(views) < count:
        distance = rng.uniform(0.25, 0.6)
        centre = np.append(rng.uniform(-0.45, 0.45, 2) * (1, 0.7), 1.0) * distance
        turn = turned(*rng.uniform(-tilt, tilt, 3))
        points = (BOARD.points - BOARD.points.mean(axis=0)) @ turn.T + centre
        left = pixels_of(cameras.left, points)
        right = pixels_of(
            cameras.right, (points + np.array([moved, moved, 0])) @ cameras.rotation.T + cameras.translation
        )
        if all(np.all((some > 5) & (some < np.array(SIZE) - 5)) for some in (left, right)):
            some = (corners + noise * rng.normal(size=corners.shape) for corners in (left, right))
            views.append(View(f"view{len(views):02d}", *some))
    return views
