"""Rectification: what two cameras saw, as two ideal cameras side by side would have seen it (Huber 2019, figure 4.10).

Both are turned half the way to each other (Bouguet), so that the same thing stands in the same row of both pictures.
The ideal camera is ours to choose: left to OpenCV's ``alpha``, the document's fold gives focal lengths from 281 to 466.
The maps are computed once; a picture then costs one look-up a pixel.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, Int16, Shaped, UInt16

from toddle.failures import BadInput
from toddle.geometry.camera import Pinhole, RectifiedCameras, StereoCameras
from toddle.see.lens import fold, rays_of

_EDGE = 1e-3  # pixels: what rounding may take off the border
_TRUSTED = 0.9  # of the fold: nearer to it a pixel's neighbours lie far apart


class Maps(NamedTuple):
    """Where each pixel of a rectified picture is found in the camera's own.

    Attributes:
        source: x and y [pixels].
        valid: the camera saw it.
        quick: the same for OpenCV, whole pixels and 32nds, twice as fast; what was not seen is looked up outside.
    """

    source: Float32[np.ndarray, "rows columns 2"]
    valid: Bool[np.ndarray, "rows columns"]
    quick: tuple[Int16[np.ndarray, "rows columns 2"], UInt16[np.ndarray, "rows columns"]]


class Rectification(NamedTuple):
    """Both cameras' maps, and what they lead to.

    Attributes:
        left: maps of the left camera.
        right: maps of the right camera.
        rotations: from each camera's frame to the rectified one: R_1 and R_2.
        cameras: the ideal pair.
    """

    left: Maps
    right: Maps
    rotations: tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "3 3"]]
    cameras: RectifiedCameras


def rectification(cameras: StereoCameras, camera: Pinhole | None = None) -> Rectification:
    """The maps that rectify two cameras' pictures.

    Args:
        cameras: as calibrated.
        camera: the ideal camera; unless given, as large as the left one, with its focal length, and its middle where
            the two cameras look.

    Raises:
        BadInput: the second camera is not to the right of the first.
    """
    left, right = cameras.left, cameras.right
    if cameras.translation[0] >= 0 or abs(cameras.translation[0]) < np.abs(cameras.translation[1:]).max():
        what = "the second camera is not to the right of the first"
        raise BadInput(what, where="cameras", remedy="swap them, or calibrate again")
    first, second = _half_way(cameras)
    ideal = camera or _looking_where_they_look(left, first, second)
    maps = [maps_of(one, turn, ideal) for one, turn in ((left, first), (right, second))]
    return Rectification(maps[0], maps[1], (first, second), RectifiedCameras(ideal, cameras.baseline))


def maps_from(source: Float32[np.ndarray, "rows columns 2"], valid: Bool[np.ndarray, "rows columns"]) -> Maps:
    """Maps, made ready for use: where each pixel is found [pixels], and whether the camera saw it."""
    outside = np.where(valid[..., None], source, np.float32(-100.0))
    whole, parts = cv2.convertMaps(outside, None, cv2.CV_16SC2)  # type: ignore[call-overload]
    return Maps(source, valid, (whole, parts))


def maps_of(camera: Pinhole, rotation: Float[np.ndarray, "3 3"], ideal: Pinhole) -> Maps:
    """The maps of one camera: for each pixel of the ideal camera, where its ray is seen (equations 2.143 to 2.145)."""
    bend = np.array(camera.distortion)
    size = (ideal.width, ideal.height)
    x, y = cv2.initUndistortRectifyMap(camera.matrix, bend, rotation, ideal.matrix, size, cv2.CV_32FC1)
    source = np.stack([x, y], axis=-1)
    return maps_from(source, _seen(camera, rotation, ideal, source))


def _seen(
    camera: Pinhole, rotation: Float[np.ndarray, "3 3"], ideal: Pinhole, source: Float32[np.ndarray, "rows columns 2"]
) -> Bool[np.ndarray, "rows columns"]:
    """Where the source is a pixel of the picture, and not one that the lens folded back."""
    columns, rows = np.meshgrid(np.arange(ideal.width), np.arange(ideal.height))
    rays = np.stack([(columns - ideal.cx) / ideal.fx, (rows - ideal.cy) / ideal.fy, np.ones_like(rows)], axis=-1)
    x, y, z = np.moveaxis(rays @ rotation, -1, 0)
    inside = np.all((source >= -_EDGE) & (source <= (camera.width - 1 + _EDGE, camera.height - 1 + _EDGE)), axis=-1)
    return inside & (z > 0) & (np.hypot(x, y) < _TRUSTED * fold(camera) * z)


def rectify(
    maps: Maps, picture: Shaped[np.ndarray, "rows columns *colours"]
) -> Shaped[np.ndarray, "high wide *colours"]:
    """A picture as the ideal camera would have taken it; black where the camera did not see.

    Args:
        maps: of the camera that took it.
        picture: 8 bits or floating point, grey or coloured.
    """
    return cv2.remap(picture, maps.quick[0], maps.quick[1], cv2.INTER_LINEAR)


def rectified_points(
    camera: Pinhole, rotation: Float[np.ndarray, "3 3"], ideal: Pinhole, points: Float[np.ndarray, "points 2"]
) -> Float[np.ndarray, "points 2"]:
    """Where pixels of a camera's own picture lie in the rectified one [pixels]; NaN for those that no ray reaches."""
    rays = rays_of(camera, points)
    ahead = np.concatenate([rays, np.ones((len(rays), 1))], axis=1) @ rotation.T
    return ahead[:, :2] / ahead[:, 2:] * (ideal.fx, ideal.fy) + (ideal.cx, ideal.cy)


def _half_way(cameras: StereoCameras) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "3 3"]]:
    """R_1 and R_2: each camera turned half the way to the other, then both until the baseline is their x axis."""
    turn, _ = cv2.Rodrigues(cameras.rotation)
    half, _ = cv2.Rodrigues(-0.5 * turn)  # of the right camera; the left one's is its inverse
    apart = half @ cameras.translation
    across = -apart / np.linalg.norm(apart)
    axis = np.cross(across, [1.0, 0.0, 0.0])
    sine = np.linalg.norm(axis)
    angle = np.arctan2(sine, across[0])
    level, _ = cv2.Rodrigues(axis / max(sine, 1e-12) * angle)
    return level @ half.T, level @ half


def _looking_where_they_look(
    left: Pinhole, first: Float[np.ndarray, "3 3"], second: Float[np.ndarray, "3 3"]
) -> Pinhole:
    """An ideal camera whose middle pixel is the mean of the two optical axes."""
    axes = (first[:, 2] + second[:, 2]) / 2
    focal = (left.fx + left.fy) / 2
    centre = np.array([left.width - 1, left.height - 1]) / 2 - focal * axes[:2] / axes[2]
    return Pinhole(left.width, left.height, focal, focal, float(centre[0]), float(centre[1]))
