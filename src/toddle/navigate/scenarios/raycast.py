"""Small pictures of rooms without any graphics driver: rays against boxes and cylinders, one for each pixel.

The same records, textures and light as the drawn rooms have; a pixel's texture comes from a pyramid of means, so that
far floors don't flicker. Nothing casts a shadow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Float32, Int, UInt8

from toddle.geometry.camera import Pinhole, RectifiedCameras
from toddle.navigate.scenarios import raycast_kernels
from toddle.navigate.scenarios.rooms import Hall, Room, Solids, moved, solids
from toddle.navigate.scenarios.textures import texture

CHEST_CAMERAS = RectifiedCameras(Pinhole(320, 240, 236.0, 236.0, 160.0, 120.0), 0.068)
"""Heicub's cameras after rectification (Huber 2019, table 4.3, rounded)."""

AHEAD, HEIGHT, PITCH = 0.097, 0.82, math.radians(20.0)
"""Where the cameras are on the chest of a Heicub that stands: ahead of the waist [m], above the floor [m], and how far
they look down [rad]. The picture then begins 0.76 m ahead on the floor and ends 7 degrees above eye level."""

_FINEST = 128


def resized(camera: Pinhole, width: int, height: int) -> Pinhole:
    """The same camera with other pixels, the picture's edges staying where they are."""
    across, down = width / camera.width, height / camera.height
    cx, cy = (camera.cx + 0.5) * across - 0.5, (camera.cy + 0.5) * down - 0.5
    return Pinhole(width, height, camera.fx * across, camera.fy * down, cx, cy)


SMALL = resized(CHEST_CAMERAS.camera, 80, 60)
"""What policies see: 60 x 80 pixels."""


class Eye(NamedTuple):
    """Where a camera is.

    Attributes:
        position: of its centre [m].
        axes: columns: its x (right), y (down) and z (ahead) in the room's frame.
    """

    position: Float[np.ndarray, "3"]
    axes: Float[np.ndarray, "3 3"]


def chest_eye(x: float, y: float, yaw: float, pitch: float = PITCH, aside: float = 0.0) -> Eye:
    """The camera of a robot whose waist is at x, y [m] and looks along yaw [rad], as it stands upright.

    Args:
        x: of the waist [m].
        y: likewise.
        yaw: of the waist [rad].
        pitch: how far the camera looks down [rad].
        aside: to the left of the chest's middle [m].
    """
    ahead, left = np.array([math.cos(yaw), math.sin(yaw), 0.0]), np.array([-math.sin(yaw), math.cos(yaw), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    looking = math.cos(pitch) * ahead - math.sin(pitch) * up
    down = -math.sin(pitch) * ahead - math.cos(pitch) * up
    position = np.array([x, y, HEIGHT]) + AHEAD * ahead + aside * left
    return Eye(position, np.column_stack([-left, down, looking]))


class View(NamedTuple):
    """What a camera sees.

    Attributes:
        picture: red, green, blue.
        depth: along the optical axis [m].
        thing: 0 the target, then the other things, then the people, then the hall.
    """

    picture: UInt8[np.ndarray, "rows columns 3"]
    depth: Float32[np.ndarray, "rows columns"]
    thing: Int[np.ndarray, "rows columns"]


@dataclass(frozen=True)
class RayCaster:
    """A room made ready for rays: its textures as a pyramid of means.

    Attributes:
        room: which.
        parts: all that is in it, people where they start.
        texels: of all levels of all textures.
        starts: the first texel of each level of each texture.
        sizes: side of each level [texels].
        tiles: side of each texture [m].
    """

    room: Room
    parts: Solids
    texels: UInt8[np.ndarray, "texels 3"]
    starts: Int[np.ndarray, "surfaces levels"]
    sizes: Int[np.ndarray, " levels"]
    tiles: Float[np.ndarray, " surfaces"]

    def view(self, eye: Eye, camera: Pinhole = SMALL, people: Float[np.ndarray, "people 2"] | None = None) -> View:
        """What a camera sees.

        Args:
            eye: where it is.
            camera: how it looks; it bends nothing.
            people: where they are [m]; None: where they start.
        """
        parts, light = self.parts if people is None else moved(self.parts, self.room, people), self.room.light
        depth, solid = _cast(parts, self.room.hall, eye, camera)
        picture = np.empty((*depth.shape, 3), np.uint8)
        raycast_kernels.shade(
            parts.middle, parts.half, parts.yaw, parts.round, parts.surface, eye.position, eye.axes,
            camera.fx, camera.fy, camera.cx, camera.cy, depth, solid, self.texels, self.starts, self.sizes, self.tiles,
            np.array(light.ambient), np.array(light.directions).reshape(-1, 3), np.array(light.colours).reshape(-1, 3),
            picture,
        )  # fmt: skip
        return View(picture, depth, parts.thing[solid])


def ray_caster(room: Room) -> RayCaster:
    """A room made ready for rays."""
    sizes = [_FINEST >> level for level in range(_FINEST.bit_length())]
    levels, starts, at = [], [], 0
    for surface in room.surfaces:
        fine = texture(surface, _FINEST).astype(float)
        for size in sizes:
            starts.append(at)
            coarse = fine.reshape(size, _FINEST // size, size, _FINEST // size, 3).mean(axis=(1, 3))
            levels.append(np.rint(coarse).astype(np.uint8).reshape(-1, 3))
            at += size * size
    table = np.array(starts, np.int32).reshape(len(room.surfaces), len(sizes))
    tiles = np.array([surface.tile for surface in room.surfaces])
    return RayCaster(room, solids(room), np.concatenate(levels), table, np.array(sizes, np.int32), tiles)


def seen_things(room: Room, eye: Eye, camera: Pinhole = SMALL) -> Int[np.ndarray, "rows columns"]:
    """Which thing each pixel shows, without its colour: 0 is the target."""
    parts = solids(room)
    return parts.thing[_cast(parts, room.hall, eye, camera)[1]]


def _cast(
    parts: Solids, hall: Hall, eye: Eye, camera: Pinhole
) -> tuple[Float32[np.ndarray, "rows columns"], Int[np.ndarray, "rows columns"]]:
    depth = np.empty((camera.height, camera.width), np.float32)
    solid = np.empty((camera.height, camera.width), np.int32)
    within = np.array([hall.x, hall.y, hall.yaw, *hall.half, hall.height])
    raycast_kernels.cast(
        parts.middle, parts.half, parts.yaw, parts.round, within, eye.position, eye.axes,
        camera.fx, camera.fy, camera.cx, camera.cy, depth, solid,
    )  # fmt: skip
    return depth, solid
