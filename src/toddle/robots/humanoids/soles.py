"""Where a foot touches the floor: the lowest part of its geometry as a box, and where its frame stands."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from jaxtyping import Float

from toddle.robots.humanoids.skeleton import Link, Shape

LAYER = 0.012  # what lies this far above the lowest point is sole [m]


class Sole(NamedTuple):
    """A sole under an ankle: depth of the floor below it, length, width and how far its middle is ahead [m]."""

    depth: float
    length: float
    width: float
    ahead: float


def points(shape: Shape) -> Float[np.ndarray, "points 3"]:
    """Points that span a shape, in its link's frame."""
    return _own(shape) @ shape.rotation.T + shape.position


def _own(shape: Shape) -> Float[np.ndarray, "points 3"]:
    kinds = mujoco.mjtGeom
    if shape.vertices is not None:
        return shape.vertices
    corners = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    radius, half = float(shape.size[0]), float(shape.size[1])
    axis = np.array([0.0, 0.0, 1.0])
    ball = np.vstack([np.cos(t) * ring + np.sin(t) * axis for t in np.linspace(-np.pi / 2, np.pi / 2, 13)])
    if shape.type == kinds.mjGEOM_BOX:
        return corners * shape.size
    if shape.type == kinds.mjGEOM_CYLINDER:
        return np.vstack([radius * ring + half * axis, radius * ring - half * axis])
    if shape.type == kinds.mjGEOM_SPHERE:
        return radius * ball
    if shape.type == kinds.mjGEOM_CAPSULE:
        return np.vstack([radius * ball + half * axis, radius * ball - half * axis])
    if shape.type == kinds.mjGEOM_ELLIPSOID:
        return ball * shape.size
    return np.zeros((0, 3))


def cloud(link: Link, *, solid: bool) -> Float[np.ndarray, "points 3"]:
    """All points of a link's geometry; only of what collides where ``solid``."""
    found = [points(shape) for shape in link.shapes if shape.solid or not solid]
    return np.vstack([np.zeros((0, 3)), *found])


def sole_of(link: Link, ankle: Float[np.ndarray, "3"], axes: Float[np.ndarray, "3 3"]) -> tuple[Sole, bool] | None:
    """The sole of a foot and whether colliding geometry told it; None: there is no geometry.

    Args:
        link: the foot.
        ankle: of it, in its frame [m].
        axes: ahead, left and up in the foot's frame, as columns.
    """
    for solid in (True, False):
        seen = (cloud(link, solid=solid) - ankle) @ axes
        if len(seen) == 0:
            continue
        low = float(seen[:, 2].min())
        layer = seen[seen[:, 2] < low + LAYER]
        (rear, inner), (front, outer) = layer[:, :2].min(axis=0), layer[:, :2].max(axis=0)
        length, width = float(front - rear), float(2 * min(outer, -inner))
        if length > 0 and width > 0:
            return Sole(-low, length, width, float(front + rear) / 2), solid
    return None
