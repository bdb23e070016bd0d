"""What is off in a rectified pair is found in the pictures; a pair rectified before is told from one that is not."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from see.rig import SIZE, rig

from toddle.failures import BadInput
from toddle.geometry.camera import Pinhole, StereoCameras
from toddle.see.lens import rays_of
from toddle.see.pair import make_ready, was_rectified
from toddle.see.rectify import Rectification, rectification, rectify
from toddle.see.straighten import Matches, both_in_one, grey, matched, misalignment, straightening

REAL = Path(__file__).parents[3] / "shared" / "data" / "huber2019"
FLAT = Pinhole(640, 480, 236.0, 236.0, 319.5, 239.5)


@cache
def wall() -> np.ndarray:
    """Something to look at, wider than any camera sees."""
    rng = np.random.default_rng(5)
    layers = [cv2.resize(rng.normal(size=(480 // n, 640 // n)), (640, 480), interpolation=cv2.INTER_CUBIC) * n**0.7
              for n in (2, 5, 12, 40)]  # fmt: skip
    light = sum(layers)
    return np.clip(128 + 45 * light / np.std(light), 5, 250).astype(np.uint8)


@cache
def raw_pair(seed: int) -> tuple[StereoCameras, np.ndarray, np.ndarray]:
    """What two misaligned cameras see of a wall 1 m away, through the document's lenses."""
    cameras = rig(seed)
    rows, columns = np.mgrid[:240, :320].astype(float)
    pixels = np.stack([columns, rows], axis=-1)
    pictures = []
    for camera, turn, place in (
        (cameras.left, np.eye(3), np.zeros(3)),
        (cameras.right, cameras.rotation, cameras.translation),
    ):
        rays = rays_of(camera, pixels)
        ahead = np.concatenate([rays, np.ones((240, 320, 1))], axis=-1) @ turn  # in the left camera's frame
        eye = -place @ turn
        there = eye + ahead * ((1.0 - eye[2]) / ahead[..., 2:])
        spot = there[..., :2] * FLAT.fx + (FLAT.cx, FLAT.cy)
        spot = np.where(np.isnan(spot), -100, spot).astype(np.float32)
        noisy = cv2.remap(wall(), spot, None, cv2.INTER_LINEAR).astype(float)  # type: ignore[call-overload]
        noisy += 3 * np.random.default_rng(seed).normal(size=noisy.shape)
        pictures.append(np.clip(np.where(spot[..., 0] < 0, 0, noisy), 0, 255).astype(np.uint8))
    return cameras, pictures[0], pictures[1]


def scattered(count: int, seed: int, shift: float, across: float, down: float, noise: float = 0.1) -> Matches:
    rng = np.random.default_rng(seed)
    left = rng.uniform((0, 0), SIZE, (count, 2))
    right = left - rng.uniform((2, 0), (20, 0), (count, 2))
    basis = right - (np.array(SIZE) - 1) / 2
    right[:, 1] += shift + across * basis[:, 0] + down * basis[:, 1] + noise * rng.normal(size=count)
    return Matches(left, right)


@given(st.integers(0, 99), st.floats(-8, 8), st.floats(-0.02, 0.02), st.floats(-0.02, 0.02))
def test_three_numbers_are_found_again_among_outliers(seed: int, shift: float, across: float, down: float) -> None:
    matches = scattered(120, seed, shift, across, down)
    matches.right[:24, 1] += np.random.default_rng(seed).uniform(-30, 30, 24)
    found = misalignment(matches, SIZE)
    assert found is not None
    assert found.shift == pytest.approx(shift, abs=0.2)
    assert found.slope_across == pytest.approx(across, abs=2e-3)
    assert found.slope_down == pytest.approx(down, abs=3e-3)
    assert found.median_after < 0.2


def test_few_matches_say_nothing() -> None:
    assert misalignment(scattered(19, 0, 1.0, 0.0, 0.0), SIZE) is None
    blank = np.full((240, 320), 128, np.uint8)
    assert len(matched(blank, blank).left) == 0


def test_a_fit_to_noise_is_not_worth_it() -> None:
    found = misalignment(scattered(100, 0, 0.0, 0.0, 0.0), SIZE)
    assert found is not None
    assert not found.worth_it
    assert found.median_after > 0.8 * found.median  # on matches that the fit did not see


@pytest.mark.parametrize("seed", range(3))
def test_a_pair_that_was_not_rectified_is_told_and_rectified(seed: int) -> None:
    cameras, left, right = raw_pair(seed)
    made = rectification(cameras)
    verdict = was_rectified(left, right, made)
    assert verdict.rectified is False
    ready = make_ready(left, right, made)
    assert ready.off is not None
    assert ready.off.median < 0.3
    assert ready.trouble == ()
    assert ready.cameras == made.cameras


@pytest.mark.parametrize("seed", range(3))
def test_a_rectified_pair_is_told_and_left(seed: int) -> None:
    cameras, left, right = raw_pair(seed)
    made = rectification(cameras)
    ours = rectify(made.left, left), rectify(made.right, right)
    assert was_rectified(*ours, made).rectified is True
    ready = make_ready(*ours, made, earlier=made)
    assert np.array_equal(ready.left, ours[0])
    if not ready.straightened:
        assert np.array_equal(ready.right, ours[1])
        assert ready.maps == (None, None)


def test_pixels_are_as_far_apart_as_the_wall_is_away() -> None:
    cameras, left, right = raw_pair(1)
    ready = make_ready(left, right, rectification(cameras))
    seen = matched(ready.left, ready.right)
    depth = ready.cameras.depth(seen.left[:, 0] - seen.right[:, 0])
    assert np.median(depth) == pytest.approx(1.0, abs=0.03)


def test_a_pair_that_is_off_is_set_right() -> None:
    """One camera was knocked after the calibration: by 0.4 degrees down and 0.3 about its axis."""
    cameras, left, right = raw_pair(0)
    knock, _ = cv2.Rodrigues(np.deg2rad(np.array([0.4, 0.0, 0.3])))
    before = StereoCameras(cameras.left, cameras.right, knock @ cameras.rotation, knock @ cameras.translation)
    ready = make_ready(left, right, rectification(before))
    assert ready.off is not None
    assert ready.off.median > 1.0
    assert ready.straightened
    after = misalignment(matched(ready.left, ready.right), SIZE)
    assert after is not None
    assert after.median < 0.3
    left_alone = make_ready(left, right, rectification(before), straighten=False)
    assert not left_alone.straightened
    assert np.array_equal(left_alone.left, ready.left)


def test_two_look_ups_in_one_are_the_two_after_each_other() -> None:
    cameras, _, right = raw_pair(0)
    made = rectification(cameras)
    off = misalignment(scattered(60, 0, 1.5, 0.01, -0.01, noise=0.01), SIZE)
    assert off is not None
    level = straightening(off, SIZE)
    one = rectify(both_in_one(made.right, level), right).astype(float)
    two = rectify(level, rectify(made.right, right)).astype(float)
    assert np.median(np.abs(one - two)) < 6  # the second is smoothed twice


def test_without_anything_to_see_it_asks() -> None:
    cameras, left, _ = raw_pair(0)
    blank = np.full_like(left, 128)
    with pytest.raises(BadInput, match="rectified already"):
        make_ready(blank, blank, rectification(cameras))
    ready = make_ready(blank, blank, rectification(cameras), rectified=False)
    assert ready.off is None
    assert ready.trouble


def test_matrices_that_the_file_does_not_hold_are_told() -> None:
    cameras, left, right = raw_pair(0)
    made = rectification(cameras)
    ready = make_ready(rectify(made.left, left), rectify(made.right, right), made)
    assert "does not hold" in ready.trouble[0]


@pytest.fixture(scope="module")
def real() -> tuple[Rectification, Rectification, np.ndarray, np.ndarray]:
    if not (REAL / "l_rgb.png").exists():
        pytest.skip("the document's pictures are not here")
    from toddle.outside.seeing.camera_files import read_cameras
    from toddle.outside.seeing.picture_files import read_picture

    file = read_cameras(REAL / "cam_stereo.yaml", SIZE)
    assert file.earlier is not None
    left, right = (read_picture(REAL / name) for name in ("l_rgb.png", "r_rgb.png"))
    return rectification(file.cameras), file.earlier, left, right


def test_the_real_pair_was_rectified_and_is_off_and_is_set_right(
    real: tuple[Rectification, Rectification, np.ndarray, np.ndarray],
) -> None:
    made, earlier, left, right = real
    ready = make_ready(left, right, made, earlier=earlier)
    assert ready.verdict.rectified is True
    assert ready.verdict.once_more > 3 * ready.verdict.as_it_is
    assert ready.verdict.black > 0.99
    assert ready.off is not None
    assert 1.4 < ready.off.median < 2.0
    assert ready.off.median_after < 0.5
    assert ready.cameras.camera.fx == pytest.approx(234.377, abs=1e-3)
    after = misalignment(matched(grey(ready.left), grey(ready.right)), SIZE)
    assert after is not None
    assert after.median < 0.5


@settings(max_examples=5)
@given(st.integers(-6, 6))
def test_the_real_pair_is_set_right_wherever_it_stands(
    real: tuple[Rectification, Rectification, np.ndarray, np.ndarray], lower: int
) -> None:
    """Another mounting: the right picture moved down by whole pixels."""
    _, _, left, right = real
    moved = np.roll(right, lower, axis=0)
    found = misalignment(matched(grey(left), grey(moved)), SIZE)
    still = misalignment(matched(grey(left), grey(right)), SIZE)
    assert found is not None
    assert still is not None
    middle = still.slope_down * lower  # the fit's basis is the pixel, which moved too
    assert found.shift - still.shift == pytest.approx(lower - middle, abs=0.15)
    assert found.median_after < 0.5
