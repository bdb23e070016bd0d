"""Recordings as they are learned from: small enough that many fit into memory, each with its labels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float32, UInt8, UInt16

from toddle.failures import BadInput
from toddle.navigate.cloning.labels import labels_of
from toddle.navigate.cloning.recording import Recording, RoomKey

_MILLIMETRES = 1000.0
_FARTHEST = 60.0  # [m]


class Episode(NamedTuple):
    """A drive to learn from; a row for each look.

    Attributes:
        room: where.
        picture: what was seen.
        depth: [mm]; 0 where it was not known.
        felt: velocity ahead [m/s] and turning [rad/s] that was known when it was decided.
        taught: what the teacher would have asked for: ahead [m/s], turning [rad/s].
        labels: see `labels`.
    """

    room: RoomKey
    picture: UInt8[np.ndarray, "looks 60 80 3"]
    depth: UInt16[np.ndarray, "looks 60 80"]
    felt: Float32[np.ndarray, "looks 2"]
    taught: Float32[np.ndarray, "looks 2"]
    labels: Float32[np.ndarray, "looks labels"]


def episode(recording: Recording) -> Episode:
    """What is learned of a recording.

    Raises:
        BadInput: it holds no look, or a velocity that is not finite.
    """
    where = f"{recording.room.scenario} {recording.room.number}"
    if not len(recording.t):
        raise BadInput("nothing was seen", where=where, remedy="leave it out")
    felt, taught = (part[:, [0, 2]].astype(np.float32) for part in (recording.velocity, recording.taught))
    if not (np.isfinite(felt).all() and np.isfinite(taught).all()):
        raise BadInput("a velocity is not finite", where=where, remedy="leave it out")
    known = np.nan_to_num(recording.depth, nan=0.0, posinf=0.0, neginf=0.0)
    depth = np.rint(_MILLIMETRES * np.clip(known, 0.0, _FARTHEST)).astype(np.uint16)
    return Episode(recording.room, recording.picture, depth, felt, taught, labels_of(recording))


def looks(episodes: Sequence[Episode]) -> int:
    """In all."""
    return sum(len(one.picture) for one in episodes)


def split_by_room(
    episodes: Sequence[Episode], share: float, seed: int
) -> tuple[tuple[Episode, ...], tuple[Episode, ...]]:
    """Episodes to learn from, and episodes to validate on, which share no room with them.

    Rooms of the validation split are validated on; of a training split that has none beside it, a share of its rooms.

    Args:
        episodes: all of them.
        share: of the rooms that are validated on.
        seed: of the draw.

    Raises:
        BadInput: nothing is left to learn from, or a room of the test split is among them.
    """
    if any(one.room.split == "test" for one in episodes):
        raise BadInput("rooms of the test split are not learned from", where="dataset", remedy="leave them out")
    held = {one.room for one in episodes if one.room.split == "validation"}
    if not held and share > 0:
        rooms = sorted({one.room for one in episodes})
        chosen = np.random.default_rng([seed, len(rooms)]).permutation(len(rooms))[: round(share * len(rooms))]
        held = {rooms[number] for number in chosen.tolist()}
    learned = tuple(one for one in episodes if one.room not in held)
    if not learned:
        raise BadInput("no room is left to learn from", where="dataset", remedy="record more rooms")
    return learned, tuple(one for one in episodes if one.room in held)
