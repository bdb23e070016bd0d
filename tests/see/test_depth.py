"""Depth of planes whose distance is known, in every setting; the document's own against OpenCV's."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from toddle.failures import BadInput
from toddle.see.depth import BEST, DOCUMENT, LIVE, SETTINGS, depth_of, stages_of
from toddle.see.filters import LeastSquares
from toddle.see.matchers import BlockMatching, DocumentMatching, Found, SemiGlobal
from toddle.see.shrink import shrunk
from toddle.signals import DepthImage

from .planes import CAMERAS, box_before_wall, pair


@pytest.mark.parametrize("name", SETTINGS)
@pytest.mark.parametrize("disparity", [6.5, 11.0, 21.25])
def test_a_wall_is_as_far_as_it_is(name: str, disparity: float) -> None:
    left, right = pair(disparity)
    image = depth_of(left, right, CAMERAS, SETTINGS[name])
    true = 236.0 * 0.068 / disparity
    assert image.valid[20:-20, 60:-20].mean() > 0.9
    coarse = SETTINGS[name].match_at  # at half the size errors are twice as large
    assert np.abs(image.depth[image.valid] / true - 1).mean() < 0.03 * coarse
    assert np.nanmedian(image.disparity) == pytest.approx(disparity, abs=0.3 * coarse)
    assert image.depth[image.valid].tolist() == pytest.approx(
        (236.0 * 0.068 / image.disparity[image.valid]).tolist(), rel=1e-5
    )
    assert image.confidence.min() >= 0
    assert image.confidence.max() <= 1


@pytest.mark.parametrize("name", SETTINGS)
def test_what_stands_before_a_wall_is_told_from_it(name: str) -> None:
    left, right, inside = box_before_wall(20, 8)
    image = depth_of(left, right, CAMERAS, SETTINGS[name])
    middle = cv2.erode(inside.astype(np.uint8), np.ones((25, 25))) > 0
    around = cv2.dilate(inside.astype(np.uint8), np.ones((61, 61))) == 0
    around[:, :60] = False
    for where, disparity in ((middle, 20), (around, 8)):
        good = where & image.valid
        assert good.sum() > 0.5 * where.sum()
        assert np.median(image.depth[good]) == pytest.approx(
            236 * 0.068 / disparity, rel=0.03 * SETTINGS[name].match_at
        )


@pytest.mark.parametrize("name", SETTINGS)
def test_what_is_not_common_to_both_pictures_is_not_trusted(name: str) -> None:
    left, right = pair(24.0)
    assert not depth_of(left, right, CAMERAS, SETTINGS[name]).valid[:, :20].any()


def test_colours_and_what_a_camera_did_not_see() -> None:
    left, right = pair(12.0)
    coloured = [np.repeat(one[..., None], 3, axis=-1) for one in (left, right)]
    seen = np.ones(left.shape, bool)
    seen[:, 200:] = False
    grey, masked = depth_of(left, right, CAMERAS), depth_of(coloured[0], coloured[1], CAMERAS, LIVE, seen=seen)
    assert np.array_equal(grey.depth[seen], masked.depth[seen])
    assert np.isnan(masked.depth[:, 200:]).all()
    assert not masked.valid[:, 200:].any()


def test_black_and_white_are_not_trusted() -> None:
    left, right = pair(12.0)
    for value, rows in ((0, slice(0, 60)), (255, slice(180, 240))):
        left[rows], right[rows] = value, value
    valid = depth_of(left, right, CAMERAS, LIVE).valid
    assert not valid[:60].any()
    assert not valid[180:].any()
    assert valid[80:160, 60:].mean() > 0.9


@dataclass(frozen=True)
class Learned:
    """Stands for a network."""

    smallest: int = 8

    def find(self, left: np.ndarray, right: np.ndarray) -> Found:
        return Found(np.full(left.shape, 5.0, np.float32), np.ones(left.shape, np.float32))


def test_any_matcher_can_be_plugged_in() -> None:
    left, right = pair(12.0)
    image = depth_of(left, right, CAMERAS, replace(LIVE, matcher=Learned()))
    known = image.depth[np.isfinite(image.depth)]
    assert known.tolist() == pytest.approx([236 * 0.068 / 10] * known.size, rel=1e-4)  # matched at half the size


def test_the_documents_setting_is_what_opencv_calls_it() -> None:
    """Equations 2.133 to 2.142, composed here, against the filter that the document used, inside the borders."""
    left, right, _ = box_before_wall(20, 8)
    ours = stages_of(left, right, DOCUMENT)
    matcher = cv2.StereoBM.create(32, 13)
    theirs = cv2.ximgproc.createDisparityWLSFilter(matcher)
    theirs.setLambda(1e4)
    theirs.setSigmaColor(1.0)
    back = cv2.ximgproc.createRightMatcher(matcher)
    both = matcher.compute(left, right), back.compute(right, left)
    disparity = theirs.filter(both[0], left, None, both[1]) / 16
    confidence = theirs.getConfidenceMap() / 255
    middle = np.s_[20:-20, 60:-20]
    assert np.abs(ours.found.confidence - confidence)[middle].mean() < 0.01
    apart = np.abs(ours.smoothed.disparity - disparity)[middle]
    assert np.percentile(apart, 99) < 0.2
    assert np.median(apart) < 0.03


def test_smoothing_a_constant_changes_nothing() -> None:
    left, _ = pair(12.0)
    some = np.zeros(left.shape, np.float32)
    some[::7, ::5] = 1
    for setting in (LIVE, BEST):
        found = setting.smoother.smooth(Found(np.where(some > 0, np.float32(9), np.float32(0)), some), left)
        known = found.disparity > 0
        assert known.mean() > 0.95
        assert np.abs(found.disparity[known] - 9).max() < 0.05


def test_pictures_that_are_too_small_are_refused() -> None:
    left, right = pair(12.0)
    for setting in SETTINGS.values():
        with pytest.raises(BadInput, match="too few"):
            depth_of(left[:4, :4], right[:4, :4], CAMERAS, setting)


@pytest.mark.parametrize("shape", [(61, 83), (120, 160), (50, 64)])
@pytest.mark.parametrize("name", SETTINGS)
def test_pictures_of_any_size(name: str, shape: tuple[int, int]) -> None:
    left, right = (np.ascontiguousarray(one[: shape[0], : shape[1]]) for one in pair(5.0))
    image = depth_of(left, right, CAMERAS, SETTINGS[name])
    assert image.depth.shape == shape
    assert np.nanmedian(image.disparity) == pytest.approx(5.0, abs=0.5)


@pytest.mark.parametrize("kind", [BlockMatching, SemiGlobal, DocumentMatching])
def test_sizes_that_no_matcher_has_are_refused(kind: type) -> None:
    for window, disparities in ((6, 32), (-1, 32), (9, 20), (9, 0)):
        with pytest.raises(BadInput, match="matcher"):
            kind(window, disparities)


def image_of(depth: np.ndarray, confidence: np.ndarray) -> DepthImage:
    return DepthImage(1 / depth, depth, confidence, np.isfinite(depth))


def test_small_pictures_are_means_of_inverse_depths() -> None:
    depth = np.full((4, 4), 2.0, np.float32)
    depth[0, :2], depth[2:, 2:] = (1.0, 4.0), np.nan
    confidence = np.ones((4, 4), np.float32)
    confidence[0, 1] = 0.5
    small = shrunk(image_of(depth, confidence), 2, 2)
    # top left: depths 1, 4, 2, 2 with weights 1, 1/2, 1, 1: (7/2) / (1 + 1/8 + 1/2 + 1/2)
    assert small.tolist() == [[pytest.approx(3.5 / 2.125), 2.0], [2.0, 0.0]]
    assert not shrunk(image_of(depth, np.zeros((4, 4), np.float32)), 2, 2).any()


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_small_pictures_stay_between_near_and_far(seed: int) -> None:
    rng = np.random.default_rng(seed)
    depth = rng.uniform(0.4, 9, (24, 32)).astype(np.float32)
    depth[rng.uniform(size=depth.shape) < 0.3] = np.nan
    small = shrunk(image_of(depth, rng.uniform(0.1, 1, depth.shape).astype(np.float32)), 6, 8)
    assert small.shape == (6, 8)
    blocks = depth.reshape(6, 4, 8, 4).transpose(0, 2, 1, 3).reshape(6, 8, 16)
    known = small > 0
    assert np.all(small[known] >= np.nanmin(blocks[known], axis=-1) - 1e-4)
    assert np.all(small[known] <= np.nanmax(blocks[known], axis=-1) + 1e-4)


def test_weights_without_confidence_tell_nothing() -> None:
    left, _ = pair(12.0)
    nothing = Found(np.zeros(left.shape, np.float32), np.zeros(left.shape, np.float32))
    assert not LeastSquares().smooth(nothing, left).disparity.any()
