"""``toddle see rectify``: a pair of pictures in which the same thing stands in the same row."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from toddle.cli.arguments import parse
from toddle.cli.options import POSITIONAL
from toddle.failures import BadInput

if TYPE_CHECKING:
    from toddle.see.pair import Ready

_PROG = "toddle see rectify"


@dataclass(frozen=True)
class Rectify:
    """A pair of pictures rectified, if it is not yet, and what is still off set right from the pictures themselves.

    Attributes:
        left: the left camera's picture.
        right: the right camera's picture.
        cameras: a calibration: a ROS camera_info pair (either file or the folder), OpenCV's YAML, Kalibr's camchain.
        rectified: the pair was rectified before (--no-rectified: it was not); unless given, the pictures tell.
        straighten: set right what is still off; --no-straighten leaves it.
        out: the folder to leave; runs/rectify unless given.
        json: print one JSON object with the figures, and nothing else.
    """

    left: Annotated[Path, POSITIONAL]
    right: Annotated[Path, POSITIONAL]
    cameras: Path
    rectified: bool | None = None
    straighten: bool = True
    out: Path | None = None
    json: bool = False


def main(argv: Sequence[str]) -> int:
    """Rectify, leave a folder, and return the exit code."""
    asked = parse(Rectify, argv, prog=_PROG)
    from toddle.cli.run_folder import new_folder
    from toddle.outside.files import write_json
    from toddle.outside.seeing.camera_files import read_cameras
    from toddle.outside.seeing.picture_files import read_picture, write_picture
    from toddle.see.pair import make_ready
    from toddle.see.rectify import rectification

    left, right = read_picture(asked.left), read_picture(asked.right)
    if left.shape != right.shape:
        what = f"{left.shape[1]} x {left.shape[0]} pixels on the left, {right.shape[1]} x {right.shape[0]} on the right"
        raise BadInput(what, where=str(asked.right), remedy="give two pictures of one size")
    file = read_cameras(asked.cameras, (left.shape[1], left.shape[0]))
    ready = make_ready(
        left, right, rectification(file.cameras), earlier=file.earlier, rectified=asked.rectified,
        straighten=asked.straighten,
    )  # fmt: skip
    folder = new_folder(asked.out, "rectify")
    write_picture(folder / "left.png", ready.left)
    write_picture(folder / "right.png", ready.right)
    _draw(folder, (left, right), ready)
    figures = _figures(ready, asked)
    write_json(folder / "figures.json", figures)
    _tell(figures, folder, as_json=asked.json)
    for said in ready.trouble:
        print(f"toddle: {said}", file=sys.stderr)
    return 0


def _draw(folder: Path, given: tuple[Any, Any], ready: Ready) -> None:
    """Figures 4.10 and 4.11 of the document."""
    from toddle.outside.seeing.seeing_pictures import before_and_after

    title = "rectified, and what was still off set right" if ready.straightened else "rectified"
    before_and_after(folder / "rectified.png", given, (ready.left, ready.right), titles=("as given", title))


def _figures(ready: Ready, asked: Rectify) -> dict[str, Any]:
    """What comes out, by name and unit."""
    camera, off = ready.cameras.camera, ready.off
    before = ready.verdict.rectified if asked.rectified is None else asked.rectified
    figures: dict[str, Any] = {
        "rectified_before": before, "rows_apart_as_taken_px": ready.verdict.as_it_is,
        "rows_apart_rectified_once_px": ready.verdict.once_more, "black_edges_overlap": ready.verdict.black,
        "matches": 0 if off is None else off.matches,
    }  # fmt: skip
    if off is not None:
        figures |= {
            "rows_apart_median_px": off.median, "rows_apart_p90_px": off.p90, "straightened": ready.straightened,
            "unseen_rows_apart_median_px": off.median_after if ready.straightened else off.median,
            "unseen_rows_apart_p90_px": off.p90_after if ready.straightened else off.p90,
            "shift_px": off.shift, "slope_across": off.slope_across, "slope_down": off.slope_down,
        }  # fmt: skip
    return {
        **figures, "focal_px": camera.fx, "centre_px": [camera.cx, camera.cy], "baseline_m": ready.cameras.baseline,
        "trouble": list(ready.trouble),
    }  # fmt: skip


def _tell(figures: dict[str, Any], folder: Path, *, as_json: bool) -> None:
    """Print the figures: one JSON object, or a table."""
    from toddle.cli.see_calibrate import shown
    from toddle.outside.files import finite
    from toddle.outside.terminal import print_table

    if as_json:
        print(json.dumps(finite({**figures, "folder": str(folder)})))
        return
    rows = [[name.replace("_", " "), shown(value)] for name, value in figures.items()]
    print_table("a pair of pictures", ("", "this pair"), rows)
    print(f"pictures and figures: {folder}")
