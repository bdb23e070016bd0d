"""Pictures of depth: of one pair, and of every stage from what the cameras gave to metres.

After Huber 2019, figures 2.20 to 2.28 (the stages), 4.8 (without calibration), 4.11 (rectified), 4.12 (window N and
number of disparities D) and 4.13 (lambda and sigma).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float, UInt8, UInt16

from toddle.outside.pictures import new_figure, plain_axes, save_figure
from toddle.outside.seeing.picture_files import write_picture
from toddle.outside.seeing.seeing_pictures import before_and_after
from toddle.see.depth import DOCUMENT, Setting, depth_of, image_of, stages_of
from toddle.see.filters import LeastSquares
from toddle.see.matchers import DocumentMatching
from toddle.see.pair import Ready
from toddle.see.straighten import grey
from toddle.signals import DepthImage

Picture = UInt8[np.ndarray, "rows columns 3"]
NEAR, FAR = 0.5, 4.0
"""Where colours begin and end [m]."""
_MILLIMETRES = 65535  # the most that 16 bits hold
_WINDOWS, _DISPARITIES = (5, 9, 13, 21), (16, 32, 48)
_SMOOTHNESS, _RANGES = (1e2, 1e3, 1e4, 1e5), (0.5, 1.0, 4.0)


def millimetres(image: DepthImage) -> UInt16[np.ndarray, "rows columns"]:
    """Depth [mm] where it is valid, 0 elsewhere."""
    depth = np.where(image.valid, np.nan_to_num(image.depth), 0.0)
    return np.clip(np.rint(1000 * depth), 0, _MILLIMETRES).astype(np.uint16)


def coloured(depth: Float[np.ndarray, "rows columns"]) -> Picture:
    """Near is red, far is blue, unknown is black; blue, green, red."""
    known = np.isfinite(depth) & (depth > 0)
    inverse = np.divide(1.0, depth, out=np.zeros(depth.shape), where=known)
    share = np.clip((inverse - 1 / FAR) / (1 / NEAR - 1 / FAR), 0, 1)
    return _in_colour(share, known)


def write_depth(folder: Path, name: str, image: DepthImage) -> None:
    """Depth as a PNG of 16 bits [mm], 0 where it is not to be trusted, and in colours for the eye."""
    write_picture(folder / f"{name}depth.png", millimetres(image))
    write_picture(folder / f"{name}depth_coloured.png", coloured(np.where(image.valid, image.depth, np.nan)))


def write_stages(
    folder: Path, given: tuple[Picture, Picture], undistorted: tuple[Picture, Picture], ready: Ready, setting: Setting
) -> None:
    """Every stage (figures 2.20 to 2.28, 4.8, 4.10 and 4.11), and what N, D, lambda and sigma do (4.12, 4.13).

    Args:
        folder: to write to.
        given: the pictures as they came.
        undistorted: the same without the lenses' distortion.
        ready: the rectified pair.
        setting: how depth is found.
    """
    pair = ready.left, ready.right
    before_and_after(folder / "rectified.png", undistorted, pair, titles=("undistorted", "rectified"))
    stages, named = _stages(given, undistorted, ready, setting)
    _grid(folder / "stages.png", named, columns=3)
    for name, picture in stages.items():
        write_picture(folder / f"stage_{name}.png", picture)
    _windows(folder / "effect_of_N_and_D.png", ready)
    _weights(folder / "effect_of_lambda_and_sigma.png", ready)


def _stages(
    given: tuple[Picture, Picture], undistorted: tuple[Picture, Picture], ready: Ready, setting: Setting
) -> tuple[dict[str, Picture], list[tuple[str, Picture]]]:
    ours, theirs = grey(ready.left), grey(ready.right)
    made = stages_of(ours, theirs, setting)
    image = image_of(made, ready.cameras, setting, ready.seen[0])
    size = (ours.shape[1], ours.shape[0])
    top = _top(setting, size)
    scale = size[0] / made.found.disparity.shape[1]
    raw = cv2.resize(made.found.disparity * np.float32(scale), size, interpolation=cv2.INTER_NEAREST)
    sure = cv2.resize(made.found.confidence, size, interpolation=cv2.INTER_NEAREST)
    raw_of_given = depth_of(grey(given[0]), grey(given[1]), ready.cameras, setting)
    stages = {
        "original": given[0], "undistorted": undistorted[0], "rectified": ready.left,
        "edges": _edges(ours), "disparity": _in_colour(raw / top, raw > 0),
        "confidence_of_matches": _in_grey(sure), "disparity_smoothed": _in_colour(image.disparity / top, None),
        "confidence": _in_grey(image.confidence), "depth": coloured(image.depth),
        "depth_trusted": coloured(np.where(image.valid, image.depth, np.nan)),
        "depth_without_calibration": coloured(raw_of_given.depth),
    }  # fmt: skip
    return stages, [(name.replace("_", " "), picture) for name, picture in stages.items()]


def _windows(path: Path, ready: Ready) -> None:
    """Block matching with other windows and numbers of disparities (figure 4.12)."""
    shown = []
    for disparities in _DISPARITIES:
        for window in _WINDOWS:
            found = DocumentMatching(window, disparities).find(grey(ready.left), grey(ready.right)).disparity
            shown.append((f"N = {window}, D = {disparities}", _in_colour(found / _DISPARITIES[1], found > 0)))
    _grid(path, shown, columns=len(_WINDOWS))


def _weights(path: Path, ready: Ready) -> None:
    """Smoothing with other weights (figure 4.13)."""
    shown = []
    ours, theirs = grey(ready.left), grey(ready.right)
    found = DOCUMENT.matcher.find(ours, theirs)
    for range_ in _RANGES:
        for smoothness in _SMOOTHNESS:
            smooth = LeastSquares(smoothness, range_).smooth(found, ours).disparity
            name = f"lambda = {smoothness:g}, sigma = {range_:g}"
            shown.append((name, _in_colour(smooth / _DISPARITIES[1], smooth > 0)))
    _grid(path, shown, columns=len(_SMOOTHNESS))


def _top(setting: Setting, size: tuple[int, int]) -> float:
    """The largest disparity that is looked for [pixels]; a tenth of the width where the matcher doesn't tell."""
    looked_for = getattr(setting.matcher, "disparities", 0) * setting.match_at
    return float(looked_for or size[0] / 10)


def _edges(picture: UInt8[np.ndarray, "rows columns"]) -> Picture:
    """Slopes along the rows, which blocks are compared by (figure 2.20)."""
    slopes = cv2.Sobel(picture, cv2.CV_32F, 1, 0) / 4 + 128
    return cv2.cvtColor(np.clip(slopes, 0, 255).astype(np.uint8), cv2.COLOR_GRAY2BGR).astype(np.uint8)


def _in_grey(share: Float[np.ndarray, "rows columns"]) -> Picture:
    whole = np.clip(255 * np.nan_to_num(share), 0, 255).astype(np.uint8)
    return cv2.cvtColor(whole, cv2.COLOR_GRAY2BGR).astype(np.uint8)


def _in_colour(share: Float[np.ndarray, "rows columns"], known: Any) -> Picture:
    known = np.isfinite(share) if known is None else known
    whole = np.clip(255 * np.nan_to_num(share), 0, 255).astype(np.uint8)
    picture = cv2.applyColorMap(whole, cv2.COLORMAP_TURBO).astype(np.uint8)
    return np.where(known[..., None], picture, np.uint8(0))


def _grid(path: Path, shown: list[tuple[str, Picture]], columns: int) -> None:
    """Pictures with names, side by side."""
    rows = -(-len(shown) // columns)
    figure = new_figure(3.2 * columns, 2.65 * rows)
    places = figure.add_gridspec(rows, columns)
    for number, (name, picture) in enumerate(shown):
        axes = plain_axes(figure, places[number // columns, number % columns])
        axes.imshow(picture[..., ::-1])
        axes.grid(visible=False)
        axes.set(xticks=[], yticks=[])
        axes.set_title(name, fontsize=9)
    save_figure(figure, path)
