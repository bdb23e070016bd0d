"""What a lens does to a ray, and back: Brown's distortion (Brown 1971; Huber 2019, equations 2.143 to 2.145).

A polynomial need not grow for ever: with the document's coefficients it folds at 1.09 times the focal length, beyond
which two rays share a pixel and some pixels have none. OpenCV's own inverse diverges there; ours knows where it ends.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from toddle.geometry.camera import Pinhole

_FARTHEST = 4.0  # times the focal length: rays 76 degrees off the axis
_STEPS = 4000
_ROUNDS = 5


def fold(camera: Pinhole) -> float:
    """The radius of undistorted rays, as a multiple of the focal length, from which on pixels fold back; at most 4."""
    radii = np.linspace(0.0, _FARTHEST, _STEPS)
    shrinks = np.flatnonzero(np.diff(_stretched(camera, radii)) <= 0)
    return float(radii[shrinks[0]]) if len(shrinks) else _FARTHEST


def pixels_of(camera: Pinhole, points: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 2"]:
    """Where the camera sees points of its own frame [pixels]; NaN behind it and beyond its `fold`."""
    ahead = np.where(points[..., 2:] > 0, points[..., 2:], np.nan)
    rays = points[..., :2] / ahead
    radius = np.linalg.norm(rays, axis=-1, keepdims=True)
    rays = np.where(radius < fold(camera), rays, np.nan)
    seen = rays * (_stretched(camera, radius) / np.maximum(radius, 1e-12)) + _tangential(camera, rays)
    seen = np.where(radius < 1e-12, 0.0, seen)
    return seen * (camera.fx, camera.fy) + (camera.cx, camera.cy)


def rays_of(camera: Pinhole, pixels: Float[np.ndarray, "*batch 2"]) -> Float[np.ndarray, "*batch 2"]:
    """The ray (x/z, y/z) of each pixel; NaN where there is none.

    The radial part is inverted by a table up to the fold; the small tangential part is taken off in a few rounds.
    """
    seen = (pixels - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
    radii = np.linspace(0.0, fold(camera), _STEPS)
    table = _stretched(camera, radii)
    rays = seen
    for _ in range(_ROUNDS):
        bent = seen - _tangential(camera, rays)
        radius = np.linalg.norm(bent, axis=-1, keepdims=True)
        rays = bent * np.interp(radius, table, radii, right=np.nan) / np.maximum(radius, 1e-12)
        rays = np.where(radius < 1e-12, 0.0, rays)
    return rays


def _stretched(camera: Pinhole, radius: Float[np.ndarray, "*any"]) -> Float[np.ndarray, "*any"]:
    k1, k2, _, _, k3 = camera.distortion
    square = radius * radius
    return radius * (1 + square * (k1 + square * (k2 + square * k3)))


def _tangential(camera: Pinhole, rays: Float[np.ndarray, "*batch 2"]) -> Float[np.ndarray, "*batch 2"]:
    _, _, p1, p2, _ = camera.distortion
    x, y = rays[..., 0], rays[..., 1]
    square = x * x + y * y
    return np.stack([2 * p1 * x * y + p2 * (square + 2 * x * x), p1 * (square + 2 * y * y) + 2 * p2 * x * y], axis=-1)
