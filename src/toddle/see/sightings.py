"""Which pairs of pictures show the whole board, sharply, to both cameras."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import UInt8

from toddle.see.calibrate import OUTLYING, Dropped, View
from toddle.see.chessboard import Chessboard, find_board, same_order


class Sighting(NamedTuple):
    """A board that both cameras see.

    Attributes:
        view: its corners.
        blur: of its edges in the worse picture: pixels from dark to bright.
    """

    view: View
    blur: float


def sight(
    name: str, left: UInt8[np.ndarray, "rows columns"], right: UInt8[np.ndarray, "rows columns"], board: Chessboard
) -> Sighting | Dropped:
    """Look for a board in both pictures.

    Args:
        name: of the pair.
        left: grey picture.
        right: grey picture.
        board: to look for.

    Returns:
        What was seen, or why the pair can't be used.
    """
    ours, theirs = find_board(left, board), find_board(right, board)
    if ours is None or theirs is None:
        blind = " and ".join(side for side, seen in (("left", ours), ("right", theirs)) if seen is None)
        return Dropped(name, f"no whole board in the {blind} picture")
    return Sighting(View(name, ours.corners, same_order(ours.corners, theirs.corners)), max(ours.blur, theirs.blur))


def sharp(sightings: Sequence[Sighting]) -> tuple[tuple[View, ...], tuple[Dropped, ...]]:
    """The views whose edges are no wider than 2.5 times the median, and the others."""
    if not sightings:
        return (), ()
    middle = float(np.median([seen.blur for seen in sightings]))
    kept = tuple(seen.view for seen in sightings if seen.blur <= OUTLYING * middle)
    gone = tuple(
        Dropped(seen.view.name, f"blurred: edges {seen.blur:.1f} px wide (median {middle:.1f})")
        for seen in sightings
        if seen.blur > OUTLYING * middle
    )
    return kept, gone
