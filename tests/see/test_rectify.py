"""Rectified pictures show the same thing in the same row, at the disparity that its depth asks for."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from see.rig import BOARD, SIZE, rig

from toddle.failures import BadInput
from toddle.geometry.camera import Pinhole, StereoCameras
from toddle.see.chessboard import find_board, same_order
from toddle.see.lens import fold, pixels_of
from toddle.see.painted_boards import DOCUMENT_LEFT, DOCUMENT_RIGHT, shown_boards
from toddle.see.rectify import maps_of, rectification, rectified_points, rectify


@given(st.integers(0, 1000), st.floats(-0.4, 0.4), st.floats(-0.3, 0.3), st.floats(0.3, 5.0))
def test_points_stand_in_the_same_row_at_the_disparity_of_their_depth(
    seed: int, x: float, y: float, depth: float
) -> None:
    cameras = rig(seed)
    made = rectification(cameras)
    point = np.array([[x * depth, y * depth, depth]])
    seen = pixels_of(cameras.left, point), pixels_of(cameras.right, point @ cameras.rotation.T + cameras.translation)
    left, right = (
        rectified_points(camera, turn, made.cameras.camera, pixels)[0]
        for camera, turn, pixels in zip((cameras.left, cameras.right), made.rotations, seen, strict=True)
    )
    assert left[1] == pytest.approx(right[1], abs=1e-3)
    along = (point @ made.rotations[0].T)[0, 2]
    assert made.cameras.depth(left[:1] - right[:1])[0] == pytest.approx(along, rel=1e-3)


@pytest.mark.parametrize("seed", range(5))
def test_the_turns_are_those_of_opencv(seed: int) -> None:
    cameras = rig(seed)
    one, other, *_ = cv2.stereoRectify(
        cameras.left.matrix, np.array(cameras.left.distortion), cameras.right.matrix,
        np.array(cameras.right.distortion), SIZE, cameras.rotation, cameras.translation[:, None],
    )  # fmt: skip
    made = rectification(cameras)
    assert np.allclose(made.rotations[0], one, atol=1e-12)
    assert np.allclose(made.rotations[1], other, atol=1e-12)


def test_boards_in_rectified_pictures_stand_level() -> None:
    rng = np.random.default_rng(0)
    cameras = rig(3)
    made = rectification(cameras)
    apart: list[float] = []
    for number, shown in enumerate(shown_boards(cameras, BOARD, rng, far=0.4)):
        left = find_board(rectify(made.left, shown.left), BOARD)
        right = find_board(rectify(made.right, shown.right), BOARD)
        if left is not None and right is not None:
            off = same_order(left.corners, right.corners)[:, 1] - left.corners[:, 1]
            apart.append(float(np.median(np.abs(off))))
        if len(apart) == 3 or number == 20:
            break
    assert len(apart) == 3
    assert max(apart) < 0.15


def test_an_ideal_pair_stays_as_it_is() -> None:
    ideal = Pinhole(320, 240, 236.0, 236.0, 159.5, 119.5)
    made = rectification(StereoCameras(ideal, ideal, np.eye(3), np.array([-0.068, 0.0, 0.0])))
    picture = np.random.default_rng(0).integers(0, 255, (240, 320, 3)).astype(np.uint8)
    assert made.cameras.camera == ideal
    assert np.array_equal(rectify(made.left, picture), picture)
    assert np.array_equal(rectify(made.right, picture[..., 0].copy()), picture[..., 0])


def test_what_no_ray_reaches_is_black_and_not_valid() -> None:
    """A camera so wide that the document's lens has folded: OpenCV alone would show things there, mirrored."""
    wide = Pinhole(320, 240, 60.0, 60.0, 160.0, 120.0)
    maps = maps_of(DOCUMENT_LEFT, np.eye(3), wide)
    rows, columns = np.mgrid[:240, :320]
    beyond = np.hypot(columns - 160, rows - 120) / 60 > fold(DOCUMENT_LEFT)
    inside = np.all((maps.source >= 0) & (maps.source < [320, 240]), axis=-1)
    assert (beyond & inside).any()
    assert not maps.valid[beyond].any()
    assert not rectify(maps, np.full((240, 320), 200, np.uint8))[~maps.valid].any()
    assert maps.valid[110:130, 150:170].all()


def test_the_documents_pair_keeps_its_picture() -> None:
    """With `alpha` left to choose, a fifth of the right picture was black."""
    made = rectification(StereoCameras(DOCUMENT_LEFT, DOCUMENT_RIGHT, np.eye(3), np.array([-0.068, 0.0, 0.0])))
    assert made.left.valid.mean() > 0.99
    assert made.right.valid.mean() > 0.97


def test_cameras_in_the_wrong_order_are_refused() -> None:
    cameras = rig()
    with pytest.raises(BadInput, match="not to the right"):
        rectification(replace(cameras, translation=-cameras.translation))
    with pytest.raises(BadInput, match="not to the right"):
        rectification(replace(cameras, translation=np.array([-0.01, 0.07, 0.0])))
