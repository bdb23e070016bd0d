"""The robot's eyes while it drives through a room: chest cameras with the faults of real ones, depth, a small picture.

Depth comes from the pair of pictures; where nothing here can draw them, from the ray-caster's truth, with errors that
grow with the square of the distance, as those of a disparity do, and with holes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float, Float32, UInt8

from toddle.navigate.scenarios.raycast import CHEST_CAMERAS
from toddle.navigate.scenarios.rooms import Room
from toddle.navigate.sight import COLUMNS, ROWS, Sight
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.outside.simulation.stereo_cameras import CastCamera, StereoCamera, open_cameras

_NEAREST = CHEST_CAMERAS.camera.fx * CHEST_CAMERAS.baseline / 32  # that 32 disparities reach [m]
_MISS = 0.25  # of a disparity [pixels]
_BANK = 1 << 18  # random numbers that are drawn once and used from anywhere


@dataclass(frozen=True)
class EyeOptions:
    """How the eyes see.

    Attributes:
        kind: stereo: pictures drawn by OpenGL, or cast where there is none; cast: small pictures by rays.
        noise: standard deviation of each pixel, of 255.
        light: what an episode's pictures are brighter or darker by, at most, as a share.
        holes: share of the small picture without depth, where depth is not computed from pictures.
    """

    kind: Literal["stereo", "cast"] = "stereo"
    noise: float = 2.0
    light: float = 0.12
    holes: float = 0.05


class Eyes:
    """Cameras in a room, open."""

    def __init__(self, simulation: HumanoidSimulation, room: Room, options: EyeOptions, seed: int) -> None:
        """Opens the cameras.

        Args:
            simulation: made by `rooms.room_simulation`.
            room: of the simulation.
            options: how they see.
            seed: of the noise.
        """
        drawn = options.kind == "stereo"
        self._camera: StereoCamera | CastCamera = (
            open_cameras(simulation, room) if drawn else CastCamera(simulation, room)
        )
        if isinstance(self._camera, CastCamera):
            self._camera = CastCamera(simulation, room)
        self._options, self._draw = options, np.random.default_rng([seed, 60])
        self._gain = 1.0 + self._draw.uniform(-options.light, options.light)
        self._bank = (options.noise * self._draw.standard_normal(_BANK)).astype(np.float32)

    def see(self) -> Sight:
        """One look."""
        seen = self._camera.see()
        left = self._taken(seen.left)
        return Sight(_small_picture(left), self._worse(_small_depth(seen.depth)))

    def close(self) -> None:
        """Give back what draws."""
        self._camera.close()

    def _taken(self, picture: UInt8[np.ndarray, "rows columns 3"]) -> UInt8[np.ndarray, "rows columns 3"]:
        """As a camera takes it: brighter or darker, with noise."""
        noise = np.resize(np.roll(self._bank, -int(self._draw.integers(_BANK))), picture.shape)
        return np.clip(self._gain * picture + noise, 0.0, 255.0).astype(np.uint8)

    def _worse(self, depth: Float32[np.ndarray, "60 80"]) -> Float32[np.ndarray, "60 80"]:
        camera = CHEST_CAMERAS
        miss = _MISS / (camera.camera.fx * camera.baseline) * self._draw.standard_normal(depth.shape)
        found = depth + miss * depth**2
        hidden = (self._draw.random(depth.shape) < self._options.holes) | (found < _NEAREST)
        return np.where(hidden, 0.0, found).astype(np.float32)


def _small_picture(picture: UInt8[np.ndarray, "rows columns 3"]) -> UInt8[np.ndarray, "60 80 3"]:
    """Means over squares of pixels."""
    rows, columns, _ = picture.shape
    blocks = picture.reshape(ROWS, rows // ROWS, COLUMNS, columns // COLUMNS, 3)
    return np.rint(blocks.mean(axis=(1, 3))).astype(np.uint8)


def _small_depth(depth: Float32[np.ndarray, "rows columns"]) -> Float[np.ndarray, "60 80"]:
    rows, columns = depth.shape
    return depth.reshape(ROWS, rows // ROWS, COLUMNS, columns // COLUMNS).mean(axis=(1, 3)).astype(float)
