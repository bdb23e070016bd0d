"""Pictures of calibration and rectification, after Huber 2019, figures 4.9 to 4.11."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from toddle.outside.pictures import OURS, THEIRS, new_figure, plain_axes, save_figure
from toddle.see.chessboard import Chessboard

Picture = UInt8[np.ndarray, "rows columns 3"]
_LINES = 8


def corners(path: Path, pair: tuple[Picture, Picture], found: tuple[np.ndarray, np.ndarray], board: Chessboard) -> None:
    """The corners that were found in both pictures (figure 4.9)."""
    figure = new_figure(9.0, 3.8)
    for number, (picture, seen) in enumerate(zip(pair, found, strict=True)):
        axes = _shown(figure, 121 + number, picture, ("left", "right")[number])
        grid = seen.reshape(board.rows, board.columns, 2)
        colours = np.linspace(0, 1, board.rows)
        for row, colour in zip(grid, colours, strict=True):
            axes.plot(row[:, 0], row[:, 1], ".-", ms=4, lw=0.6, color=_rainbow(float(colour)))
    save_figure(figure, path)


def before_and_after(
    path: Path, before: tuple[Picture, Picture], after: tuple[Picture, Picture],
    *, titles: tuple[str, str] = ("as taken", "rectified"),
) -> None:  # fmt: skip
    """Both pictures side by side, before and after, with lines along the rows (figures 4.10 and 4.11).

    Args:
        path: the PNG to write.
        before: left and right picture.
        after: likewise.
        titles: what each pair is.
    """
    figure = new_figure(9.0, 7.0)
    for number, (pair, title) in enumerate(zip((before, after), titles, strict=True)):
        axes = _shown(figure, 211 + number, np.hstack(pair), title)
        for row in np.linspace(0, pair[0].shape[0], _LINES + 2)[1:-1]:
            axes.axhline(row, color="#3fa7ff", lw=0.7)
    save_figure(figure, path)


def errors(path: Path, names: Sequence[str], found: Float[np.ndarray, "views 2"]) -> None:
    """The re-projection error of each view in both cameras [pixels]."""
    figure = new_figure(9.0, 3.6)
    axes = plain_axes(figure)
    place = np.arange(len(names))
    axes.bar(place - 0.2, found[:, 0], width=0.4, color=OURS, label="left")
    axes.bar(place + 0.2, found[:, 1], width=0.4, color=THEIRS, label="right")
    shown = names if len(names) <= 60 else [""] * len(names)
    axes.set_xticks(place, shown, rotation=90, fontsize=6, parse_math=False)
    axes.set(ylabel="re-projection error [px]", title="each view's error")
    axes.legend(frameon=False)
    save_figure(figure, path)


def _shown(figure: Any, position: int, picture: Picture, title: str) -> Any:
    axes = plain_axes(figure, position)
    axes.imshow(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB))
    axes.grid(visible=False)
    axes.set(xticks=[], yticks=[], title=title)
    return axes


def _rainbow(share: float) -> tuple[float, float, float]:
    """Red to violet."""
    hue = np.uint8([[[int(150 * share), 220, 255]]])  # type: ignore[call-overload]
    blue, green, red = cv2.cvtColor(np.asarray(hue), cv2.COLOR_HSV2BGR)[0, 0] / 255
    return float(red), float(green), float(blue)
