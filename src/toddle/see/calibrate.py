"""Two cameras from pictures of a chessboard: Zhang's method as OpenCV has it (Zhang 2000; Huber 2019, section 2.2.4).

Each camera alone first, then both together. A view whose error is above 2.5 times the median of its kind is dropped and
named (a board that moved between the two exposures shows only where both are joined), and the rest is solved again. A
low error is no proof: a fifth of the good views is kept out of the solution, and judged by `toddle.see.gate`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput, ToddleError
from toddle.geometry.camera import Pinhole, StereoCameras
from toddle.see.chessboard import Chessboard

OUTLYING = 2.5
"""Times the median error: a view above it is dropped."""
FEWEST = 8
"""Views, less than which say too little of a lens."""
FEWEST_KEPT_OUT = 4
"""Views, less than which judge nothing."""
_TILTED = 15.0  # degrees: the least greatest angle between two boards
_UNSURE = 0.02  # of the focal length: its standard deviation
_ROUNDS = 5
_STOP = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 100, 1e-9)


class View(NamedTuple):
    """A board seen by both cameras at once; the same corner stands in the same row.

    Attributes:
        name: what to call it.
        left: its corners [pixels].
        right: likewise.
    """

    name: str
    left: Float[np.ndarray, "corners 2"]
    right: Float[np.ndarray, "corners 2"]


class Dropped(NamedTuple):
    """A view that was not used: which, and why in words."""

    name: str
    why: str


class Fitted(NamedTuple):
    """One camera from its views.

    Attributes:
        camera: with its distortion.
        errors: root mean square distance of the corners from where the camera would see them, each view [pixels].
        normals: of the boards, in the camera's frame.
        unsure: standard deviation of the focal length, as a share of it.
    """

    camera: Pinhole
    errors: Float[np.ndarray, " views"]
    normals: Float[np.ndarray, "views 3"]
    unsure: float


class Calibration(NamedTuple):
    """What the pictures say of two cameras.

    Attributes:
        cameras: both, and how they stand to each other.
        views: the views it rests on.
        errors: root mean square re-projection error of each view in the left and the right camera, with one board pose
            for both [pixels].
        alone: root mean square re-projection error of all views, each camera by itself [pixels] (equation 2.148).
        together: the same for both cameras joined [pixels].
        held_out: good views that it does not rest on.
        dropped: the others, and why.
    """

    cameras: StereoCameras
    views: tuple[View, ...]
    errors: Float[np.ndarray, "views 2"]
    alone: tuple[float, float]
    together: float
    held_out: tuple[View, ...]
    dropped: tuple[Dropped, ...]


def calibrate(
    views: Sequence[View],
    board: Chessboard,
    size: tuple[int, int],
    *,
    hold_out: bool = True,
    outlying: float = OUTLYING,
) -> Calibration:
    """Intrinsics, distortion, rotation and translation of two cameras.

    Args:
        views: of the board, many and tilted; 60 in the document.
        board: its corners are the views' rows.
        size: of the pictures: width, height [pixels].
        outlying: times the median error: a view above it is dropped.
        hold_out: a fifth of the good views, four at least, is kept out to judge by.

    Raises:
        BadInput: too few views, or views that don't tell the lens.
        ToddleError: OpenCV found no solution.
    """
    _check(views, board)
    kept, dropped = list(views), []
    for side in ("left", "right"):
        kept, gone = _without_outliers(kept, board, size, side, outlying)
        dropped += gone
    kept, gone = _without_misfits(kept, board, size, outlying)
    dropped += gone
    held_out = _evenly(kept) if hold_out else []
    kept = [view for view in kept if not any(view is one for one in held_out)]
    left, right = (fit_camera([getattr(view, side) for view in kept], board, size) for side in ("left", "right"))
    for side, fitted in (("left", left), ("right", right)):
        _refuse_degenerate(side, fitted)
    cameras, errors = _joined(kept, board, left.camera, right.camera)
    alone = (_overall(left.errors), _overall(right.errors))
    return Calibration(cameras, tuple(kept), errors, alone, _overall(errors), tuple(held_out), tuple(dropped))


def fit_camera(corners: Sequence[Float[np.ndarray, "corners 2"]], board: Chessboard, size: tuple[int, int]) -> Fitted:
    """One camera from a board's corners in several pictures (equations 2.143 to 2.148).

    Raises:
        ToddleError: OpenCV found no solution.
    """
    points = [board.points.astype(np.float32)] * len(corners)
    pixels = [view.astype(np.float32)[:, None] for view in corners]
    try:
        _, matrix, bend, turns, _, spread, _, errors = cv2.calibrateCameraExtended(
            points, pixels, size, np.zeros((3, 3)), np.zeros(5), criteria=_STOP
        )
    except cv2.error as fault:
        raise ToddleError("no camera fits these views", where="calibration", remedy="take other pictures") from fault
    normals = np.stack([cv2.Rodrigues(turn)[0][:, 2] for turn in turns])
    camera = _pinhole(matrix, bend, size)
    return Fitted(camera, np.ravel(errors), normals, float(np.max(spread.ravel()[:2]) / camera.fx))


def _overall(errors: Float[np.ndarray, "*views"]) -> float:
    """The root mean square of root mean squares [pixels]."""
    return float(np.sqrt(np.mean(errors**2)))


def _pinhole(matrix: np.ndarray, bend: np.ndarray, size: tuple[int, int]) -> Pinhole:
    fx, fy, cx, cy = (float(matrix[place]) for place in ((0, 0), (1, 1), (0, 2), (1, 2)))
    k1, k2, p1, p2, k3 = (float(value) for value in np.ravel(bend)[:5])
    return Pinhole(int(size[0]), int(size[1]), fx, fy, cx, cy, (k1, k2, p1, p2, k3))


def _check(views: Sequence[View], board: Chessboard) -> None:
    """Refuse what no calibration can come from."""
    if len(views) < FEWEST:
        remedy = f"give {FEWEST} or more, better 40, in which both cameras see the whole board"
        raise BadInput(f"the board was found in {len(views)} pairs of pictures", where="calibration", remedy=remedy)
    corners = board.columns * board.rows
    for view in views:
        for seen in (view.left, view.right):
            if seen.shape != (corners, 2) or not np.isfinite(seen).all():
                raise BadInput(f"it has no {corners} corners", where=view.name, remedy="check the board's size")


def _evenly(views: list[View]) -> list[View]:
    """A fifth of the views, from all over the recording."""
    count = max(len(views) // 5, FEWEST_KEPT_OUT)
    if len(views) - count < FEWEST:
        what = f"{len(views)} good views are too few to calibrate from and to judge by"
        remedy = f"give {FEWEST + FEWEST_KEPT_OUT} or more, better 60"
        raise BadInput(what, where="calibration", remedy=remedy)
    places = {round((number + 0.5) * len(views) / count - 0.5) for number in range(count)}
    return [view for number, view in enumerate(views) if number in places]


def _without_outliers(
    views: list[View], board: Chessboard, size: tuple[int, int], side: str, outlying: float
) -> tuple[list[View], list[Dropped]]:
    """The views that one camera agrees on, and the others."""
    dropped: list[Dropped] = []
    for _ in range(_ROUNDS):
        errors = fit_camera([getattr(view, side) for view in views], board, size).errors
        views, gone = _split(views, errors, outlying, f"in the {side} camera")
        dropped += gone
        if not gone:
            break
    return views, dropped


def _without_misfits(
    views: list[View], board: Chessboard, size: tuple[int, int], outlying: float
) -> tuple[list[View], list[Dropped]]:
    """The views that both cameras agree on, and the others."""
    dropped: list[Dropped] = []
    for _ in range(_ROUNDS):
        left, right = (fit_camera([getattr(view, side) for view in views], board, size) for side in ("left", "right"))
        _, errors = _joined(views, board, left.camera, right.camera)
        views, gone = _split(
            views, np.sqrt(np.mean(errors**2, axis=1)), outlying, "between the cameras: it moved, or is blurred"
        )
        dropped += gone
        if not gone:
            break
    return views, dropped


def _split(
    views: list[View], errors: Float[np.ndarray, " views"], outlying: float, where: str
) -> tuple[list[View], list[Dropped]]:
    """The views near the median error, and those far above it."""
    middle = float(np.median(errors))
    far = errors > outlying * middle
    if len(views) - far.sum() < FEWEST:
        remedy = "hold the board and the cameras still, and take more pictures"
        raise BadInput("too few views agree with each other", where="calibration", remedy=remedy)
    said = [f"{error:.2f} px {where} (median {middle:.2f})" for error in errors]
    gone = [Dropped(view.name, why) for view, why, out in zip(views, said, far, strict=True) if out]
    return [view for view, out in zip(views, far, strict=True) if not out], gone


def _joined(
    views: Sequence[View], board: Chessboard, left: Pinhole, right: Pinhole
) -> tuple[StereoCameras, Float[np.ndarray, "views 2"]]:
    """Both cameras, refined together, and the error of each view in each."""
    points = [board.points.astype(np.float32)] * len(views)
    seen = [[getattr(view, side).astype(np.float32)[:, None] for view in views] for side in ("left", "right")]
    bends = [np.array(camera.distortion) for camera in (left, right)]
    size = (left.width, left.height)
    try:
        _, k1, d1, k2, d2, rotation, translation, _, _, _, _, errors = cv2.stereoCalibrateExtended(
            points, seen[0], seen[1], left.matrix, bends[0], right.matrix, bends[1], size,
            np.eye(3), np.zeros((3, 1)), flags=cv2.CALIB_USE_INTRINSIC_GUESS, criteria=_STOP,
        )  # fmt: skip  # type: ignore[call-overload]
    except cv2.error as fault:
        raise ToddleError("no pair of cameras fits these views", where="calibration", remedy="take others") from fault
    cameras = StereoCameras(_pinhole(k1, d1, size), _pinhole(k2, d2, size), rotation, np.ravel(translation))
    return cameras, np.asarray(errors).reshape(-1, 2)


def _refuse_degenerate(side: str, fitted: Fitted) -> None:
    """Boards that all face one way fit many lenses equally well."""
    cosines = np.clip(fitted.normals @ fitted.normals.T, -1, 1)
    widest = float(np.rad2deg(np.arccos(cosines.min())))
    remedy = "tilt the board 20 to 45 degrees in several directions, and show it everywhere in the picture"
    if widest < _TILTED:
        raise BadInput(f"all boards face one way (within {widest:.0f} degrees)", where="calibration", remedy=remedy)
    if fitted.unsure > _UNSURE:
        what = f"the views leave the {side} focal length unsure by {100 * fitted.unsure:.0f} %"
        raise BadInput(what, where="calibration", remedy=remedy)
