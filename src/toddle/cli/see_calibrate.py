"""``toddle see calibrate``: two cameras, from folders of chessboard pictures."""

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
    from toddle.outside.seeing.board_pictures import Boards
    from toddle.see.calibrate import Calibration
    from toddle.see.chessboard import Chessboard
    from toddle.see.gate import Judged

_PROG = "toddle see calibrate"


@dataclass(frozen=True)
class Calibrate:
    """Two cameras from pictures of a chessboard: lenses, how they stand to each other, and how far to trust it.

    Pictures belong together by their names: left07.png and right07.png, or the same name in both folders. Boards that
    don't fit the others are dropped and named; every fifth of the rest is kept out, and judges. The exit code is 1
    where those say that the calibration can't be trusted.

    Attributes:
        left: the folder of the left camera's pictures.
        right: the folder of the right camera's pictures.
        corners: inner corners along the board's two sides.
        square: side of a square [mm].
        known: the name of a pair in which the board's distance is known: it is kept out, and judges.
        distance: that distance, from the left camera to the board's middle along the line of sight [m].
        out: the folder to leave; runs/calibrate unless given.
        json: print one JSON object with the figures, and nothing else.
    """

    left: Annotated[Path, POSITIONAL]
    right: Annotated[Path, POSITIONAL]
    corners: tuple[int, int] = (8, 6)
    square: float = 22.5
    known: str | None = None
    distance: float | None = None
    out: Path | None = None
    json: bool = False


def main(argv: Sequence[str]) -> int:
    """Calibrate, leave a folder, and return the exit code."""
    asked = parse(Calibrate, argv, prog=_PROG)
    _check(asked)
    from toddle.cli.run_folder import new_folder
    from toddle.outside.files import write_json
    from toddle.outside.seeing.camera_files import write_cameras
    from toddle.see.calibrate import calibrate
    from toddle.see.gate import judge
    from toddle.see.rectify import rectification

    board = _board(asked)
    boards = _found(asked, board)
    views, known = _without_known(asked, boards)
    found = calibrate(views, board, boards.size)
    judged = judge(found.held_out, board, found.cameras, known=known)
    made = rectification(found.cameras)
    folder = new_folder(asked.out, "calibrate")
    files = write_cameras(folder, found.cameras, made)
    figures = _figures(boards, found, judged)
    write_json(folder / "figures.json", figures)
    write_json(folder / "views.json", _views(found, boards))
    _draw(folder, found, boards, board)
    _tell(figures, folder, files[0], as_json=asked.json)
    for said in judged.trouble:
        print(f"toddle: not to be trusted: {said}", file=sys.stderr)
    return 1 if judged.trouble else 0


def _check(asked: Calibrate) -> None:
    """Refuse what contradicts itself."""
    if (asked.known is None) != (asked.distance is None):
        raise BadInput("--known and --distance belong together", where=_PROG, remedy="give both")
    if asked.distance is not None and not 0.05 <= asked.distance <= 100:
        raise BadInput(f"{asked.distance:g} m is out of range", where="--distance", remedy="give 0.05 to 100 [m]")
    if not 0.1 <= asked.square <= 10_000:
        raise BadInput(f"{asked.square:g} mm is out of range", where="--square", remedy="give 0.1 to 10000 [mm]")
    if not all(3 <= count <= 100 for count in asked.corners):
        raise BadInput("it is out of range", where="--corners", remedy="give 3 to 100 a side")


def _board(asked: Calibrate) -> Chessboard:
    from toddle.see.chessboard import Chessboard

    return Chessboard(asked.corners[0], asked.corners[1], asked.square / 1000)


def _found(asked: Calibrate, board: Chessboard) -> Boards:
    """The boards in the pictures."""
    from toddle.outside.seeing.board_pictures import find_boards
    from toddle.outside.seeing.picture_files import paired
    from toddle.outside.terminal import Reporter

    pairs = paired(asked.left, asked.right)
    with Reporter("pairs of pictures", len(pairs.pairs), quiet=asked.json) as reporter:
        return find_boards(pairs, board, progress=lambda done, name: reporter.tell(done, name))


def _without_known(asked: Calibrate, boards: Boards) -> tuple[list[Any], list[tuple[Any, float]]]:
    """The views to calibrate from, and the one whose distance is known."""
    if asked.known is None or asked.distance is None:
        return list(boards.views), []
    there = {view.name: view for view in boards.views}
    if asked.known not in there:
        from toddle.failures import unknown_name

        raise unknown_name("pair with a board", asked.known, there, where="--known")
    return [v for v in boards.views if v.name != asked.known], [(there[asked.known], asked.distance)]


def _figures(boards: Boards, found: Calibration, judged: Judged) -> dict[str, Any]:
    """What comes out, by name and unit."""
    left, right = found.cameras.left, found.cameras.right
    dropped = (*boards.dropped, *found.dropped)
    return {
        "pairs": len(boards.views) + len(boards.dropped), "used": len(found.views), "held_out": judged.boards,
        "dropped": dict(dropped),
        "reprojection_left_px": found.alone[0], "reprojection_right_px": found.alone[1],
        "reprojection_stereo_px": found.together, "baseline_mm": 1000 * found.cameras.baseline,
        "focal_left_px": [left.fx, left.fy], "focal_right_px": [right.fx, right.fy],
        "held_out_rows_apart_px": judged.misalignment, "held_out_disparity_off_px": judged.disparity,
        "held_out_depth_error_percent_at_2.5_m": 100 * judged.depth,
        "held_out_depth_error_percent_unsure": 100 * judged.depth_unsure,
        "known_distance_off_m": judged.known, "trusted": not judged.trouble, "trouble": list(judged.trouble),
    }  # fmt: skip


def _views(found: Calibration, boards: Boards) -> dict[str, Any]:
    """Each pair: its errors in both cameras [px], or why it was dropped."""
    used = {
        view.name: {"left_px": float(left), "right_px": float(right)}
        for view, (left, right) in zip(found.views, found.errors, strict=True)
    }
    held = {view.name: {"held_out": True} for view in found.held_out}
    return {**used, **held, **{name: {"dropped": why} for name, why in (*boards.dropped, *found.dropped)}}


def _draw(folder: Path, found: Calibration, boards: Boards, board: Chessboard) -> None:
    """Figures 4.9 and 4.10 of the document, and the errors."""
    from toddle.outside.seeing import seeing_pictures as pictures
    from toddle.outside.seeing.picture_files import read_picture
    from toddle.see.rectify import rectification, rectify

    made = rectification(found.cameras)
    shown = (found.held_out or found.views)[0]
    left, right = (read_picture(path) for path in boards.files[shown.name])
    pictures.corners(folder / "corners.png", (left, right), (shown.left, shown.right), board)
    after = rectify(made.left, left), rectify(made.right, right)
    pictures.before_and_after(folder / "rectified.png", (left, right), after)
    pictures.errors(folder / "errors.png", [view.name for view in found.views], found.errors)


def _tell(figures: dict[str, Any], folder: Path, file: Path, *, as_json: bool) -> None:
    """Print the figures: one JSON object, or a table."""
    from toddle.outside.files import finite
    from toddle.outside.terminal import print_table

    if as_json:
        print(json.dumps(finite({**figures, "folder": str(folder)})))
        return
    rows = [[name.replace("_", " "), shown(value)] for name, value in figures.items() if name != "dropped"]
    print_table("two cameras", ("", "this calibration"), rows)
    for name, why in figures["dropped"].items():
        print(f"dropped {ascii(name)[1:-1]}: {why}")  # a file's name may hold anything
    print(f"cameras, figures and pictures: {folder}")
    print(f"go on: toddle see rectify LEFT RIGHT --cameras {file}")


def shown(value: object) -> str:
    """A figure as the table shows it."""
    if isinstance(value, list):
        return ", ".join(map(shown, value)) or "none"
    if isinstance(value, float):
        return "not known" if value != value else f"{value:.3f}"
    return {True: "yes", False: "no"}[value] if isinstance(value, bool) else str(value)
