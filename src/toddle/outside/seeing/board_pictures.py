"""Pairs of picture files, and the boards in them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

from toddle.failures import BadInput
from toddle.outside.seeing.picture_files import Paired, read_picture
from toddle.see.calibrate import Dropped, View
from toddle.see.chessboard import Chessboard
from toddle.see.sightings import Sighting, sharp, sight
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
    sightings: list[Sighting] = []
    dropped = [Dropped(path.name, "it has no partner") for path in pairs.alone]
    size: tuple[int, int] | None = None
    for number, (name, *files) in enumerate(pairs.pairs):
        progress(number, name)
        try:
            left, right = (grey(read_picture(path)) for path in files)
        except BadInput as fault:
            dropped.append(Dropped(name, f"{Path(fault.where).name}: {fault.what}"))
            continue
        size = size or (left.shape[1], left.shape[0])
        for path, picture in zip(files, (left, right), strict=True):
            if picture.shape != size[::-1]:
                what = f"it has {picture.shape[1]} x {picture.shape[0]} pixels, others {size[0]} x {size[1]}"
                raise BadInput(what, where=str(path), remedy="give pictures of one size")
        seen = sight(name, left, right, board)
        if isinstance(seen, Dropped):
            dropped.append(seen)
        else:
            sightings.append(seen)
    if size is None:
        raise BadInput("no picture can be read", where=str(pairs.pairs[0][1].parent), remedy="give PNG or JPEG files")
    views, blurred = sharp(sightings)
    return Boards(views, (*dropped, *blurred), size, {name: (one, other) for name, one, other in pairs.pairs})
