"""Small furnished rooms of which two imperfect cameras take pictures, with the depth that is true.

MuJoCo draws each room wide and fine through an ideal lens; the picture is then bent as the camera's lens bends
(Huber 2019, equations 2.144 and 2.145, on a table, as the series folds over at the picture's corners), turned as the
camera is turned, exposed and made noisy. The truth is drawn in the frame of the rectified left camera.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import mujoco
import numpy as np
from jaxtyping import Float, UInt8

from toddle.geometry.camera import Pinhole, RectifiedCameras, StereoCameras
from toddle.outside.simulation.pictures import drawing
from toddle.outside.simulation.stereo_rooms import Walls, furnished

BEHELD = RectifiedCameras(Pinhole(320, 240, 236.0, 236.0, 159.5, 119.5), 0.068)
"""What rectification makes of the cameras: the size and the baseline are those of Huber's robot."""

_LENSES = (
    Pinhole(320, 240, 236.12, 236.65, 162.94, 111.39, (-0.4543, 0.2895, -0.00273, 0.00022, -0.1213)),
    Pinhole(320, 240, 231.59, 232.10, 165.66, 119.44, (-0.4582, 0.3180, 0.00030, 0.00076, -0.1483)),
)  # after the calibration that Huber published with his program; the right principal point is brought nearer
_WIDEST = 1.09  # tangent of the ray at which the distortion folds over


@dataclass(frozen=True)
class Light:
    """How the pictures come out.

    Attributes:
        exposure: grey values are multiplied by this; 1 is a lit room.
        noise: standard deviation of a grey value.
        right: exposure of the right camera over that of the left.
    """

    exposure: float = 1.0
    noise: float = 3.0
    right: float = 1.0


class Pair(NamedTuple):
    """Two pictures, and how far everything is.

    Attributes:
        left: as the left camera gives it, distorted [RGB].
        right: as the right camera gives it.
        depth: along the axis of the rectified left camera [m].
    """

    left: UInt8[np.ndarray, "rows columns 3"]
    right: UInt8[np.ndarray, "rows columns 3"]
    depth: Float[np.ndarray, "rows columns"]


class Ways(NamedTuple):
    """Rotations from the raw left and right camera to the rectified ones, x_rectified = R x_raw."""

    left: Float[np.ndarray, "3 3"]
    right: Float[np.ndarray, "3 3"]


def misaligned_cameras(seed: int, degrees: float = 1.0) -> StereoCameras:
    """Two cameras with the document's lenses, turned against each other.

    Args:
        seed: of the turn.
        degrees: standard deviation of the turn about each axis.
    """
    turn = np.random.default_rng([seed, 7]).normal(0, math.radians(degrees), 3)
    rotation = cv2.Rodrigues(turn)[0]
    return StereoCameras(*_LENSES, rotation, rotation @ np.array([-BEHELD.baseline, 0.0, 0.0]))


def rectifying(cameras: StereoCameras) -> Ways:
    """How the raw cameras must be turned so that rows meet (Bouguet's method, OpenCV's `stereoRectify`)."""
    size = (cameras.left.width, cameras.left.height)
    lenses = [np.asarray(part) for lens in (cameras.left, cameras.right) for part in (lens.matrix, lens.distortion)]
    found = cv2.stereoRectify(*lenses, size, cameras.rotation, cameras.translation.reshape(3, 1))
    return Ways(found[0], found[1])


class StereoScene:
    """One room, and what draws it; close it after use."""

    def __init__(self, seed: int, walls: Walls = "rich", *, fine: float = 2.0) -> None:
        """Furnishes the room and opens what draws.

        Args:
            seed: of the room, its furniture and textures.
            walls: how much there is to see on them.
            fine: pixels drawn for each pixel of a picture, along each side.

        Raises:
            ToddleError: nothing here can draw.
        """
        self._fine = fine * BEHELD.camera.fx
        half = math.ceil(_WIDEST * self._fine)
        self._half = half
        self._model = furnished(seed, walls, 2 * half)
        self._data = mujoco.MjData(self._model)
        mujoco.mj_forward(self._model, self._data)
        self._scene = mujoco.MjvScene(self._model, maxgeom=500)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW.value] = 0
        self._gl, self._context = drawing(self._model, 2 * half, 2 * half)
        mujoco.mjv_updateScene(
            self._model, self._data, mujoco.MjvOption(), None, mujoco.MjvCamera(),
            mujoco.mjtCatBit.mjCAT_ALL.value, self._scene,
        )  # fmt: skip
        draw = np.random.default_rng([seed, 2])
        self._at = np.array([0.0, draw.uniform(-0.2, 0.2), draw.uniform(0.8, 1.1)])
        self._look = _looking(*np.radians(draw.normal([0, -14, 0], [8, 4, 2])))

    def pair(self, cameras: StereoCameras, light: Light = Light(), *, seed: int = 0) -> Pair:
        """Both pictures and the truth.

        Args:
            cameras: with which they are taken.
            light: how they come out.
            seed: of the noise.
        """
        draw, ways = np.random.default_rng([seed, 3]), rectifying(cameras)
        aside = self._at + self._look[:, 0] * cameras.baseline
        pictures = [
            _exposed(self._through(lens, at, self._look @ way), exposure, light.noise, draw)
            for lens, at, way, exposure in (
                (cameras.left, self._at, ways.left, light.exposure),
                (cameras.right, aside, ways.right, light.exposure * light.right),
            )
        ]
        return Pair(pictures[0], pictures[1], self.depth())

    def depth(self) -> Float[np.ndarray, "rows columns"]:
        """True depth along the axis of the rectified left camera [m], at its pixels' middles."""
        camera = BEHELD.camera
        self._aim(self._at, self._look, camera.width / 2 / camera.fx, camera.height / 2 / camera.fy)
        _, depth = self._draw(camera.width, camera.height)
        lens = self._scene.camera[0]
        near, far = lens.frustum_near, lens.frustum_far
        return near * far / (far - depth.astype(float) * (far - near))

    def close(self) -> None:
        """Give back what draws."""
        if self._context is not None:
            self._gl.make_current()
            self._context.free()
            self._gl.free()
            self._context = None

    def _through(self, lens: Pinhole, at: np.ndarray, look: np.ndarray) -> UInt8[np.ndarray, "rows columns 3"]:
        """What a lens sees; black where no ray comes through it."""
        half = self._half
        self._aim(at, look, half / self._fine, half / self._fine)
        drawn, _ = self._draw(2 * half, 2 * half)
        smooth = cv2.GaussianBlur(drawn, (0, 0), 0.4 * self._fine / BEHELD.camera.fx)
        across, down = np.meshgrid(np.arange(lens.width, dtype=float), np.arange(lens.height, dtype=float))
        x, y = _rays(lens, across, down)
        u, v = (half - 0.5 + self._fine * ray for ray in (x, y))
        return cv2.remap(smooth, u.astype(np.float32), v.astype(np.float32), cv2.INTER_LINEAR)

    def _aim(self, at: np.ndarray, look: np.ndarray, across: float, down: float) -> None:
        """A camera whose axes x, y, z (right, down, ahead) are the columns of ``look``; tangents of its half angles."""
        for lens in self._scene.camera:
            lens.pos, lens.forward, lens.up = at, look[:, 2], -look[:, 1]
            lens.frustum_near, lens.frustum_far = 0.05, 20.0
            lens.frustum_center = 0.0
            lens.frustum_width = 0.05 * across
            lens.frustum_top, lens.frustum_bottom = 0.05 * down, -0.05 * down

    def _draw(self, width: int, height: int) -> tuple[UInt8[np.ndarray, "h w 3"], Float[np.ndarray, "h w"]]:
        self._gl.make_current()
        size = mujoco.MjrRect(0, 0, width, height)
        pixels, depth = np.empty((height, width, 3), np.uint8), np.empty((height, width), np.float32)
        mujoco.mjr_render(size, self._scene, self._context)
        mujoco.mjr_readPixels(pixels, depth, size, self._context)
        return np.ascontiguousarray(pixels[::-1]), np.ascontiguousarray(depth[::-1])


def _rays(lens: Pinhole, across: np.ndarray, down: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Undistorted x/z and y/z of distorted pixels; far outside where the distortion has folded over.

    The radial part is inverted on a table; the tangential part, a few hundredths of a pixel, by three iterations.
    """
    k1, k2, p1, p2, k3 = lens.distortion
    xd, yd = (across - lens.cx) / lens.fx, (down - lens.cy) / lens.fy
    r = np.linspace(0, 2, 4001)
    bent = r * (1 + k1 * r**2 + k2 * r**4 + k3 * r**6)
    folded = np.flatnonzero(np.diff(bent) <= 0)
    last = int(folded[0]) if len(folded) else len(r) - 1
    x, y = xd, yd
    for _ in range(3):
        square = x * x + y * y
        xr = xd - (2 * p1 * x * y + p2 * (square + 2 * x * x))
        yr = yd - (p1 * (square + 2 * y * y) + 2 * p2 * x * y)
        radius = np.hypot(xr, yr)
        scale = np.interp(radius, bent[: last + 1], r[: last + 1]) / np.maximum(radius, 1e-9)
        x, y = scale * xr, scale * yr
    return np.where(radius < bent[last], x, 9.0), np.where(radius < bent[last], y, 9.0)


def _exposed(picture: np.ndarray, exposure: float, noise: float, draw: np.random.Generator) -> np.ndarray:
    grey = picture.astype(np.float32) * np.float32(exposure)
    return np.clip(np.rint(grey + noise * draw.standard_normal(grey.shape, np.float32)), 0, 255).astype(np.uint8)


def _looking(yaw: float, pitch: float, roll: float) -> Float[np.ndarray, "3 3"]:
    """Axes of a camera that looks along the world's x, turned left, up and about its axis [rad]."""
    ahead = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    turns = [cv2.Rodrigues(np.array(turn))[0] for turn in ([0, -yaw, 0], [pitch, 0, 0], [0, 0, roll])]
    return ahead @ turns[0] @ turns[1] @ turns[2]
