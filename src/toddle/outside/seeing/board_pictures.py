"""Pairs of picture files, and the boards in them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from toddle.failures import BadInput
from toddle.outside.seeing.picture_files import Paired, read_picture
from toddle.see.calibrate import OUTLYING, Dropped, View
from toddle.see.chessboard import Chessboard, find_board, same_order
from toddle.see.straighten import grey


class Boards(NamedTuple):
    """What was found.

    Attributes:
        views: pairs in which both cameras see the whole board, sharply.
        dropped: the others, and why.
        size: of the pictures: width, height [pixels].
        files: the two pictures of each pair.
    """

    views: tuple[View, ...]
    dropped: tuple[Dropped, ...]
    size: tuple[int, int]
    files: Mapping[str, tuple[Path, Path]]


def find_boards(
    pairs: Paired, board: Chessboard, *, progress: Callable[[int, str], None] = lambda done, name: None
) -> Boards:
    """Find the board in each pair; a damaged picture costs its pair only.

    Args:
        pairs: of picture files.
        board: to be found.
        progress: told how many pairs were looked at, and of the last one's name.

    Raises:
        BadInput: the pictures are not all of one size.
    """
    views: list[View] = []
    blurs: list[float] = []
    dropped = [Dropped(path.name, "it has no partner") for path in pairs.alone]
    size: tuple[int, int] | None = None
    for number, (name, *files) in enumerate(pairs.pairs):
        progress(number, name)
        try:
            pictures = [grey(read_picture(path)) for path in files]
        except BadInput as fault:
            dropped.append(Dropped(name, f"{Path(fault.where).name}: {fault.what}"))
            continue
        for path, picture in zip(files, pictures, strict=True):
            size = size or (picture.shape[1], picture.shape[0])
            if picture.shape != size[::-1]:
                what = f"it has {picture.shape[1]} x {picture.shape[0]} pixels, others {size[0]} x {size[1]}"
                raise BadInput(what, where=str(path), remedy="give pictures of one size")
        left, right = (find_board(picture, board) for picture in pictures)
        if left is None or right is None:
            sides = " and ".join(side for side, seen in (("left", left), ("right", right)) if seen is None)
            dropped.append(Dropped(name, f"no whole board in the {sides} picture"))
            continue
        views.append(View(name, left.corners, same_order(left.corners, right.corners)))
        blurs.append(max(left.blur, right.blur))
    if size is None:
        raise BadInput("no picture can be read", where=str(pairs.pairs[0][1].parent), remedy="give PNG or JPEG files")
    sharp = np.array(blurs) <= OUTLYING * np.median(blurs) if blurs else np.array([], dtype=bool)
    for view, blur, good in zip(views, blurs, sharp, strict=True):
        if not good:
            dropped.append(Dropped(view.name, f"blurred: edges {blur:.1f} px wide (median {np.median(blurs):.1f})"))
    kept = tuple(view for view, good in zip(views, sharp, strict=True) if good)
    return Boards(kept, tuple(dropped), size, {name: (one, other) for name, one, other in pairs.pairs})
