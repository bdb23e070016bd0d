"""Rectified pairs of textured planes at known disparities."""

from __future__ import annotations

import cv2
import numpy as np

from toddle.geometry.camera import Pinhole, RectifiedCameras

CAMERAS = RectifiedCameras(Pinhole(320, 240, 236.0, 236.0, 159.5, 119.5), 0.068)


def texture(seed: int, width: int = 400, contrast: float = 45.0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    light = np.zeros((240, width))
    for n in (2, 5, 12):
        light += cv2.resize(rng.normal(size=(240 // n, width // n)), (width, 240)) * n
    return 120 + contrast * light / np.std(light)


def pair(
    disparity: float, seed: int = 0, *, contrast: float = 45.0, noise: float = 2.0
) -> tuple[np.ndarray, np.ndarray]:
    """A wall that faces the cameras: columns x of the right picture show what x + disparity of the left one does."""
    rng, wall = np.random.default_rng([seed, 1]), texture(seed, contrast=contrast)
    shift = np.array([[1.0, 0, -20], [0, 1, 0]]), np.array([[1.0, 0, -20 - disparity], [0, 1, 0]])
    seen = (cv2.warpAffine(wall, move, (320, 240), flags=cv2.INTER_CUBIC) for move in shift)
    left, right = (np.clip(np.rint(one + noise * rng.normal(size=one.shape)), 5, 248).astype(np.uint8) for one in seen)
    return left, right


def box_before_wall(near: int, far: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A square before a wall: both pictures, and where in the left one the square is."""
    left, right = pair(float(far), 3)
    box = texture(9)[60:180, 100:220].astype(np.uint8)
    left[60:180, 100:220] = box
    right[60:180, 100 - near : 220 - near] = box
    inside = np.zeros(left.shape, bool)
    inside[60:180, 100:220] = True
    return left, right, inside
