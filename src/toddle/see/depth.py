"""From two rectified pictures to depth: match, smooth, divide (Huber 2019, section 2.2.4 and figure 2.24).

A `Setting` says how. `LIVE` works on pictures of half the size and is quick enough for a robot that walks; `BEST` takes
its time; both match semi-globally, which trusts walls with little texture that blocks leave open. `DOCUMENT` is the
document's own. `SETTINGS` names them all.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

from toddle.failures import BadInput
from toddle.geometry.camera import RectifiedCameras
from toddle.see.filters import Guided, LeastSquares, Smoother
from toddle.see.matchers import BlockMatching, DocumentMatching, Found, Grey, Matcher, SemiGlobal
from toddle.see.trouble import statistics, told
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
        edge: disparities that differ by more within three by three pixels belong to two things: neither is trusted,
            as smoothing leaves something between them [pixels at which it is smoothed].
    """

    matcher: Matcher
    smoother: Smoother
    match_at: int = 1
    smooth_at: int = 1
    sufficient: float = 0.5
    edge: float = float("inf")


LIVE = Setting(SemiGlobal(3, 16, uniqueness=15), Guided(4, 12, 30.0), match_at=2, smooth_at=2, edge=0.4)
"""Half the size throughout."""
BEST = Setting(SemiGlobal(5, 32, uniqueness=15), LeastSquares(300.0, 2.0), smooth_at=2, edge=0.3)
"""Matched at full size, smoothed at half."""
BLOCKS = Setting(BlockMatching(7, 32, contrast=8.0), LeastSquares(300.0, 2.0), smooth_at=2)
"""The same with block matching."""
QUICK = Setting(BlockMatching(5, 16), Guided(4, 12, 30.0), match_at=2, smooth_at=2)
"""Half the size throughout, with block matching."""
DOCUMENT = Setting(DocumentMatching(13, 32), LeastSquares(1e4, 1.0))
"""The document's: N = 13, D = 32, lambda = 1e4, sigma = 1."""
SETTINGS = {"live": LIVE, "best": BEST, "blocks": BLOCKS, "quick": QUICK, "document": DOCUMENT}
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
    found = Found(found.disparity, np.where(_lit(small[0]), found.confidence, np.float32(0)))
    guide = small[0] if settings.smooth_at == settings.match_at else _smaller(ours, settings.smooth_at)
    smoothed = settings.smoother.smooth(_as_large(found, guide), guide)
    return Stages(ours, theirs, found, _as_large(_without_edges(smoothed, settings.edge), ours))


def image_of(
    stages: Stages, cameras: RectifiedCameras, settings: Setting, seen: Bool[np.ndarray, "rows columns"] | None = None
) -> DepthImage:
    """The depth that follows; as `depth_of`."""
    disparity, confidence = stages.smoothed
    known = disparity > 0 if seen is None else (disparity > 0) & seen
    valid = known & _lit(stages.left) & (confidence > np.float32(settings.sufficient))
    valid &= disparity <= np.arange(disparity.shape[1], dtype=np.float32)
    there = np.where(known, disparity, np.float32(np.nan))
    depth = np.float32(cameras.camera.fx * cameras.baseline) / there
    trusted = cv2.countNonZero(valid.view(np.uint8)) / valid.size
    trouble = told(statistics(stages.left, stages.right, stages.found.confidence, trusted))
    return DepthImage(there, depth, confidence, valid, trouble)


def _lit(picture: Grey) -> Bool[np.ndarray, "rows columns"]:
    """Neither black nor saturated, where nothing can be told apart."""
    return cv2.inRange(picture, np.array(_BLACK + 1), np.array(_SATURATED - 1)) > 0


def _without_edges(found: Found, edge: float) -> Found:
    """No trust in what lies between two things."""
    if np.isinf(edge):
        return found
    apart = cv2.morphologyEx(found.disparity, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
    return Found(found.disparity, np.where(apart > np.float32(edge), np.float32(0), found.confidence))


def _smaller(picture: Grey, share: int) -> UInt8[np.ndarray, "less fewer"]:
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
    mean = np.divide(weighted, weight, out=np.zeros_like(weight), where=known)
    return Found(mean * np.float32(scale), weight)
