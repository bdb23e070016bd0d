"""The numbers in a camera's YAML, read with suspicion: whatever is wrong is told in one line that names the file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from toddle.failures import BadInput
from toddle.geometry.camera import Pinhole

_LARGEST = 2**20  # bytes; a camera is a few kilobytes
REMEDY = "give a ROS camera_info pair, OpenCV's K1 D1 K2 D2 R T, or a Kalibr camchain of two cameras"
"""What can be read."""


class _Loader(yaml.SafeLoader):
    """Plain YAML, and OpenCV's matrices."""


def _opencv_matrix(loader: yaml.SafeLoader, node: yaml.Node) -> Any:
    if not isinstance(node, yaml.MappingNode):
        raise yaml.constructor.ConstructorError(None, None, "a matrix that is none", node.start_mark)
    return loader.construct_mapping(node, deep=True)


_Loader.add_constructor("tag:yaml.org,2002:opencv-matrix", _opencv_matrix)


def read_facts(path: Path) -> dict[Any, Any]:
    """A YAML mapping, OpenCV's dialect included."""
    try:
        if not path.is_file():
            raise BadInput("there is no such file", where=str(path), remedy=REMEDY)
        if path.stat().st_size > _LARGEST:
            raise BadInput("it is larger than any camera", where=str(path), remedy=REMEDY)
        text = path.read_bytes().decode("utf-8")
        if text.startswith("%YAML:"):  # OpenCV's head is no YAML
            text = text.partition("\n")[2]
        facts = yaml.load(text, Loader=_Loader)  # a SafeLoader: it builds nothing but plain values
    except OSError as fault:
        raise BadInput(f"it can't be read ({fault.strerror})", where=str(path), remedy=REMEDY) from fault
    except (yaml.YAMLError, ValueError, TypeError, RecursionError) as fault:
        raise BadInput("it is no YAML", where=str(path), remedy=REMEDY) from fault
    if not isinstance(facts, dict):
        raise BadInput("it holds no cameras", where=str(path), remedy=REMEDY)
    return facts


def matrix_of(facts: Mapping[Any, Any], name: str, shape: tuple[int, ...] | None, path: Path) -> np.ndarray:
    """A matrix as OpenCV and ROS (rows, cols, data) or as Kalibr (lists) write it."""
    told = facts.get(name)
    try:
        if isinstance(told, dict):
            values = np.array(_numbers(told["data"])).reshape(int(told["rows"]), int(told["cols"]))
        else:
            values = np.array(
                [_numbers(row) for row in told[:5]]
                if isinstance(told, list) and told and isinstance(told[0], list)
                else _numbers(told)
            )
    except (KeyError, TypeError, ValueError, OverflowError):
        values = np.array(np.nan)
    if values.size == 0 or values.size > 16 or (shape is not None and values.shape != shape):
        values = np.array(np.nan)
    if not np.isfinite(values).all():
        size = "numbers" if shape is None else " x ".join(map(str, shape)) + " numbers"
        raise BadInput(f"its {name} is no {size}", where=str(path), remedy=REMEDY)
    return values


def _numbers(told: Any) -> list[float]:
    """A short list of numbers; anything longer or deeper, which YAML's references may make endless, is none."""
    if not isinstance(told, list) or len(told) > 16 or not all(isinstance(value, int | float) for value in told):
        raise ValueError("no numbers")
    return [float(value) for value in told]


def size_of(facts: Mapping[Any, Any], name: str, path: Path) -> int:
    """A width or a height [pixels]."""
    return pixels_from(facts.get(name), name, path)


def pixels_from(value: Any, name: str, path: Path) -> int:
    """A number that must be a width or a height [pixels]."""
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = 0.0
    if number != number or not 1 <= number <= 65536 or number != round(number):
        raise BadInput(f"its {name} is no size in pixels", where=str(path), remedy="give 1 to 65536")
    return int(number)


def camera_from(matrix: np.ndarray, bend: np.ndarray, size: tuple[int, int], path: Path) -> Pinhole:
    """A camera from K, up to five coefficients of distortion and the pictures' width and height [pixels]."""
    if len(bend) > 5 and np.any(bend[5:]):
        what = f"its distortion has {len(bend)} coefficients"
        raise BadInput(what, where=str(path), remedy="calibrate with five: k1 k2 p1 p2 k3")
    k1, k2, p1, p2, k3 = (float(value) for value in [*bend, 0.0, 0.0, 0.0, 0.0, 0.0][:5])
    fx, fy, cx, cy = (float(matrix[place]) for place in ((0, 0), (1, 1), (0, 2), (1, 2)))
    if abs(matrix[0, 1]) > 1e-6 * abs(fx):
        raise BadInput("its pixels are skew", where=str(path), remedy="calibrate without skew")
    try:
        return Pinhole(size[0], size[1], fx, fy, cx, cy, (k1, k2, p1, p2, k3))
    except BadInput as fault:
        raise BadInput(fault.what, where=str(path), remedy=fault.remedy) from fault


def turn_of(facts: Mapping[Any, Any], name: str, path: Path) -> np.ndarray:
    """A rotation by its name."""
    return rotation_from(matrix_of(facts, name, (3, 3), path), name, path)


def rotation_from(matrix: np.ndarray, name: str, path: Path) -> np.ndarray:
    """The rotation nearest to a matrix that nearly is one."""
    if np.abs(matrix).max() > 2 or np.abs(matrix @ matrix.T - np.eye(3)).max() > 1e-3 or np.linalg.det(matrix) < 0:
        raise BadInput(f"its {name} is no rotation", where=str(path), remedy=REMEDY)
    u, _, v = np.linalg.svd(matrix)  # written with six digits it is nearly one
    return u @ v
