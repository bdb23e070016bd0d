"""Lens, boards, calibration and its gate, against cameras whose truth is known."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from see.rig import BOARD, SIZE, rig, seen, turned

from toddle.failures import BadInput, ToddleError
from toddle.geometry.camera import Pinhole, StereoCameras
from toddle.see.calibrate import Calibration, Dropped, View, calibrate
from toddle.see.chessboard import Chessboard, find_board, same_order
from toddle.see.gate import distance_of, judge
from toddle.see.lens import fold, pixels_of, rays_of
from toddle.see.painted_boards import DOCUMENT_LEFT, DOCUMENT_RIGHT, BoardPainter, misaligned, shown_boards
from toddle.see.rectify import rectification
from toddle.see.sightings import Sighting, sharp, sight

STRAIGHT = Pinhole(320, 240, 236.0, 236.0, 160.0, 120.0)


@pytest.mark.parametrize("camera", [DOCUMENT_LEFT, DOCUMENT_RIGHT, STRAIGHT])
def test_the_lens_bends_rays_as_opencv_says(camera: Pinhole) -> None:
    points = np.random.default_rng(1).uniform((-0.6, -0.45, 1), (0.6, 0.45, 1), (200, 3))
    told, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), camera.matrix, np.array(camera.distortion))
    assert np.allclose(pixels_of(camera, points), told[:, 0], atol=1e-9)


@given(st.floats(10, 310), st.floats(5, 235))
def test_the_ray_of_a_pixel_leads_back_to_it(x: float, y: float) -> None:
    pixel = np.array([[x, y]])
    ray = rays_of(DOCUMENT_LEFT, pixel)
    if np.isnan(ray).any():  # beyond the fold: the document's lens has no ray for it
        assert np.hypot(x - 163, y - 111) > 150
    else:
        assert np.allclose(pixels_of(DOCUMENT_LEFT, np.append(ray, [[1.0]], axis=1)), pixel, atol=1e-3)


def test_the_documents_lens_folds_where_its_polynomial_stops_growing() -> None:
    k1, k2, _, _, k3 = DOCUMENT_LEFT.distortion
    slopes = np.roots([7 * k3, 0, 5 * k2, 0, 3 * k1, 0, 1])
    first = min(root.real for root in slopes if abs(root.imag) < 1e-9 and root.real > 0)
    assert fold(DOCUMENT_LEFT) == pytest.approx(first, abs=2e-3)
    assert np.isnan(pixels_of(DOCUMENT_LEFT, np.array([[first + 0.01, 0.0, 1.0], [0.0, 0.0, -1.0]]))).all()


def test_corners_are_found_where_they_are() -> None:
    turn, place = turned(0.3, -0.4, 0.2), np.array([-0.08, -0.06, 0.4])
    light = BoardPainter(DOCUMENT_LEFT, BOARD).paint(turn, place)
    noisy = np.clip(light + np.random.default_rng(0).normal(0, 3, light.shape), 0, 255).astype(np.uint8)
    found = find_board(noisy, BOARD)
    assert found is not None
    truth = pixels_of(DOCUMENT_LEFT, BOARD.points @ turn.T + place)
    off = np.linalg.norm(same_order(truth, found.corners) - truth, axis=1)
    assert np.sqrt(np.mean(off**2)) < 0.1
    softer = find_board(cv2.GaussianBlur(noisy, (0, 0), 2.0), BOARD)
    assert softer is not None
    assert softer.blur > 2 * found.blur
    assert find_board(np.full((240, 320), 90, np.uint8), BOARD) is None


def test_a_board_read_upside_down_is_turned() -> None:
    view = seen(rig(), 1)[0]
    assert np.array_equal(same_order(view.left, view.right), view.right)
    assert np.array_equal(same_order(view.left, view.right[::-1].copy()), view.right)


def test_blurred_views_are_told_from_sharp_ones() -> None:
    views = seen(rig(), 5)
    kept, gone = sharp([Sighting(view, 4.6 if number == 2 else 1.7) for number, view in enumerate(views)])
    assert [view.name for view in kept] == ["view00", "view01", "view03", "view04"]
    assert [one.name for one in gone] == ["view02"]
    assert "blurred" in gone[0].why
    assert sharp([]) == ((), ())


@pytest.fixture(scope="module")
def painted() -> tuple[StereoCameras, Calibration]:
    """The whole chain from pictures, in the middle of what a person takes: 24 boards that are found."""
    rng = np.random.default_rng(3)
    cameras = misaligned(rng)
    views: list[View] = []
    for shown in shown_boards(cameras, BOARD, rng, spread=0.6):
        found = sight(f"board{len(views)}", shown.left, shown.right, BOARD)
        if not isinstance(found, Dropped):
            views.append(found.view)
        if len(views) == 24:
            break
    return cameras, calibrate(views, BOARD, SIZE)


def test_painted_boards_give_the_cameras_back(painted: tuple[StereoCameras, Calibration]) -> None:
    truth, found = painted
    assert max(found.alone) < 0.1
    assert found.together < 0.1
    assert abs(found.cameras.baseline - truth.baseline) < 0.0002
    assert abs(found.cameras.left.fx / truth.left.fx - 1) < 0.01
    assert np.allclose(found.cameras.rotation, truth.rotation, atol=0.005)
    judged = judge(found.held_out, BOARD, found.cameras)
    assert judged.misalignment < 0.1
    assert judged.trouble == ()


def test_noise_leaves_the_error_that_theory_says() -> None:
    noise, views = 0.05, seen(rig(), 40)
    found = calibrate(views, BOARD, SIZE, hold_out=False)
    free = 1 - (4 + 5 + 6 * 40) / (2 * 48 * 40)  # of each camera's numbers, those that the fit does not take up
    for alone in found.alone:
        assert alone == pytest.approx(noise * np.sqrt(2 * free), rel=0.05)
    assert found.held_out == ()


def test_boards_that_moved_between_the_exposures_are_dropped_and_named() -> None:
    cameras = rig(1)
    views = seen(cameras, 30)
    for number, view in zip((4, 11, 19), seen(cameras, 3, seed=9, moved=0.003), strict=True):
        views[number] = view._replace(name=f"moved{number}")
    found = calibrate(views, BOARD, SIZE)
    assert {one.name for one in found.dropped} == {"moved4", "moved11", "moved19"}
    assert all("px" in one.why for one in found.dropped)
    assert abs(found.cameras.baseline - cameras.baseline) < 0.0002
    spoiled = calibrate(views, BOARD, SIZE, outlying=float("inf"), hold_out=False)
    assert spoiled.together > 2 * found.together


def test_a_corner_that_one_camera_misplaces_drops_its_view() -> None:
    views = seen(rig(), 25)
    views[7].right[20] += 3.0
    assert [one.name for one in calibrate(views, BOARD, SIZE).dropped] == ["view07"]


def test_kept_out_are_a_fifth_and_calibrate_nothing() -> None:
    found = calibrate(seen(rig(), 30), BOARD, SIZE)
    used, kept_out = {view.name for view in found.views}, {view.name for view in found.held_out}
    assert len(kept_out) == 6
    assert not used & kept_out
    assert len(used) + len(kept_out) + len(found.dropped) == 30


def test_too_few_views_are_refused() -> None:
    with pytest.raises(BadInput, match="found in 5 pairs"):
        calibrate(seen(rig(), 5), BOARD, SIZE)
    with pytest.raises(BadInput, match="to judge by"):
        calibrate(seen(rig(), 10), BOARD, SIZE)


def test_boards_that_all_face_one_way_are_refused() -> None:
    with pytest.raises(ToddleError, match=r"face one way|unsure"):
        calibrate(seen(rig(), 20, tilt=0.05), BOARD, SIZE)


def test_one_board_again_and_again_is_refused() -> None:
    view = seen(rig(), 1)[0]
    rng = np.random.default_rng(0)
    again = [
        View(f"{n}", view.left + rng.normal(0, 0.05, (48, 2)), view.right + rng.normal(0, 0.05, (48, 2)))
        for n in range(20)
    ]
    with pytest.raises(ToddleError, match=r"face one way|unsure|fits these"):
        calibrate(again, BOARD, SIZE)


def test_corners_of_another_board_are_refused() -> None:
    views = seen(rig(), 20)
    with pytest.raises(BadInput, match="view00: it has no 35 corners"):
        calibrate(views, Chessboard(7, 5), SIZE)
    views[3].left[0, 0] = np.nan
    with pytest.raises(BadInput, match="view03"):
        calibrate(views, BOARD, SIZE)


@pytest.mark.parametrize("numbers", [(2, 6, 0.02), (8, 200, 0.02), (8, 6, 0.0), (8, 6, float("nan"))])
def test_what_is_no_board_is_refused(numbers: tuple[int, int, float]) -> None:
    with pytest.raises(BadInput, match="board"):
        Chessboard(*numbers)


def test_the_gate_trusts_the_true_cameras() -> None:
    cameras = rig(2)
    judged = judge(seen(cameras, 10, seed=4), BOARD, cameras)
    assert judged.trouble == ()
    assert judged.misalignment < 0.1
    assert abs(judged.depth) < 0.02
    assert np.isnan(judged.known)


def undistorted(seed: int, *, focal: float = 1.0, right_centre: float = 0.0) -> StereoCameras:
    """A rig without distortion, its focal lengths and the right camera's centre said wrongly."""
    cameras = rig(seed)
    left, right = (
        replace(camera, fx=focal * camera.fx, fy=focal * camera.fy, distortion=(0.0, 0.0, 0.0, 0.0, 0.0))
        for camera in (cameras.left, cameras.right)
    )
    return replace(cameras, left=left, right=replace(right, cx=right.cx + right_centre))


@pytest.mark.parametrize("seed", range(3))
def test_the_gate_notices_disparities_that_are_off(seed: int) -> None:
    truth = undistorted(2)
    judged = judge(seen(truth, 12, seed=seed), BOARD, undistorted(2, right_centre=-0.6))
    too_small = 0.6 * truth.left.fx / truth.right.fx
    at_far = truth.left.fx * truth.baseline / 2.5
    assert judged.disparity == pytest.approx(-too_small, abs=0.05)
    assert judged.depth == pytest.approx(at_far / (at_far - too_small) - 1, abs=0.02)
    assert any("depth" in said for said in judged.trouble)
    assert judged.misalignment < 0.1  # rows don't tell


@pytest.mark.parametrize("seed", range(3))
def test_the_gate_notices_a_focal_length_that_is_off(seed: int) -> None:
    judged = judge(seen(undistorted(2), 12, seed=seed), BOARD, undistorted(2, focal=1.05))
    assert judged.focal == pytest.approx(0.05, abs=0.01)
    assert judged.trouble


def test_the_gate_notices_a_wrong_disparity_through_the_documents_lens() -> None:
    cameras = rig(2)
    shifted = replace(cameras, right=replace(cameras.right, cx=cameras.right.cx - 0.6))
    judged = judge(seen(cameras, 12, seed=4), BOARD, shifted)
    assert 0.05 < judged.depth < 0.2  # 0.105 in the middle of the picture
    assert judged.trouble


def test_the_gate_notices_rows_that_are_off() -> None:
    cameras = rig(2)
    lower = replace(cameras, right=replace(cameras.right, cy=cameras.right.cy + 0.5))
    judged = judge(seen(cameras, 12, seed=4), BOARD, lower)
    assert judged.misalignment == pytest.approx(0.5, abs=0.1)
    assert "height" in judged.trouble[0]


def test_the_gate_compares_known_distances() -> None:
    cameras = rig(2)
    views = seen(cameras, 10, seed=4, noise=0.0)
    longer = replace(cameras, translation=1.1 * cameras.translation)
    truth = distance_of(views[0], cameras, rectification(cameras))
    assert judge(views, BOARD, cameras, known=[(views[0], truth)]).known == pytest.approx(0, abs=1e-6)
    judged = judge(views, BOARD, longer, known=[(views[0], truth)])
    assert judged.known == pytest.approx(0.1 * truth, rel=0.02)
    assert any("is seen at" in said for said in judged.trouble)


def test_the_gate_asks_for_enough_boards() -> None:
    with pytest.raises(BadInput, match="judge nothing"):
        judge(seen(rig(), 3), BOARD, rig())
