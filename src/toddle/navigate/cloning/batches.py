"""In which order episodes are learned from, as a value: what comes next follows from it and from nothing else.

Streams go through whole episodes side by side, so that a memory can be carried on; each takes the next episode of a
shuffled pile. Windows are short sequences from anywhere, shuffled, each remembering nothing from before (the
document's way); what lies before the start of an episode is its first look, with no weight, forgotten again.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float32, Int64, UInt8, UInt16

from toddle.navigate.cloning.episodes import Episode


class Order(NamedTuple):
    """Where the reading is.

    Attributes:
        seed: of the shuffling.
        epoch: how often the pile was gone through.
        taken: from the pile so far.
        episode: that each stream is in; of windows: none.
        at: the next look of each.
    """

    seed: Int64[np.ndarray, ""]
    epoch: Int64[np.ndarray, ""]
    taken: Int64[np.ndarray, ""]
    episode: Int64[np.ndarray, " streams"]
    at: Int64[np.ndarray, " streams"]


class Batch(NamedTuple):
    """Looks to learn from.

    Attributes:
        picture: what was seen.
        depth: [mm].
        felt: see `Episode`.
        taught: likewise.
        labels: likewise.
        fresh: an episode begins with it, for the memory.
        weight: how much it counts.
    """

    picture: UInt8[np.ndarray, "streams steps 60 80 3"]
    depth: UInt16[np.ndarray, "streams steps 60 80"]
    felt: Float32[np.ndarray, "streams steps 2"]
    taught: Float32[np.ndarray, "streams steps 2"]
    labels: Float32[np.ndarray, "streams steps labels"]
    fresh: Bool[np.ndarray, "streams steps"]
    weight: Float32[np.ndarray, "streams steps"]


def streams_order(episodes: Sequence[Episode], streams: int, seed: int) -> Order:
    """Each stream begins an episode; the first ones somewhere inside, so that they don't all end together."""
    order = _order(seed)
    numbers, at = np.zeros(streams, np.int64), np.zeros(streams, np.int64)
    inside = np.random.default_rng([seed, 0, 1]).random(streams)
    for stream in range(streams):
        order, number = _next(order, len(episodes))
        numbers[stream], at[stream] = number, int(inside[stream] * len(episodes[number].picture))
    return order._replace(episode=numbers, at=at)


def windows_order(seed: int) -> Order:
    """The start of the first epoch."""
    return _order(seed)


def streams(order: Order, episodes: Sequence[Episode], steps: int) -> tuple[Batch, Order]:
    """The next looks of each stream."""
    numbers, at = order.episode.copy(), order.at.copy()
    rows = []
    for stream in range(len(numbers)):
        pieces, fresh, left = [], np.zeros(steps, bool), steps
        while left:
            one, first = episodes[numbers[stream]], int(at[stream])
            last = min(first + left, len(one.picture))
            fresh[steps - left] = first == 0
            pieces.append((one, slice(first, last)))
            left, at[stream] = left - (last - first), last
            if last == len(one.picture):
                order, numbers[stream] = _next(order, len(episodes))
                at[stream] = 0
        rows.append((pieces, fresh))
    taken = [
        [np.concatenate([one[part][piece] for one, piece in pieces]) for pieces, _ in rows] for part in range(1, 6)
    ]
    fresh = np.stack([fresh for _, fresh in rows])
    return _batch(taken, fresh, np.ones(fresh.shape, np.float32)), order._replace(episode=numbers, at=at)


def windows(order: Order, episodes: Sequence[Episode], count: int, steps: int) -> tuple[Batch, Order]:
    """The next windows; each counts by its last look."""
    ends = np.cumsum([len(one.picture) for one in episodes])
    chosen = []
    for _ in range(count):
        order, look = _next(order, int(ends[-1]))
        number = int(np.searchsorted(ends, look, side="right"))
        chosen.append((episodes[number], look - int(ends[number]) + len(episodes[number].picture)))
    back = np.arange(-steps + 1, 1)
    rows = [(one, np.maximum(at + back, 0)) for one, at in chosen]
    taken = [[one[part][looks] for one, looks in rows] for part in range(1, 6)]
    starts = np.maximum(np.array([steps - 1 - at for _, at in chosen]), 0)
    fresh = np.arange(steps) <= starts[:, None]
    weight = np.broadcast_to(np.arange(steps) == steps - 1, fresh.shape).astype(np.float32)
    return _batch(taken, fresh, weight), order


def _batch(
    taken: Sequence[Sequence[Any]],
    fresh: Bool[np.ndarray, "streams steps"],
    weight: Float32[np.ndarray, "streams steps"],
) -> Batch:
    picture, depth, felt, taught, labels = (np.stack(part) for part in taken)
    return Batch(picture, depth, felt, taught, labels, fresh, weight)


def _order(seed: int) -> Order:
    none = np.zeros(0, np.int64)
    return Order(np.array(seed), np.array(0), np.array(0), none, none)


def _next(order: Order, count: int) -> tuple[Order, int]:
    """The next of a pile that is shuffled anew each time it is empty."""
    epoch, taken = int(order.epoch), int(order.taken)
    if taken >= count:
        epoch, taken = epoch + 1, 0
    number = int(_shuffled(int(order.seed), epoch, count)[taken])
    return order._replace(epoch=np.array(epoch), taken=np.array(taken + 1)), number


@lru_cache(maxsize=4)
def _shuffled(seed: int, epoch: int, count: int) -> Int64[np.ndarray, " count"]:
    return np.random.default_rng([seed, epoch, count]).permutation(count)
