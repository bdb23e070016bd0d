"""From two rectified pictures to depth: match, smooth, divide (Huber 2019, section 2.2.4 and figure 2.24).

A `Setting` says how. `DOCUMENT` is the document's own; `LIVE` works on pictures of half the size and is quick enough
for a robot that walks; `BEST` takes its time. `SETTINGS` names them all.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Bool, Float32, UInt8

from toddle.failures import BadInput
from toddle.geometry.camera import RectifiedCameras
from toddle.see.filters import Guided, LeastSquares, Smoother
from toddle.see.matchers import BlockMatching, DocumentMatching, Found, Grey, Matcher, SemiGlobal
from toddle.signals import DepthImage

_BLACK, _SATURATED = 3, 252  # grey values that tell nothing


@dataclass(frozen=True)
class Setting:
    """How depth is found.

    Attributes:
        matcher: finds disparities.
        smoother: fills in the rest.
        match_at: a picture's share of its width at which it is matched: 1 or 2 (half).
        smooth_at: likewise for smoothing.
        sufficient: confidence from which on a pixel counts as valid.
    """

    matcher: Matcher
    smoother: Smoother
    match_at: int = 1
    smooth_at: int = 1
    sufficient: float = 0.5


LIVE = Setting(BlockMatching(5, 16, texture=20), Guided(4, 12, 30.0), match_at=2, smooth_at=2)
"""Half the size throughout."""
BEST = Setting(BlockMatching(7, 32, contrast=8.0), LeastSquares(3e3, 1.0), smooth_at=2)
"""Matched at full size, smoothed at half."""
DOCUMENT = Setting(DocumentMatching(13, 32), LeastSquares(1e4, 1.0))
"""The document's: N = 13, D = 32, lambda = 1e4, sigma = 1."""
SEMI_GLOBAL = Setting(SemiGlobal(5, 32), LeastSquares(1e3, 1.0), smooth_at=2)
"""Semi-global matching."""
SETTINGS = {"live": LIVE, "best": BEST, "document": DOCUMENT, "semi-global": SEMI_GLOBAL}
"""By name."""


class Stages(NamedTuple):
    """What depth is made of.

    Attributes:
        left: brightness of the left picture.
        right: brightness of the right one.
        found: by the matcher, at the size at which it works, disparities in its own pixels.
        smoothed: at the pictures' size, in their pixels.
    """

    left: Grey
    right: Grey
    found: Found
    smoothed: Found


def depth_of(
    left: UInt8[np.ndarray, "rows columns *colours"], right: UInt8[np.ndarray, "rows columns *colours"],
    cameras: RectifiedCameras, settings: Setting = LIVE, *,
    seen: Bool[np.ndarray, "rows columns"] | None = None,
) -> DepthImage:  # fmt: skip
    """Depth in the rectified left camera.

    Args:
        left: rectified picture: red, green, blue, or grey.
        right: likewise.
        cameras: what took them.
        settings: how.
        seen: pixels of the left picture that its camera saw; all unless given.

    Raises:
        BadInput: the pictures are not of one size, or too small.
    """
    stages = stages_of(left, right, settings)
    return image_of(stages, cameras, settings, seen)


def stages_of(
    left: UInt8[np.ndarray, "rows columns *colours"], right: UInt8[np.ndarray, "rows columns *colours"],
    settings: Setting,
) -> Stages:  # fmt: skip
    """Everything on the way to depth; as `depth_of`."""
    if left.shape != right.shape:
        raise BadInput("they are not of one size", where="pictures", remedy="give two of the same cameras")
    ours, theirs = (one if one.ndim == 2 else cv2.cvtColor(one, cv2.COLOR_RGB2GRAY) for one in (left, right))
    least = settings.matcher.smallest * settings.match_at
    if min(ours.shape) < least:
        what = f"{ours.shape[1]} x {ours.shape[0]} pixels are too few"
        raise BadInput(what, where="pictures", remedy=f"give {least} or more each way")
    small = tuple(_smaller(one, settings.match_at) for one in (ours, theirs))
    found = settings.matcher.find(*small)
    guide = small[0] if settings.smooth_at == settings.match_at else _smaller(ours, settings.smooth_at)
    smoothed = settings.smoother.smooth(_as_large(found, guide), guide)
    return Stages(ours, theirs, found, _as_large(smoothed, ours))


def image_of(
    stages: Stages, cameras: RectifiedCameras, settings: Setting, seen: Bool[np.ndarray, "rows columns"] | None = None
) -> DepthImage:
    """The depth that follows; as `depth_of`."""
    disparity, confidence = stages.smoothed
    known = disparity > 0
    lit = cv2.inRange(stages.left, np.array(_BLACK), np.array(_SATURATED)) > 0
    valid = known & lit & (confidence > np.float32(settings.sufficient))
    valid &= disparity <= np.arange(disparity.shape[1], dtype=np.float32)
    if seen is not None:
        valid &= seen
    there = np.where(known, disparity, np.float32(np.nan))
    depth = np.float32(cameras.camera.fx * cameras.baseline) / there
    return DepthImage(there, depth, confidence, valid)


def _smaller(picture: Grey, share: int) -> Grey:
    if share == 1:
        return picture
    size = (picture.shape[1] // share, picture.shape[0] // share)
    return cv2.resize(picture, size, interpolation=cv2.INTER_AREA).astype(np.uint8, copy=False)


def _as_large(found: Found, picture: Grey) -> Found:
    """The same at a picture's size, disparities in its pixels."""
    rows, columns = picture.shape
    if found.disparity.shape == (rows, columns):
        return found
    scale = columns / found.disparity.shape[1]
    if scale > 1:
        larger = [cv2.resize(one, (columns, rows), interpolation=cv2.INTER_LINEAR) for one in found]
        return Found(larger[0] * np.float32(scale), larger[1])
    return _shrunk(found, (columns, rows), scale)


def _shrunk(found: Found, size: tuple[int, int], scale: float) -> Found:
    """Smaller: the mean weighted by confidence."""
    weighted, weight = (
        cv2.resize(one, size, interpolation=cv2.INTER_AREA)
        for one in (found.disparity * found.confidence, found.confidence)
    )
    known = weight > 0
    mean: Float32[np.ndarray, "rows columns"] = np.divide(weighted, weight, out=np.zeros_like(weight), where=known)
    return Found(mean * np.float32(scale), weight)
