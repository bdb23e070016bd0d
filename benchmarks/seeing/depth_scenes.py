"""What two imperfect cameras see of rooms, and what is true: pictures for the bench of depth.

MuJoCo draws a room wide and fine through two ideal lenses side by side; each pixel of a picture is then the mean of
many rays through its own lens, turned as that camera is turned. The truth is told in the frame that depth is told in:
the rectified left camera's, as it was calibrated, of what its pixels truly show.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal, NamedTuple

import cv2
import numpy as np
from jaxtyping import Float, Float32, UInt8

from toddle.geometry.camera import Pinhole, StereoCameras
from toddle.navigate.scenarios.rooms import Room, Surface
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.outside.simulation.rooms import LEFT, RIGHT, room_simulation
from toddle.outside.simulation.stereo_cameras import StereoCamera, StereoPicture
from toddle.robots.humanoid import Humanoid
from toddle.see.chessboard import Chessboard
from toddle.see.lens import rays_of
from toddle.see.painted_boards import BoardPainter
from toddle.see.rectify import Rectification

Look = Literal["as drawn", "rich", "medium", "plain"]
LOOKS: tuple[Look, ...] = ("as drawn", "rich", "medium", "plain")
"""Of a room's surfaces: `as drawn` leaves them as they are."""
_GRAIN = {"rich": 0.25, "medium": 0.1, "plain": 0.015}
_TILE = {"rich": 0.5, "medium": 1.0, "plain": 1.0}  # [m]
_WIDE = 1.5  # times as wide as the chest's cameras see
_DRAWN = 1280, 960


class Taken(NamedTuple):
    """A pair as the cameras give it, and what they looked at.

    Attributes:
        left: red, green, blue, distorted.
        right: likewise.
        seen: what was drawn, without lenses.
    """

    left: UInt8[np.ndarray, "rows columns 3"]
    right: UInt8[np.ndarray, "rows columns 3"]
    seen: StereoPicture


class Exposure(NamedTuple):
    """How pictures come out: `light` scales them; `noise` is the standard deviation of a grey value."""

    light: float = 1.0
    noise: float = 3.0


LIT, DIM = Exposure(), Exposure(0.25, 6.0)


def covered(room: Room, look: Look) -> Room:
    """The room with other surfaces."""
    if look == "as drawn":
        return room
    return replace(room, surfaces=tuple(_covered(surface, look) for surface in room.surfaces))


def _covered(surface: Surface, look: Look) -> Surface:
    tile, pattern = min(surface.tile, _TILE[look]), "plain" if look == "plain" else surface.pattern
    return replace(surface, grain=_GRAIN[look], tile=tile, pattern=pattern)


class Stage:
    """A room with a robot in it whose cameras are imperfect; close it after use."""

    def __init__(self, humanoid: Humanoid, room: Room) -> None:
        """Opens what draws."""
        self.room = room
        self.simulation = room_simulation(humanoid, room)
        model = self.simulation.model
        for name in (LEFT, RIGHT):
            model.cam_sensorsize[model.camera(name).id] *= _WIDE
        self._camera = StereoCamera(self.simulation, *_DRAWN)

    def take(self, painters: Painters, exposure: Exposure, rng: np.random.Generator) -> Taken:
        """Both pictures from where the robot stands."""
        seen = self._camera.see()
        pair = [
            painter.paint(one, exposure, rng) for painter, one in zip(painters, (seen.left, seen.right), strict=True)
        ]
        return Taken(pair[0], pair[1], seen)

    def close(self) -> None:
        """Give back what draws."""
        self._camera.close()


def stand(simulation: HumanoidSimulation, room: Room, rng: np.random.Generator) -> None:
    """Put the robot somewhere free, one of the room's things before it, swaying a little."""
    circles, (a, b) = room.circles, room.hall.half
    cos, sin = math.cos(room.hall.yaw), math.sin(room.hall.yaw)
    while True:
        own = rng.uniform(-1, 1, 2) * (a - 0.6, b - 0.6)
        x, y = room.hall.x + cos * own[0] - sin * own[1], room.hall.y + sin * own[0] + cos * own[1]
        if np.all(np.hypot(circles[:, 0] - x, circles[:, 1] - y) > circles[:, 2] + 0.6):
            break
    thing = circles[rng.integers(len(circles))]
    yaw = math.atan2(thing[1] - y, thing[0] - x) + math.radians(rng.normal(0, 15))
    pitch, roll = np.deg2rad(rng.normal(0, (2.0, 1.5)))
    turns = (cv2.Rodrigues(np.array(turn))[0] for turn in ((0, 0, yaw), (0, pitch, 0), (roll, 0, 0)))
    z, y_axis, x_axis = turns
    simulation.data.qpos[0:2] = x, y
    simulation.data.qpos[3:7] = _quaternion(z @ y_axis @ x_axis)


def _quaternion(rotation: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "4"]:
    turn = cv2.Rodrigues(rotation)[0].ravel()
    angle = float(np.linalg.norm(turn))
    return np.append(math.cos(angle / 2), math.sin(angle / 2) * turn / max(angle, 1e-12))


class Painter:
    """What was drawn, as one camera sees it."""

    def __init__(self, camera: Pinhole, to_drawn: Float[np.ndarray, "3 3"]) -> None:
        """Traces each ray once.

        Args:
            camera: with its distortion.
            to_drawn: its rotation into the drawing camera's frame.
        """
        rays = BoardPainter(camera, Chessboard()).rays.astype(float)
        self._fine = rays.shape[0] // camera.height
        self._where = drawn_pixels(rays, to_drawn)
        self._size = camera.width, camera.height

    def paint(
        self, drawn: UInt8[np.ndarray, "high wide 3"], exposure: Exposure, rng: np.random.Generator
    ) -> UInt8[np.ndarray, "rows columns 3"]:
        """The picture; black where no ray comes through the lens."""
        fine = cv2.remap(drawn, self._where, None, cv2.INTER_LINEAR)  # type: ignore[call-overload]
        light = cv2.resize(fine.astype(np.float32), self._size, interpolation=cv2.INTER_AREA)
        noisy = light * exposure.light + exposure.noise * rng.normal(size=light.shape)
        return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


Painters = tuple[Painter, Painter]


def painters(cameras: StereoCameras) -> Painters:
    """Of both cameras, as they are turned against the baseline."""
    left = _left_from_drawn(cameras).T
    return Painter(cameras.left, left), Painter(cameras.right, left @ cameras.rotation.T)


def true_depth(seen: StereoPicture, cameras: StereoCameras, made: Rectification) -> Float32[np.ndarray, "rows columns"]:
    """How far what each rectified pixel shows is along the rectified left camera's axis [m]; NaN: it shows nothing.

    Args:
        seen: what was drawn.
        cameras: as they truly are.
        made: the rectification that was calibrated.
    """
    rays = rays_of(cameras.left, made.left.source.astype(float))
    to_left = _left_from_drawn(cameras)
    where = drawn_pixels(rays, to_left.T)
    inside = np.all((where >= 0) & (where <= (_DRAWN[0] - 1, _DRAWN[1] - 1)), axis=-1) & made.left.valid
    depth = cv2.remap(seen.depth, where, None, cv2.INTER_NEAREST)  # type: ignore[call-overload]
    ahead = np.concatenate([rays, np.ones_like(rays[..., :1])], axis=-1)
    drawn = ahead @ to_left  # rows: its transpose turns them
    along = depth / drawn[..., 2] * (ahead @ made.rotations[0][2])
    return np.where(inside, along, np.nan).astype(np.float32)


def drawn_pixels(
    rays: Float[np.ndarray, "rows columns 2"], to_drawn: Float[np.ndarray, "3 3"]
) -> Float32[np.ndarray, "rows columns 2"]:
    """Where rays of a camera are found in what was drawn."""
    ahead = np.concatenate([rays, np.ones_like(rays[..., :1])], axis=-1) @ to_drawn.T
    focal = 236.0 * _DRAWN[0] / 320 / _WIDE
    # the chest's cameras look through (160, 120) of 320 x 240
    middle = np.array([(160.5 - 160) / _WIDE + 160, (120.5 - 120) / _WIDE + 120]) * _DRAWN[0] / 320 - 0.5
    pixels = ahead[..., :2] / ahead[..., 2:] * focal + middle
    return np.where(np.isfinite(pixels), pixels, -100).astype(np.float32)


def _left_from_drawn(cameras: StereoCameras) -> Float[np.ndarray, "3 3"]:
    """From the drawing camera's frame, whose x axis leads to the other one, to the true left camera's."""
    across = -cameras.rotation.T @ cameras.translation
    across = across / np.linalg.norm(across)
    axis = np.cross([1.0, 0.0, 0.0], across)
    sine = float(np.linalg.norm(axis))
    return cv2.Rodrigues(axis / max(sine, 1e-12) * math.atan2(sine, across[0]))[0]
