"""Pinhole cameras, single and in pairs: frozen records in OpenCV's conventions (z ahead, x right, y down; pixels).

Distortion is OpenCV's five-parameter model: k1, k2, p1, p2, k3 (Brown 1971; Huber 2019, section 2.2.4).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput

STRAIGHT = (0.0, 0.0, 0.0, 0.0, 0.0)
"""The distortion of a camera that has none."""


@dataclass(frozen=True)
class Pinhole:
    """One camera.

    Attributes:
        width: of its picture [pixels].
        height: of its picture [pixels].
        fx: focal length across [pixels].
        fy: focal length down [pixels].
        cx: principal point across [pixels]; 0 is the middle of the leftmost pixel.
        cy: principal point down [pixels].
        distortion: k1, k2, p1, p2, k3.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, float, float, float, float] = STRAIGHT

    def __post_init__(self) -> None:
        """Refuses what is no camera.

        Raises:
            BadInput: which number.
        """
        numbers = (self.fx, self.fy, self.cx, self.cy, *self.distortion)
        if self.width < 1 or self.height < 1 or not np.isfinite(numbers).all() or min(self.fx, self.fy) <= 0:
            raise BadInput(f"{self} is no camera", where="camera", remedy="give a size, focal lengths above 0, finite")

    @property
    def matrix(self) -> Float[np.ndarray, "3 3"]:
        """K: from a point ahead to homogeneous pixels."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @property
    def distorts(self) -> bool:
        """Whether straight lines are bent."""
        return any(self.distortion)


@dataclass(frozen=True, eq=False)
class StereoCameras:
    """Two cameras that are fixed to each other.

    Attributes:
        left: the left one.
        right: the right one.
        rotation: R of x_right = R x_left + t.
        translation: t, in the right camera's frame [m]; its length is the baseline.
    """

    left: Pinhole
    right: Pinhole
    rotation: Float[np.ndarray, "3 3"]
    translation: Float[np.ndarray, "3"]

    @property
    def baseline(self) -> float:
        """Between the two centres [m]."""
        return float(np.linalg.norm(self.translation))


@dataclass(frozen=True)
class RectifiedCameras:
    """Two cameras after rectification: one ideal camera twice, apart along its x axis.

    Attributes:
        camera: without distortion.
        baseline: between the two [m].
    """

    camera: Pinhole
    baseline: float

    def depth(self, disparity: Float[np.ndarray, "*rows"]) -> Float[np.ndarray, "*rows"]:
        """Distance along the optical axis [m] for disparities [pixels]; infinite for 0 or less."""
        with np.errstate(divide="ignore"):
            return np.where(disparity > 0, self.camera.fx * self.baseline / np.maximum(disparity, 1e-12), np.inf)
