"""Meshes that MuJoCo does not read, as clouds of vertices: Collada (.dae), text STL, and STL with too many faces.

Collada's scene graph places its geometries; its unit and its up axis are applied (COLLADA 1.4.1, <asset>).
"""

from __future__ import annotations

import struct
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.robots.markup import parse

_MOST_FACES = 200_000  # MuJoCo's own limit
_UPRIGHT = {
    "Y_UP": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "X_UP": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]),
}
_RECORD = np.dtype([("normal", "<3f4"), ("corners", "<9f4"), ("word", "<u2")])


def read_by_mujoco(path: Path) -> bool:
    """Whether MuJoCo can read the mesh itself."""
    if path.suffix.lower() in (".obj", ".msh"):
        return True
    return path.suffix.lower() == ".stl" and 0 < _faces(path) <= _MOST_FACES


def vertices(path: Path, where: str) -> Float[np.ndarray, "vertices 3"]:
    """The vertices of a mesh, in its own frame and units of a metre.

    Raises:
        BadInput: the file is of no kind that is read, or broken.
    """
    remedy = "convert it to a binary .stl, or remove the element that names it"
    try:
        if path.suffix.lower() == ".dae":
            found = _collada(path)
        elif path.suffix.lower() == ".stl":
            found = _stl(path)
        else:
            raise BadInput(f"meshes of kind {path.suffix!r} are not read", where=where, remedy=remedy)
    except (ValueError, KeyError, IndexError, OSError) as error:
        raise BadInput(f"the mesh {path.name!r} can't be read: {error}", where=where, remedy=remedy) from None
    if len(found) < 4 or not np.isfinite(found).all():
        raise BadInput(f"the mesh {path.name!r} holds no solid", where=where, remedy=remedy)
    return np.unique(found, axis=0)


def _faces(path: Path) -> int:
    """Faces of a binary STL; 0 where it is text, or torn off."""
    with path.open("rb") as file:
        head = file.read(84)
    count = struct.unpack("<I", head[80:84])[0] if len(head) == 84 else 0
    return count if path.stat().st_size == 84 + _RECORD.itemsize * count else 0


def _stl(path: Path) -> Float[np.ndarray, "vertices 3"]:
    count = _faces(path)
    if count:
        return np.frombuffer(path.read_bytes(), _RECORD, count, 84)["corners"].reshape(-1, 3).astype(float)
    lines = [line.split() for line in path.read_text(errors="replace").splitlines()]
    return np.array([[float(word) for word in line[1:4]] for line in lines if line[:1] == ["vertex"]]).reshape(-1, 3)


def _collada(path: Path) -> Float[np.ndarray, "vertices 3"]:
    root = parse(path.read_bytes(), str(path))
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
    shapes = {geometry.get("id"): _positions(geometry) for geometry in root.iter("geometry")}
    placed = [
        part for scene in root.iter("visual_scene") for node in scene.findall("node") for part in _placed(node, shapes)
    ]
    unit = root.find("asset/unit")
    scale = float(unit.get("meter", "1")) if unit is not None else 1.0
    upright = _UPRIGHT.get(root.findtext("asset/up_axis", "Z_UP").strip(), np.eye(3))
    return scale * np.vstack(placed or list(shapes.values())) @ upright.T


def _positions(geometry: Element) -> Float[np.ndarray, "vertices 3"]:
    arrays = {source.get("id"): source.findtext("float_array", "") for source in geometry.iter("source")}
    named = [
        str(entry.get("source")).lstrip("#")
        for group in geometry.iter("vertices")
        for entry in group.findall("input")
        if entry.get("semantic") == "POSITION"
    ]
    numbers = [np.array(arrays[name].split(), float).reshape(-1, 3) for name in named]
    return np.vstack([np.zeros((0, 3)), *numbers])


def _placed(
    node: Element, shapes: dict[str | None, Float[np.ndarray, "_ 3"]], above: Float[np.ndarray, "4 4"] | None = None
) -> list[Float[np.ndarray, "_ 3"]]:
    place = np.eye(4) if above is None else above
    for step in node:
        place = place @ _transform(step)
    found = []
    for instance in node.findall("instance_geometry"):
        points = shapes[str(instance.get("url")).lstrip("#")]
        found.append(points @ place[:3, :3].T + place[:3, 3])
    for child in node.findall("node"):
        found += _placed(child, shapes, place)
    return found


def _transform(element: Element) -> Float[np.ndarray, "4 4"]:
    found = np.eye(4)
    if element.tag not in ("matrix", "translate", "scale", "rotate"):
        return found
    numbers = np.array((element.text or "").split(), float)
    if element.tag == "matrix":
        return numbers.reshape(4, 4)
    if element.tag == "translate":
        found[:3, 3] = numbers
    elif element.tag == "scale":
        found[:3, :3] = np.diag(numbers)
    else:
        axis, angle = numbers[:3] / np.linalg.norm(numbers[:3]), np.deg2rad(numbers[3])
        cross = np.cross(np.eye(3), axis)
        found[:3, :3] = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return found
