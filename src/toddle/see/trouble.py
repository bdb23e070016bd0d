"""What is wrong with two cameras, in words: covered, dark, saturated, without texture, swapped, misaligned.

Statistics tell the first four in every frame, for next to nothing. The last two need features of both pictures (ORB,
Rublee et al. 2011), so a `Watch` looks for them once a second; it pools frames, as one alone says little, and tells
what most of the last ones told. Whether the cameras are turned about the vertical axis no picture tells.
"""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Float, Float32, UInt8

from toddle.see.straighten import FEWEST, Matches, grey, misalignment
from toddle.signals import DepthImage

SATURATED, COVERED, DARK, PLAIN = "saturated", "covered", "dark", "textureless"
SWAPPED, MISALIGNED = "swapped", "misaligned"
KINDS = (SATURATED, COVERED, DARK, PLAIN, SWAPPED, MISALIGNED)
"""The word that each report begins with."""

_FLAT, _FLATTER, _STRANGE = 4.0, 0.5, 0.4  # grey values; share of the other camera's; share of pixels that agree
_DARK, _WHITE, _BURNT = 45.0, 250, 0.15  # grey value, grey value, share of the pixels
_TRUSTED = 0.55  # share of the pixels
_EDGE = 5  # the picture's middle is what lies a fifth from its edges
_FRAMES, _MOST = 5, 3  # told if three of five frames tell it
_EVERY = 1.0  # [s]
_POOLED = 5  # looks at features
_REVERSED = 0.8  # share of the matches whose disparity is negative
_ROWS = 0.6  # mean distance between the rows of both pictures that is told [pixels]


class Statistics(NamedTuple):
    """Of the middle of both pictures, left and right.

    Attributes:
        mean: brightness [grey values].
        spread: its standard deviation without the finest detail, where noise is [grey values].
        white: share of pixels that are saturated.
        found: share of all pixels for which a disparity was found.
        trusted: share of all pixels whose depth is valid.
    """

    mean: tuple[float, float]
    spread: tuple[float, float]
    white: tuple[float, float]
    found: float
    trusted: float


def statistics(
    left: UInt8[np.ndarray, "rows columns"], right: UInt8[np.ndarray, "rows columns"],
    confidence: Float32[np.ndarray, "high wide"], trusted: float,
) -> Statistics:  # fmt: skip
    """What every frame tells.

    Args:
        left: brightness.
        right: likewise.
        confidence: of the matcher.
        trusted: share of pixels whose depth is valid.
    """
    ours, theirs = _of_one(left), _of_one(right)
    found = cv2.countNonZero(confidence) / confidence.size
    mean, spread, white = zip(ours, theirs, strict=True)
    return Statistics(mean, spread, white, found, trusted)


def _of_one(picture: UInt8[np.ndarray, "rows columns"]) -> tuple[float, float, float]:
    rows, columns = picture.shape
    middle = picture[rows // _EDGE : rows - rows // _EDGE, columns // _EDGE : columns - columns // _EDGE]
    size = max(middle.shape[1] // 4, 1), max(middle.shape[0] // 4, 1)
    coarse = cv2.resize(middle, size, interpolation=cv2.INTER_AREA)
    mean, spread = cv2.meanStdDev(coarse)
    return float(mean[0, 0]), float(spread[0, 0]), float((coarse >= _WHITE).mean())


def told(found: Statistics) -> tuple[str, ...]:
    """What a frame's statistics say, each report beginning with its kind."""
    said = []
    flat = int(np.argmin(found.spread))
    hidden = (
        found.spread[flat] < min(_FLAT, _FLATTER * found.spread[1 - flat])
        and found.found < _STRANGE
        and max(found.white) < _BURNT
    )
    if hidden:
        said.append(f"{COVERED}: the {('left', 'right')[flat]} camera sees nothing, the other one does")
    if max(found.white) > _BURNT:
        said.append(f"{SATURATED}: {100 * max(found.white):.0f} % of a picture is white; expose less")
    if max(found.mean) < _DARK:
        said.append(f"{DARK}: mean brightness {max(found.mean):.0f} of 255; more light, or expose longer")
    if not said and found.trusted < _TRUSTED:
        said.append(f"{PLAIN}: the depth of {100 * found.trusted:.0f} % of the picture can be trusted")
    return tuple(said)


class Features(NamedTuple):
    """The same things in both pictures, of the last looks.

    Attributes:
        time: of the last look [s].
        looks: matches of each, at most five.
    """

    time: float
    looks: tuple[Matches, ...]


class Watch(NamedTuple):
    """What was noticed lately.

    Attributes:
        frames: what each of the last frames said.
        features: of the last looks at features.
        trouble: what is wrong, in words; empty: nothing was noticed.
    """

    frames: tuple[tuple[str, ...], ...] = ()
    features: Features = Features(float("-inf"), ())
    trouble: tuple[str, ...] = ()


def watch(
    before: Watch, left: UInt8[np.ndarray, "rows columns *colours"], right: UInt8[np.ndarray, "rows columns *colours"],
    image: DepthImage, time: float,
) -> Watch:  # fmt: skip
    """The watch after one more frame.

    Args:
        before: the watch until now; `Watch()` at first.
        left: rectified picture.
        right: likewise.
        image: the depth that was found in them.
        time: of the pictures [s].
    """
    frames = (*before.frames, image.trouble)[-_FRAMES:]
    counts = Counter(said.partition(":")[0] for frame in frames for said in frame)
    latest = {said.partition(":")[0]: said for frame in frames for said in frame}
    lasting = [latest[kind] for kind in KINDS if counts[kind] >= _MOST]
    features = before.features
    if time - features.time >= _EVERY:
        looks = (*features.looks, matched_quickly(grey(left), grey(right)))[-_POOLED:]
        features = Features(time, looks)
    size = (image.depth.shape[1], image.depth.shape[0])
    seen = _of_features(features.looks, size)
    if any(said.startswith(SWAPPED) for said in seen):  # then nothing else is to be trusted
        lasting = [said for said in lasting if not said.startswith(PLAIN)]
    return Watch(frames, features, (*lasting, *seen))


def _of_features(looks: tuple[Matches, ...], size: tuple[int, int]) -> tuple[str, ...]:
    """What the features say."""
    if not looks:
        return ()
    pooled = Matches(np.concatenate([one.left for one in looks]), np.concatenate([one.right for one in looks]))
    off = misalignment(pooled, size)
    if off is None:
        return ()
    said = []
    back = float((pooled.left[:, 0] < pooled.right[:, 0] - 1).mean())
    if back > _REVERSED:
        said.append(f"{SWAPPED}: {100 * back:.0f} % of what both cameras see lies on the wrong side; exchange them")
    apart = _rows_apart(off.shift, off.slope_across, off.slope_down, size)
    if apart > _ROWS:
        said.append(f"{MISALIGNED}: rows are {apart:.1f} px apart; rectify again (toddle see rectify)")
    return tuple(said)


def _rows_apart(shift: float, across: float, down: float, size: tuple[int, int]) -> float:
    """Mean over the picture [pixels]."""
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 9) * size[0], np.linspace(-0.5, 0.5, 9) * size[1])
    return float(np.abs(shift + across * x + down * y).mean())


def matched_quickly(
    left: UInt8[np.ndarray, "rows columns"], right: UInt8[np.ndarray, "rows columns"], *, reach: float = 20.0
) -> Matches:
    """The same things in both pictures, in a few milliseconds.

    Args:
        left: brightness.
        right: likewise.
        reach: how far their rows may be apart [pixels].
    """
    finder = cv2.ORB_create(400, fastThreshold=12)  # type: ignore[attr-defined]
    (ours, one), (theirs, other) = (finder.detectAndCompute(picture, None) for picture in (left, right))
    if one is None or other is None or min(len(one), len(other)) < FEWEST:
        return _none()
    pairs = cv2.BFMatcher(cv2.NORM_HAMMING, crossCheck=True).match(one, other)
    first: Float[np.ndarray, "matches 2"] = np.array([ours[pair.queryIdx].pt for pair in pairs], float).reshape(-1, 2)
    second = np.array([theirs[pair.trainIdx].pt for pair in pairs], float).reshape(-1, 2)
    good = np.abs(first[:, 1] - second[:, 1]) < reach
    good &= np.array([pair.distance < 40 for pair in pairs], bool)
    if good.sum() < FEWEST:
        return _none()
    return Matches(first[good], second[good])


def _none() -> Matches:
    return Matches(np.zeros((0, 2)), np.zeros((0, 2)))
