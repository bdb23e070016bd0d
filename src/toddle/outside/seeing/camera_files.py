"""Two calibrated cameras as files: ROS ``camera_info`` (read and written), OpenCV's YAML and Kalibr's camchain (read).

A ROS pair is two files, ``left.yaml`` and ``right.yaml``; how the cameras stand to each other follows from their
rectifications. OpenCV's own files, as the document's, don't say how large the pictures were: that comes from the
pictures.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

from toddle.failures import BadInput
from toddle.geometry.camera import Pinhole, RectifiedCameras, StereoCameras
from toddle.outside.files import write_bytes
from toddle.outside.seeing.camera_numbers import (
    REMEDY,
    camera_from,
    matrix_of,
    pixels_from,
    read_facts,
    rotation_from,
    size_of,
    turn_of,
)
from toddle.see.rectify import Rectification, maps_of

_FARTHEST = 10.0  # m between two cameras


class CameraFile(NamedTuple):
    """What a file says.

    Attributes:
        cameras: both.
        earlier: the rectification that it holds, with which pictures may have been rectified before; None: it holds
            none, or one whose two cameras aren't alike.
    """

    cameras: StereoCameras
    earlier: Rectification | None = None


def read_cameras(path: Path, size: tuple[int, int] | None = None) -> CameraFile:
    """Read two cameras.

    Args:
        path: a file, or a folder with ``left.yaml`` and ``right.yaml``; of a ROS pair either file will do.
        size: of the pictures, width and height [pixels]: for files that don't say.

    Raises:
        BadInput: it can't be read, holds no pair of cameras, or a number in it can't be.
    """
    if path.is_dir():
        path = path / "left.yaml"
    facts = read_facts(path)
    if "cam0" in facts:
        found = _kalibr(facts, path)
    elif "camera_matrix" in facts and "projection_matrix" in facts:
        left, right = _ros_pair(path)
        found = _ros(read_facts(left), left, read_facts(right), right)
    elif {"K1", "K2"} <= facts.keys() or {"M1", "M2"} <= facts.keys():
        found = _opencv(facts, path, size)
    else:
        raise BadInput("it holds no pair of cameras", where=str(path), remedy=REMEDY)
    _check_pair(found.cameras, path)
    if size is not None and size != (found.cameras.left.width, found.cameras.left.height):
        said = f"{found.cameras.left.width} x {found.cameras.left.height}"
        what = f"its cameras take pictures of {said} pixels, these have {size[0]} x {size[1]}"
        raise BadInput(what, where=str(path), remedy="give pictures of those cameras, as they took them")
    return found


def write_cameras(folder: Path, cameras: StereoCameras, made: Rectification) -> tuple[Path, Path]:
    """Write ROS ``camera_info`` files: ``left.yaml`` and ``right.yaml``.

    Args:
        folder: where; it must exist.
        cameras: as calibrated.
        made: how they are rectified.
    """
    paths = folder / "left.yaml", folder / "right.yaml"
    shifts = 0.0, -made.cameras.camera.fx * made.cameras.baseline
    for path, camera, turn, shift in zip(paths, (cameras.left, cameras.right), made.rotations, shifts, strict=True):
        projection = np.concatenate([made.cameras.camera.matrix, [[shift], [0.0], [0.0]]], axis=1)
        facts = {
            "image_width": camera.width, "image_height": camera.height, "camera_name": path.stem,
            "camera_matrix": _written(camera.matrix), "distortion_model": "plumb_bob",
            "distortion_coefficients": _written(np.array([camera.distortion])),
            "rectification_matrix": _written(turn), "projection_matrix": _written(projection),
        }  # fmt: skip
        write_bytes(path, yaml.safe_dump(facts, sort_keys=False, default_flow_style=None, width=120).encode())
    return paths


def _written(matrix: np.ndarray) -> dict[str, Any]:
    rows, columns = matrix.shape
    return {"rows": rows, "cols": columns, "data": [float(value) for value in matrix.ravel()]}


def _ros_pair(path: Path) -> tuple[Path, Path]:
    for mine, other in (("left", "right"), ("Left", "Right")):
        if mine in path.name:
            return path, path.with_name(path.name.replace(mine, other))
        if other in path.name:
            return path.with_name(path.name.replace(other, mine)), path
    raise BadInput("it is one camera of two", where=str(path), remedy="name the files left.yaml and right.yaml")


def _ros(one: Mapping[Any, Any], left: Path, other: Mapping[Any, Any], right: Path) -> CameraFile:
    pair, turns, projections = [], [], []
    for facts, path in ((one, left), (other, right)):
        model = facts.get("distortion_model", "plumb_bob")
        if model != "plumb_bob":
            raise BadInput(f"its distortion_model is {str(model)[:40]!r}", where=str(path), remedy="give plumb_bob")
        size = (size_of(facts, "image_width", path), size_of(facts, "image_height", path))
        bend = matrix_of(facts, "distortion_coefficients", None, path).ravel()
        pair.append(camera_from(matrix_of(facts, "camera_matrix", (3, 3), path), bend, size, path))
        turns.append(turn_of(facts, "rectification_matrix", path))
        projections.append(matrix_of(facts, "projection_matrix", (3, 4), path))
    focal, shift = projections[1][0, 0], projections[1][0, 3]
    if focal <= 0 or shift >= 0:
        what = "its projection_matrix has no baseline"
        raise BadInput(what, where=str(right), remedy="calibrate both cameras together, and write both files")
    across = np.array([shift / focal, 0.0, 0.0])
    cameras = StereoCameras(pair[0], pair[1], turns[1].T @ turns[0], turns[1].T @ across)
    return CameraFile(cameras, _earlier(cameras, turns, projections))


def _opencv(facts: Mapping[Any, Any], path: Path, size: tuple[int, int] | None) -> CameraFile:
    if "image_width" in facts and "image_height" in facts:
        size = (size_of(facts, "image_width", path), size_of(facts, "image_height", path))
    if size is None:
        raise BadInput("it does not say how large the pictures are", where=str(path), remedy="give pictures with it")
    letter = "K" if "K1" in facts else "M"
    left, right = (
        camera_from(
            matrix_of(facts, f"{letter}{n}", (3, 3), path), matrix_of(facts, f"D{n}", None, path).ravel(), size, path
        )
        for n in (1, 2)
    )
    translation = matrix_of(facts, "T", None, path).ravel()
    if translation.shape != (3,):
        raise BadInput("its T has not three numbers", where=str(path), remedy=REMEDY)
    cameras = StereoCameras(left, right, turn_of(facts, "R", path), translation)
    if not {"R1", "R2", "P1", "P2"} <= facts.keys():
        return CameraFile(cameras)
    turns = [turn_of(facts, name, path) for name in ("R1", "R2")]
    return CameraFile(
        cameras, _earlier(cameras, turns, [matrix_of(facts, name, (3, 4), path) for name in ("P1", "P2")])
    )


def _earlier(
    cameras: StereoCameras, turns: Sequence[np.ndarray], projections: Sequence[np.ndarray]
) -> Rectification | None:
    """The rectification that a file holds."""
    one, other = (projection[:, :3] for projection in projections)
    if np.abs(one - other).max() > 1e-6 * np.abs(one).max() or min(one[0, 0], one[1, 1]) <= 0:
        return None
    left, right = cameras.left, cameras.right
    fx, fy, cx, cy = (float(one[place]) for place in ((0, 0), (1, 1), (0, 2), (1, 2)))
    ideal = Pinhole(left.width, left.height, fx, fy, cx, cy)
    maps = [maps_of(camera, turn, ideal) for camera, turn in zip((left, right), turns, strict=True)]
    return Rectification(maps[0], maps[1], (turns[0], turns[1]), RectifiedCameras(ideal, cameras.baseline))


def _kalibr(facts: Mapping[Any, Any], path: Path) -> CameraFile:
    pair = []
    for name in ("cam0", "cam1"):
        one = facts.get(name)
        if not isinstance(one, dict):
            raise BadInput(f"it holds no {name}", where=str(path), remedy=REMEDY)
        models = (one.get("camera_model", "pinhole"), one.get("distortion_model", "radtan"))
        if models != ("pinhole", "radtan"):
            what = f"its {name} is {str(models[0])[:40]} with {str(models[1])[:40]} distortion"
            raise BadInput(what, where=str(path), remedy="give pinhole-radtan")
        size = matrix_of(one, "resolution", (2,), path)
        fx, fy, cx, cy = matrix_of(one, "intrinsics", (4,), path)
        matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
        whole = (pixels_from(size[0], "resolution", path), pixels_from(size[1], "resolution", path))
        pair.append(camera_from(matrix, matrix_of(one, "distortion_coeffs", None, path).ravel(), whole, path))
    moved = matrix_of(facts["cam1"], "T_cn_cnm1", (4, 4), path)
    return CameraFile(StereoCameras(pair[0], pair[1], rotation_from(moved[:3, :3], "T_cn_cnm1", path), moved[:3, 3]))


def _check_pair(cameras: StereoCameras, path: Path) -> None:
    if not 1e-4 <= cameras.baseline <= _FARTHEST:
        what = f"its cameras are {cameras.baseline:g} m apart"
        raise BadInput(what, where=str(path), remedy="give the translation in metres")
