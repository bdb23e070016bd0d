"""Is a calibration to be trusted? It is judged by boards that it has not seen, and by what it says of their depth.

A low re-projection error is no proof: ten views can agree on cameras whose disparities are a third of a pixel off. The
squares of a board that was kept out have known sides: seen by both cameras and triangulated, sides across the line of
sight tell whether disparities are off, and sides along it whether the focal length is (a board need not stand at a
known distance for it). Where distances are known too, they are compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.geometry.camera import RectifiedCameras, StereoCameras
from toddle.see.calibrate import FEWEST_KEPT_OUT, View
from toddle.see.chessboard import Chessboard
from toddle.see.rectify import Rectification, rectification, rectified_points

WORST_ROWS = 0.25
"""Vertical misalignment above which block matching suffers [pixels]."""
WORST_DEPTH = 0.05
"""Error of depth, as a share of it, that must be ruled out (by two standard errors) for a calibration to be trusted."""
FAR = 2.5
"""Where that error is told [m]."""
_STEPS = 8


class Judged(NamedTuple):
    """What boards that a calibration has not seen say of it.

    Attributes:
        boards: how many there were.
        misalignment: median distance between the rows of the same corner in both rectified pictures [pixels].
        misalignment_mean: its mean [pixels].
        disparity: by how much disparities are too large [pixels].
        focal: by how much the focal length is too large, as a share of it.
        depth: the error of depth that follows at `FAR`, as a share of it; positive: things seem too far.
        depth_unsure: its standard error, from the spread between the boards.
        known: mean error of depth of the boards whose distance is known [m]; NaN: none was.
        trouble: what is wrong, in words; empty: the calibration can be trusted.
    """

    boards: int
    misalignment: float
    misalignment_mean: float
    disparity: float
    focal: float
    depth: float
    depth_unsure: float
    known: float
    trouble: tuple[str, ...]


def judge(
    views: Sequence[View], board: Chessboard, cameras: StereoCameras, *, known: Sequence[tuple[View, float]] = ()
) -> Judged:
    """Judge a calibration.

    Args:
        views: boards that it does not rest on, four or more.
        board: what they show.
        cameras: as calibrated.
        known: boards whose distance is known: of their middle, along the rectified left camera's axis [m].

    Raises:
        BadInput: too few views.
    """
    if len(views) < FEWEST_KEPT_OUT:
        raise BadInput(f"{len(views)} boards judge nothing", where="gate", remedy=f"keep out {FEWEST_KEPT_OUT} or more")
    made = rectification(cameras)
    pairs = [both_rectified(view, cameras, made) for view in views]
    rows = np.abs(np.concatenate([right[:, 1] - left[:, 1] for left, right in pairs]))
    rows = rows[np.isfinite(rows)]
    wrong = _wrong(pairs, board, made.cameras)
    depth = _depth_error(wrong, made.cameras)
    rest = [[*pairs[:number], *pairs[number + 1 :]] for number in range(len(pairs))]
    depths = [_depth_error(_wrong(some, board, made.cameras), made.cameras) for some in rest]
    unsure = float(np.sqrt((len(pairs) - 1) * np.var(depths)))  # the jackknife
    places = [(distance_of(view, cameras, made), truth) for view, truth in known]
    off = float(np.mean([place - truth for place, truth in places])) if places else float("nan")
    middle = float(np.median(rows))
    trouble = _trouble(middle, depth, unsure, places)
    mean = float(np.mean(rows))
    return Judged(
        len(views), middle, mean, float(wrong[0]), float(wrong[1]), depth, unsure, off, trouble,
    )  # fmt: skip


def distance_of(view: View, cameras: StereoCameras, made: Rectification) -> float:
    """How far a board's middle is seen along the rectified left camera's axis [m]."""
    return float(np.nanmean(_triangulated(both_rectified(view, cameras, made), made.cameras)[:, 2]))


def both_rectified(
    view: View, cameras: StereoCameras, made: Rectification
) -> tuple[Float[np.ndarray, "corners 2"], Float[np.ndarray, "corners 2"]]:
    """A view's corners in both rectified pictures [pixels]."""
    ideal, (first, second) = made.cameras.camera, made.rotations
    return (
        rectified_points(cameras.left, first, ideal, view.left),
        rectified_points(cameras.right, second, ideal, view.right),
    )


def _triangulated(
    pair: tuple[np.ndarray, np.ndarray], ideal: RectifiedCameras, disparity: float = 0.0, focal: float = 0.0
) -> Float[np.ndarray, "corners 3"]:
    """Where the corners are [m], if disparities are too large by so much and the focal length by such a share."""
    left, right = pair
    camera = ideal.camera
    apart = _flat(left, left[:, 0] - right[:, 0]) - disparity
    true = camera.fx / (1 + focal)
    z = true * ideal.baseline / apart
    rows = (left[:, 1] + right[:, 1]) / 2
    return np.stack([(left[:, 0] - camera.cx) * z / true, (rows - camera.cy) * z / true, z], axis=1)


def _flat(
    pixels: Float[np.ndarray, "corners 2"], disparity: Float[np.ndarray, " corners"]
) -> Float[np.ndarray, " corners"]:
    """Disparities without their noise, which would make every distance longer: those of a plane are an affine function
    of the pixel."""
    good = np.isfinite(disparity)
    basis = np.concatenate([pixels, np.ones((len(pixels), 1))], axis=1)
    return basis @ np.linalg.lstsq(basis[good], disparity[good], rcond=None)[0]


def _sides(points: Float[np.ndarray, "corners 3"]) -> Float[np.ndarray, " pairs"]:
    one, other = np.triu_indices(len(points), k=1)
    return np.linalg.norm(points[one] - points[other], axis=1)


def _wrong(
    pairs: Sequence[tuple[np.ndarray, np.ndarray]], board: Chessboard, ideal: RectifiedCameras
) -> Float[np.ndarray, "2"]:
    """The disparity [pixels] and the focal length (a share of it) that are too large by so much: Gauss-Newton on the
    distances between all corners of each board."""
    sides = _sides(board.points)

    def misfit(wrong: np.ndarray) -> np.ndarray:
        off = [_sides(_triangulated(pair, ideal, float(wrong[0]), float(wrong[1]))) / sides - 1 for pair in pairs]
        return np.concatenate(off)

    wrong, small = np.zeros(2), (1e-3, 1e-4)
    for _ in range(_STEPS):
        here = misfit(wrong)
        slopes = np.stack([(misfit(wrong + step) - here) / step.max() for step in np.diag(small)], axis=1)
        good = np.isfinite(here)
        change = np.linalg.lstsq(slopes[good], -here[good], rcond=None)[0]
        wrong = wrong + change
        if np.all(np.abs(change) < small):
            break
    return wrong


def _depth_error(wrong: Float[np.ndarray, "2"], ideal: RectifiedCameras) -> float:
    """What follows for something `FAR` away: its apparent depth over the true one, less 1."""
    disparity, focal = wrong
    true = ideal.camera.fx / (1 + focal) * ideal.baseline / FAR
    seen = max(true + disparity, 1e-6)
    return float(ideal.camera.fx * ideal.baseline / seen / FAR - 1)


def _trouble(rows: float, depth: float, unsure: float, places: Sequence[tuple[float, float]]) -> tuple[str, ...]:
    said = []
    if not rows <= WORST_ROWS:
        said.append(f"boards kept out stand {rows:.2f} px apart in height")
    if not abs(depth) <= WORST_DEPTH:
        said.append(f"boards kept out say that depth at {FAR} m is wrong by {100 * depth:+.0f} %")
    elif not abs(depth) + 2 * unsure <= WORST_DEPTH:
        said.append(f"boards kept out leave the depth at {FAR} m unsure by {200 * unsure:.0f} %: show more")
    for place, truth in places:
        if not abs(place - truth) <= WORST_DEPTH * truth:
            said.append(f"a board at {truth:.2f} m is seen at {place:.2f} m")
    return tuple(said)
