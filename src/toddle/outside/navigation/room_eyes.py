"""The robot's eyes while it drives through a room: chest cameras with the faults of real ones, depth, a small picture.

Depth comes from the pair of pictures (`toddle.see.depth`, the live setting). Where nothing here can draw them it is the
ray-caster's, with errors that grow with the square of the distance, as those of a disparity do, and with holes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from jaxtyping import Float32, UInt8

from toddle.failures import BadInput
from toddle.navigate.scenarios.raycast import CHEST_CAMERAS
from toddle.navigate.scenarios.rooms import Room
from toddle.navigate.sight import COLUMNS, ROWS, Sight
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.outside.simulation.stereo_cameras import CastCamera, StereoCamera, open_cameras
from toddle.see.depth import depth_of
from toddle.see.shrink import shrunk

_NEAREST = CHEST_CAMERAS.camera.fx * CHEST_CAMERAS.baseline / 32  # that 32 disparities reach [m]
_MISS = 0.25  # of a disparity [pixels]
_BANK = 1 << 20  # random numbers that are drawn once and used from anywhere


@dataclass(frozen=True)
class EyeOptions:
    """How the eyes see.

    Attributes:
        kind: stereo: two drawn pictures, or what is cast where nothing can draw; cast: a small picture by rays.
        noise: standard deviation of each pixel, of 255.
        light: what a drive's pictures are brighter or darker by, at most, as a share.
        holes: share of the small picture without depth, where depth is not that of two pictures.
    """

    kind: Literal["stereo", "cast"] = "stereo"
    noise: float = 2.0
    light: float = 0.12
    holes: float = 0.05

    def __post_init__(self) -> None:
        """Refuses what no camera has.

        Raises:
            BadInput: a number out of its range.
        """
        for name, most in (("noise", 128.0), ("light", 1.0), ("holes", 1.0)):
            if not 0 <= getattr(self, name) <= most:
                raise BadInput(f"{getattr(self, name)} is no use", where=f"eyes, {name}", remedy=f"give 0 to {most:g}")


class Eyes:
    """Cameras in a room, open.

    Attributes:
        stereo: whether depth is that of two pictures.
    """

    def __init__(self, simulation: HumanoidSimulation, room: Room, options: EyeOptions, seed: int) -> None:
        """Opens the cameras.

        Args:
            simulation: made by `rooms.room_simulation`.
            room: of the simulation.
            options: how they see.
            seed: of the noise.
        """
        camera = open_cameras(simulation, room) if options.kind == "stereo" else None
        self.stereo = isinstance(camera, StereoCamera)
        self._camera = camera if isinstance(camera, StereoCamera) else CastCamera(simulation, room)
        self._options, self._draw = options, np.random.Generator(np.random.SFC64([seed, 60]))
        self._gain = 1.0 + float(self._draw.uniform(-options.light, options.light))
        self._bank = np.rint(options.noise * self._draw.standard_normal(_BANK, np.float32)).astype(np.int16)

    def see(self) -> Sight:
        """One look."""
        seen = self._camera.see()
        left = self._taken(seen.left)
        if self.stereo:
            depth = shrunk(depth_of(left, self._taken(seen.right), self._camera.cameras), ROWS, COLUMNS)
        else:
            depth = self._worse(seen.depth)
        picture = cv2.resize(left, (COLUMNS, ROWS), interpolation=cv2.INTER_AREA)
        return Sight(picture.astype(np.uint8, copy=False), depth)

    def close(self) -> None:
        """Give back what draws."""
        self._camera.close()

    def _taken(self, picture: UInt8[np.ndarray, "rows columns 3"]) -> UInt8[np.ndarray, "rows columns 3"]:
        """As a camera takes it: brighter or darker, with noise."""
        at = int(self._draw.integers(_BANK - picture.size))
        noise = self._bank[at : at + picture.size].reshape(picture.shape)
        brighter = cv2.convertScaleAbs(picture, alpha=self._gain)
        return np.asarray(cv2.add(brighter, noise, dtype=cv2.CV_8U), np.uint8)

    def _worse(self, depth: Float32[np.ndarray, "60 80"]) -> Float32[np.ndarray, "60 80"]:
        """As two pictures would tell it."""
        per_pixel = _MISS / (CHEST_CAMERAS.camera.fx * CHEST_CAMERAS.baseline)
        found = depth + per_pixel * self._draw.standard_normal(depth.shape, np.float32) * depth**2
        hidden = (self._draw.random(depth.shape, np.float32) < self._options.holes) | (found < _NEAREST)
        return np.where(hidden, 0.0, found).astype(np.float32)
