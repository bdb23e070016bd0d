"""A pair of pictures made ready for stereo: rectified if it is not yet, and what is still off set right.

Features of both pictures tell whether a pair was rectified already: rectified once more, its rows would part. So do the
black edges that rectification leaves, where the cameras were turned far enough to leave any.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, UInt8

from toddle.failures import BadInput
from toddle.geometry.camera import RectifiedCameras
from toddle.see.rectify import Maps, Rectification, maps_from, rectify
from toddle.see.straighten import (
    FEWEST,
    Misalignment,
    both_in_one,
    grey,
    matched,
    misalignment,
    straightening,
)


class Verdict(NamedTuple):
    """Whether a pair was rectified before.

    Attributes:
        rectified: it was; None: the pictures don't tell.
        as_it_is: median distance between the rows of matches in the pair as it is [pixels]; NaN: too few.
        once_more: the same after rectifying it [pixels]; NaN: too few.
        black: how well the black edges are those that rectification leaves: their overlap, 0 to 1; NaN: there are none.
    """

    rectified: bool | None
    as_it_is: float
    once_more: float
    black: float


def was_rectified(
    left: UInt8[np.ndarray, "rows columns *colours"], right: UInt8[np.ndarray, "rows columns *colours"],
    made: Rectification, *, earlier: Rectification | None = None,
) -> Verdict:  # fmt: skip
    """Tell a pair that was rectified from one that was not.

    Args:
        left: picture.
        right: picture.
        made: how the cameras' own pictures are rectified.
        earlier: what it may have been rectified with, whose black edges are looked for; ``made`` unless given.
    """
    as_it_is = _apart(left, right)
    once_more = _apart(rectify(made.left, left), rectify(made.right, right))
    expected = earlier or made
    black = min(_overlap(left, expected.left), _overlap(right, expected.right))
    if np.isfinite(as_it_is) and np.isfinite(once_more):
        return Verdict(bool(as_it_is < once_more), as_it_is, once_more, black)
    return Verdict(None if np.isnan(black) else bool(black > 0.9), as_it_is, once_more, black)


class Ready(NamedTuple):
    """A pair that is ready, and how the next ones become so.

    Attributes:
        left: picture.
        right: picture, its rows the left one's.
        seen: pixels of each that its camera saw.
        cameras: what took them, as it were.
        verdict: whether the pair was rectified before.
        off: what was off in the rectified pair; None: too few things were seen in both pictures.
        straightened: it was set right.
        maps: the look-up of each camera's further pictures; None: they need none.
        trouble: what makes the depth doubtful, in words.
    """

    left: UInt8[np.ndarray, "rows columns *colours"]
    right: UInt8[np.ndarray, "rows columns *colours"]
    seen: tuple[Bool[np.ndarray, "rows columns"], Bool[np.ndarray, "rows columns"]]
    cameras: RectifiedCameras
    verdict: Verdict
    off: Misalignment | None
    straightened: bool
    maps: tuple[Maps | None, Maps | None]
    trouble: tuple[str, ...]


def make_ready(
    left: UInt8[np.ndarray, "rows columns *colours"], right: UInt8[np.ndarray, "rows columns *colours"],
    made: Rectification, *, earlier: Rectification | None = None, rectified: bool | None = None,
    straighten: bool = True,
) -> Ready:  # fmt: skip
    """Rectify a pair unless it is, and set right what is still off.

    Args:
        left: picture.
        right: picture.
        made: how the cameras' own pictures are rectified.
        earlier: what the pair may have been rectified with.
        rectified: whether it was; the pictures tell unless given.
        straighten: set right what is still off.

    Raises:
        BadInput: the pictures don't tell whether they were rectified.
    """
    verdict = was_rectified(left, right, made, earlier=earlier)
    before = verdict.rectified if rectified is None else rectified
    if before is None:
        what = "too little is seen in both pictures to tell whether they are rectified already"
        raise BadInput(what, where="pictures", remedy="say so: --rectified or --no-rectified")
    used, trouble = made, []
    if before:
        used = earlier or made
        if earlier is None:
            trouble.append("the pair was rectified with matrices that the file does not hold: depth may be off")
    maps: tuple[Maps | None, Maps | None] = (None, None) if before else (made.left, made.right)
    seen = (_kept(left, earlier and earlier.left), _kept(right, earlier and earlier.right))
    seen = seen if before else (made.left.valid, made.right.valid)
    pair = (left, right) if before else (rectify(made.left, left), rectify(made.right, right))
    size = (pair[0].shape[1], pair[0].shape[0])
    off = misalignment(matched(grey(pair[0]), grey(pair[1])), size)
    if off is None:
        trouble.append("too little is seen in both pictures to tell whether their rows agree")
    worth = straighten and off is not None and off.worth_it
    if off is not None and worth:
        level = straightening(off, size)
        both = level if maps[1] is None else both_in_one(maps[1], level)
        maps = (maps[0], both)
        straight = rectify(both, right)
        shown = both_in_one(maps_from(level.source, seen[1]), level).valid if before else both.valid
        pair, seen = (pair[0], straight), (seen[0], shown)
    return Ready(pair[0], pair[1], seen, used.cameras, verdict, off, worth, maps, tuple(trouble))


def _kept(picture: UInt8[np.ndarray, "rows columns *colours"], maps: Maps | None) -> Bool[np.ndarray, "rows columns"]:
    """What an earlier rectification left of a picture."""
    lit = grey(picture) > 0
    return lit if maps is None else lit & maps.valid


def _apart(left: np.ndarray, right: np.ndarray) -> float:
    """The median distance between the rows of matches [pixels]."""
    found = matched(grey(left), grey(right), reach=60.0)
    if len(found.left) < FEWEST:
        return float("nan")
    return float(np.median(np.abs(found.right[:, 1] - found.left[:, 1])))


def _overlap(picture: np.ndarray, maps: Maps) -> float:
    """Intersection over union of what is black and what the maps leave black; NaN where neither is anything."""
    black = grey(picture) == 0
    expected = np.any((maps.source <= -1) | (maps.source >= picture.shape[1::-1]), axis=-1)
    either = np.count_nonzero(black | expected)
    return np.count_nonzero(black & expected) / either if either > 0.01 * black.size else float("nan")
