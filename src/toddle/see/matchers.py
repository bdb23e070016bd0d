"""Where is the same thing in the other picture? Disparities of a rectified pair, and how far each can be trusted.

Everything that answers this is a `Matcher`: block matching (Huber 2019, equation 2.133) with the document's confidence
from variance and left-right consistency (equations 2.134 to 2.138) or with a quicker one, semi-global matching
(Hirschmueller 2008), or what somebody has learned. A matcher is a frozen value; it keeps nothing between pictures.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable

import cv2
import numpy as np
from jaxtyping import Float32, Int16, UInt8

from toddle.failures import BadInput

_PARTS = 16  # of a pixel, in which OpenCV counts disparities
_ROLL_OFF = 0.001 * _PARTS**2  # r of equation 2.137 [1/pixels^2], OpenCV's
_AGREE = 24 / _PARTS  # t of equation 2.138 [pixels], OpenCV's
_DOUBTFUL = 0.1  # confidence beside a jump
_JUMP = 1.5  # pixels within three by three

Grey = UInt8[np.ndarray, "rows columns"]


class Found(NamedTuple):
    """What a matcher finds.

    Attributes:
        disparity: columns in the left picture less those in the right one [pixels]; 0 where none was found.
        confidence: 0 (none was found) to 1.
    """

    disparity: Float32[np.ndarray, "rows columns"]
    confidence: Float32[np.ndarray, "rows columns"]


@runtime_checkable
class Matcher(Protocol):
    """Finds disparities."""

    @property
    def smallest(self) -> int:
        """Pictures must have at least so many rows and columns [pixels]."""
        ...

    def find(self, left: Grey, right: Grey) -> Found:
        """Disparities of the left picture.

        Args:
            left: brightness.
            right: likewise; what stands in a row of one stands in the same row of the other.
        """
        ...


@dataclass(frozen=True)
class DocumentMatching:
    """Block matching as the document does it: every match is looked for in both directions.

    Attributes:
        window: N, the side of a block [pixels], odd.
        disparities: D, the largest that is looked for [pixels], a multiple of 16.
    """

    window: int = 13
    disparities: int = 32

    def __post_init__(self) -> None:
        """Refuses sizes that OpenCV can't do."""
        _check(self.window, self.disparities, 5)

    @property
    def smallest(self) -> int:
        """Pictures must have at least so many rows and columns [pixels]."""
        return self.disparities + self.window + 1

    def find(self, left: Grey, right: Grey) -> Found:
        """Disparities of the left picture, with equation 2.138 as their confidence."""
        matcher = cv2.StereoBM.create(self.disparities, self.window)
        matcher.setTextureThreshold(0)
        matcher.setUniquenessRatio(0)
        there = _pixels(matcher.compute(left, right))
        back = _pixels(cv2.ximgproc.createRightMatcher(matcher).compute(right, left))
        reach = int(np.ceil(0.33 * self.window))
        sure, sure_back = (_steady(disparity, 2 * reach + 1) for disparity in (there, back))
        columns = np.arange(left.shape[1])[None] - np.trunc(there).astype(np.int64)
        rows = np.arange(left.shape[0])[:, None]
        inside = (columns >= 0) & (there >= 0)
        columns = np.clip(columns, 0, left.shape[1] - 1)
        agree = inside & (np.abs(there + back[rows, columns]) < np.float32(_AGREE))
        half = self.window // 2
        both = np.where(agree, np.minimum(sure, sure_back[rows, columns]), np.float32(0))
        unchecked = columns > left.shape[1] - self.disparities - half  # nothing was looked for from there
        sure = np.where(unchecked, sure, both)
        sure[:, : self.disparities - 1 + half] = 0  # not every disparity was looked for there
        sure[:half], sure[-half:], sure[:, -half:] = 0, 0, 0
        return Found(np.where(sure > 0, there, np.float32(0)), sure)


@dataclass(frozen=True)
class BlockMatching:
    """Block matching that checks itself: quicker, and up to the left edge.

    Attributes:
        window: N, the side of a block [pixels], odd.
        disparities: D, the largest that is looked for [pixels], a multiple of 16.
        texture: least sum of slopes in a block, so that walls without texture stay unknown.
        uniqueness: by how much the best match must be better than the next [%].
        contrast: slopes [grey values] from which on texture is fully trusted; 0: all is trusted alike.
    """

    window: int = 9
    disparities: int = 32
    texture: int = 20
    uniqueness: int = 10
    contrast: float = 0.0

    def __post_init__(self) -> None:
        """Refuses sizes that OpenCV can't do."""
        _check(self.window, self.disparities, 5)

    @property
    def smallest(self) -> int:
        """Pictures must have at least so many rows and columns [pixels]."""
        return self.window + 1

    def find(self, left: Grey, right: Grey) -> Found:
        """Disparities of the left picture."""
        matcher = cv2.StereoBM.create(self.disparities, self.window)
        matcher.setTextureThreshold(self.texture)
        matcher.setUniquenessRatio(self.uniqueness)
        matcher.setDisp12MaxDiff(1)
        found = _trusted(_padded(matcher, left, right, self.disparities))
        if not self.contrast:
            return found
        slopes = cv2.convertScaleAbs(cv2.Sobel(left, cv2.CV_16S, 1, 0))
        texture = cv2.boxFilter(slopes, cv2.CV_32F, (self.window, self.window))
        weight = np.minimum(texture * np.float32(1 / self.contrast), np.float32(1))
        return Found(found.disparity, np.asarray(found.confidence * weight))


@dataclass(frozen=True)
class SemiGlobal:
    """Semi-global matching: neighbours with other disparities cost something.

    Attributes:
        window: the side of a block [pixels], odd.
        disparities: the largest that is looked for [pixels], a multiple of 16.
        step: cost of a disparity that differs by one from the neighbour's, for each pixel of a block.
        jump: cost of one that differs by more.
        uniqueness: by how much the best match must be better than the next [%].
    """

    window: int = 5
    disparities: int = 32
    step: int = 8
    jump: int = 32
    uniqueness: int = 5

    def __post_init__(self) -> None:
        """Refuses sizes that OpenCV can't do."""
        _check(self.window, self.disparities, 1)

    @property
    def smallest(self) -> int:
        """Pictures must have at least so many rows and columns [pixels]."""
        return self.window + 1

    def find(self, left: Grey, right: Grey) -> Found:
        """Disparities of the left picture."""
        area = self.window**2
        matcher = cv2.StereoSGBM.create(
            0, self.disparities, self.window, self.step * area, self.jump * area, disp12MaxDiff=1, preFilterCap=31,
            uniquenessRatio=self.uniqueness, mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
        )  # fmt: skip
        return _trusted(_padded(matcher, left, right, self.disparities))


def _check(window: int, disparities: int, least: int) -> None:
    if window % 2 == 0 or not least <= window <= 51:
        raise BadInput(f"blocks of {window} pixels", where="matcher", remedy=f"give an odd number, {least} to 51")
    if disparities % 16 or not 16 <= disparities <= 1024:
        raise BadInput(f"{disparities} disparities", where="matcher", remedy="give a multiple of 16, 16 to 1024")


def _padded(matcher: cv2.StereoMatcher, left: Grey, right: Grey, room: int) -> Float32[np.ndarray, "rows columns"]:
    """Disparities up to the left edge; negative where there is none."""
    wide = (cv2.copyMakeBorder(one, 0, 0, room, 0, cv2.BORDER_REPLICATE) for one in (left, right))
    return _pixels(matcher.compute(*wide)[:, room:])


def _pixels(found: Int16[np.ndarray, "rows columns"]) -> Float32[np.ndarray, "rows columns"]:
    return found.astype(np.float32) * np.float32(1 / _PARTS)


def _trusted(found: Float32[np.ndarray, "rows columns"]) -> Found:
    """Trust what was found and lies in both pictures, less beside a jump or a hole."""
    there = (found > 0) & (found <= np.arange(found.shape[1], dtype=np.float32))
    block = np.ones((3, 3), np.uint8)
    jump = cv2.morphologyEx(found, cv2.MORPH_GRADIENT, block) > np.float32(_JUMP)
    trust = np.where(jump, np.float32(_DOUBTFUL), np.float32(1)) * there
    return Found(np.where(there, found, np.float32(0)), np.asarray(trust, np.float32))


def _steady(disparity: Float32[np.ndarray, "rows columns"], side: int) -> Float32[np.ndarray, "rows columns"]:
    """Confidence from the variance around each pixel (equations 2.134 to 2.137)."""
    mean = cv2.blur(disparity, (side, side))
    square = cv2.blur(disparity * disparity, (side, side))
    return np.maximum(np.float32(1) - np.float32(_ROLL_OFF) * (square - mean * mean), np.float32(0))
