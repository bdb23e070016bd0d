"""Boxes and cylinders as triangles with normals and texture coordinates: what a graphics driver draws of a room.

MuJoCo stretches a texture over a box as the box is; here every texture has its own size [m], the same on every face,
as the ray-caster has it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from toddle.navigate.scenarios.rooms import Part

ROUND = 24
"""Sides of a drawn cylinder."""


class Mesh(NamedTuple):
    """Triangles.

    Attributes:
        vertices: x, y, z [m].
        normals: of each vertex.
        texture: where each vertex is in its texture; 1 is the whole side.
        faces: three vertices each, anticlockwise from outside.
    """

    vertices: Float[np.ndarray, "vertices 3"]
    normals: Float[np.ndarray, "vertices 3"]
    texture: Float[np.ndarray, "vertices 2"]
    faces: Int[np.ndarray, "faces 3"]


def mesh(parts: Sequence[Part], tile: float) -> Mesh:
    """Parts of one frame as one mesh.

    Args:
        parts: at least one.
        tile: side of the texture [m].
    """
    whole = joined([_box(part) if part.shape == "box" else _cylinder(part) for part in parts])
    return whole._replace(texture=whole.texture / tile)


def turned(piece: Mesh, x: float, y: float, yaw: float) -> Mesh:
    """A mesh in the frame that its own stands in at x, y [m], turned by yaw [rad]."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    turn = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return piece._replace(vertices=piece.vertices @ turn + np.array([x, y, 0.0]), normals=piece.normals @ turn)


def joined(pieces: Sequence[Mesh]) -> Mesh:
    """Meshes as one."""
    starts = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    return Mesh(
        np.concatenate([piece.vertices for piece in pieces]),
        np.concatenate([piece.normals for piece in pieces]),
        np.concatenate([piece.texture for piece in pieces]),
        np.concatenate([piece.faces + start for piece, start in zip(pieces, starts[:-1], strict=True)]),
    )


def _box(part: Part) -> Mesh:
    """Six faces of four corners each."""
    middle, half = np.array(part.middle), np.array(part.half)
    vertices, normals, texture, faces = [], [], [], []
    for axis, (along, up) in enumerate(((1, 2), (0, 2), (0, 1))):
        for side in (-1.0, 1.0):
            corners = np.zeros((4, 3))
            corners[:, axis] = side
            corners[:, along], corners[:, up] = (-1.0, 1.0, 1.0, -1.0), (-1.0, -1.0, 1.0, 1.0)
            corners *= half
            # along x up points to +x for axes 0 and 2, to -y for axis 1
            outward = side * (-1.0 if axis == 1 else 1.0)
            ring = (0, 1, 2, 3) if outward > 0 else (3, 2, 1, 0)
            first = len(vertices) * 4
            faces += [[first + ring[0], first + ring[1], first + ring[2]]]
            faces += [[first + ring[0], first + ring[2], first + ring[3]]]
            vertices.append(corners + middle)
            normal = np.zeros((4, 3))
            normal[:, axis] = side
            normals.append(normal)
            texture.append(corners[:, [along, up]])
    return Mesh(np.concatenate(vertices), np.concatenate(normals), np.concatenate(texture), np.array(faces))


def _cylinder(part: Part) -> Mesh:
    """A side of rectangles, and two caps as fans."""
    (x, y, z), (radius, _, half) = part.middle, part.half
    angles = 2 * math.pi * np.arange(ROUND + 1) / ROUND - math.pi
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    side = [np.column_stack([radius * circle, np.full(ROUND + 1, height)]) for height in (-half, half)]
    low = np.arange(ROUND)
    high = low + ROUND + 1
    faces = [np.column_stack([low, low + 1, high + 1]), np.column_stack([low, high + 1, high])]
    normals = [np.column_stack([circle, np.zeros(ROUND + 1)])] * 2
    texture = [np.column_stack([radius * angles, np.full(ROUND + 1, height)]) for height in (-half, half)]
    for number, height in enumerate((-half, half)):
        first = (2 + number) * (ROUND + 1)
        side.append(side[number])
        normals.append(np.tile([0.0, 0.0, math.copysign(1.0, height)], (ROUND + 1, 1)))
        texture.append(radius * circle)
        fan = np.column_stack([np.full(ROUND - 2, first), first + low[1:-1], first + low[2:]])
        faces.append(fan if height > 0 else fan[:, ::-1])
    vertices = np.concatenate(side) + np.array([x, y, z])
    return Mesh(vertices, np.concatenate(normals), np.concatenate(texture), np.concatenate(faces))
