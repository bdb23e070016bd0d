"""What is still off in a rectified pair, seen in the pictures themselves and set right.

The same thing must stand in the same row of both pictures. Where features of both (SIFT, Lowe 2004) say otherwise, the
difference is fitted by three parameters: a shift (pitch), a slope across (roll) and a slope down (focal lengths that
differ). A turn about the vertical axis changes no rows and stays unseen: depth from it needs a known distance.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Bool, Float, Shaped, UInt8

from toddle.see.rectify import Maps, maps_from

FEWEST = 20
"""Matches, less than which say nothing."""
_RATIO = 0.8  # Lowe's: the best match must be better than the next by so much
_FOLDS = 5
_TUKEY = 4.685
_LEAST_SPREAD = 0.05  # pixels
_HELPS = 0.8


class Matches(NamedTuple):
    """The same things in both pictures.

    Attributes:
        left: where they are [pixels].
        right: likewise.
    """

    left: Float[np.ndarray, "matches 2"]
    right: Float[np.ndarray, "matches 2"]


class Misalignment(NamedTuple):
    """How far the rows of both pictures are apart: right less left.

    Attributes:
        matches: how many things were seen in both.
        median: of the distances between their rows [pixels].
        p90: nine of ten are nearer [pixels].
        shift: of the right picture's rows in the middle of the picture [pixels].
        slope_across: how much more for each pixel to the right.
        slope_down: how much more for each pixel down.
        median_after: what is left on matches that the fit did not see, five times a fifth of them [pixels].
        p90_after: likewise [pixels].
    """

    matches: int
    median: float
    p90: float
    shift: float
    slope_across: float
    slope_down: float
    median_after: float
    p90_after: float

    @property
    def worth_it(self) -> bool:
        """Whether setting it right helps pictures that the fit did not see."""
        return self.median_after < _HELPS * self.median


def matched(
    left: UInt8[np.ndarray, "rows columns"], right: UInt8[np.ndarray, "rows columns"], *, reach: float = 20.0
) -> Matches:
    """The same things in two grey pictures, each the other's best match, without those that no pair of cameras sees so.

    Args:
        left: a picture.
        right: the other.
        reach: how far their rows may be apart, after the median was taken off [pixels].
    """
    finder = cv2.SIFT_create(contrastThreshold=0.02)  # type: ignore[attr-defined]
    (ours, one), (theirs, other) = (finder.detectAndCompute(p, _away_from_black(p)) for p in (left, right))
    nothing = Matches(np.zeros((0, 2)), np.zeros((0, 2)))
    if one is None or other is None or min(len(one), len(other)) < 2:
        return nothing
    pairs = _mutual(one, other)
    if not len(pairs):
        return nothing
    first = np.array([ours[i].pt for i in pairs[:, 0]], dtype=float)
    second = np.array([theirs[j].pt for j in pairs[:, 1]], dtype=float)
    good = _consistent(first, second, reach)
    return Matches(first[good], second[good])


def misalignment(matches: Matches, size: tuple[int, int]) -> Misalignment | None:
    """How far the rows are apart, as three parameters fitted robustly; None: too few matches.

    Args:
        matches: of a rectified pair.
        size: of the pictures: width, height [pixels].
    """
    count = len(matches.left)
    if count < FEWEST:
        return None
    basis = _basis(matches.right, size)
    apart = matches.right[:, 1] - matches.left[:, 1]
    fit = _robust(basis, apart)
    fold = np.random.default_rng(0).permutation(count) % _FOLDS
    after = np.empty(count)
    for number in range(_FOLDS):
        test = fold == number
        after[test] = np.abs(apart[test] - basis[test] @ _robust(basis[~test], apart[~test]))
    before = np.abs(apart)
    return Misalignment(
        count, float(np.median(before)), float(np.percentile(before, 90)), float(fit[0]), float(fit[1]), float(fit[2]),
        float(np.median(after)), float(np.percentile(after, 90)),
    )  # fmt: skip


def straightening(off: Misalignment, size: tuple[int, int]) -> Maps:
    """The maps that bring the right picture's rows to the left one's.

    Args:
        off: what was found.
        size: of the pictures: width, height [pixels].
    """
    width, height = size
    columns, rows = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    flat = np.stack([columns.ravel(), rows.ravel()], axis=1)
    lower = (_basis(flat, size) @ (off.shift, off.slope_across, off.slope_down)).reshape(height, width)
    source = np.stack([columns, rows + lower], axis=-1)
    valid = (source[..., 1] >= 0) & (source[..., 1] <= height - 1)
    return maps_from(source.astype(np.float32), valid)


def both_in_one(first: Maps, then: Maps) -> Maps:
    """One look-up instead of two: pictures go through `first`, then through `then`."""
    source = cv2.remap(first.source, then.source, None, cv2.INTER_LINEAR)  # type: ignore[call-overload]
    inside = cv2.remap(first.valid.astype(np.float32), then.source, None, cv2.INTER_LINEAR)  # type: ignore[call-overload]
    return maps_from(source, then.valid & (inside > 0.999))


def grey(picture: UInt8[np.ndarray, "rows columns *colours"]) -> UInt8[np.ndarray, "rows columns"]:
    """A picture's brightness; colours are blue, green, red."""
    return picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)


def _away_from_black(picture: UInt8[np.ndarray, "rows columns"]) -> UInt8[np.ndarray, "rows columns"]:
    """Where features may be looked for: the edge of what rectification left black is no thing."""
    black = cv2.morphologyEx((picture == 0).astype(np.uint8), cv2.MORPH_OPEN, np.ones((5, 5), np.uint8))
    return np.where(cv2.dilate(black, np.ones((15, 15), np.uint8)) > 0, 0, 255).astype(np.uint8)


def _mutual(one: np.ndarray, other: np.ndarray) -> Shaped[np.ndarray, "matches 2"]:
    """Indices of descriptors that are each other's best match, clearly."""
    matcher = cv2.BFMatcher(cv2.NORM_L2)
    there = {m.queryIdx: m.trainIdx for m, n in matcher.knnMatch(one, other, k=2) if m.distance < _RATIO * n.distance}
    back = {m.queryIdx: m.trainIdx for m in matcher.match(other, one)}
    return np.array([(i, j) for i, j in there.items() if back.get(j) == i], dtype=int).reshape(-1, 2)


def _consistent(
    first: Float[np.ndarray, "matches 2"], second: Float[np.ndarray, "matches 2"], reach: float
) -> Bool[np.ndarray, " matches"]:
    """Matches that lie near one fundamental matrix and whose rows are not far apart."""
    apart = second[:, 1] - first[:, 1]
    near = np.abs(apart - np.median(apart)) < reach
    if near.sum() < 8:
        return near
    try:
        _, good = cv2.findFundamentalMat(first[near], second[near], cv2.USAC_MAGSAC, 1.5, 0.999, 5000)
    except cv2.error:  # it found no matrix: the fit of the rows must do without
        return near
    kept = near.copy()
    kept[near] = False if good is None else good.ravel() > 0
    return kept


def _basis(pixels: Float[np.ndarray, "points 2"], size: tuple[int, int]) -> Float[np.ndarray, "points 3"]:
    """One, and the distance from the middle of the picture across and down."""
    middle = (np.array(size) - 1) / 2
    return np.concatenate([np.ones((len(pixels), 1)), pixels - middle], axis=1)


def _robust(basis: Float[np.ndarray, "points 3"], apart: Float[np.ndarray, " points"]) -> Float[np.ndarray, "3"]:
    """Least squares with Tukey's weights, from the median on."""
    fit = np.array([np.median(apart), 0.0, 0.0])
    for _ in range(30):
        off = apart - basis @ fit
        spread = max(1.4826 * float(np.median(np.abs(off))), _LEAST_SPREAD)
        weight = np.clip(1 - (off / (_TUKEY * spread)) ** 2, 0, None)
        fit = np.linalg.lstsq(weight[:, None] * basis, weight * apart, rcond=None)[0]
    return fit
