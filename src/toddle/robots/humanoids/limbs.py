"""Which parts of a skeleton are legs, pelvis and chest, and which way is ahead.

The feet are the two lowest ends of the tree with the base upright and every joint at zero; the pelvis is where
their chains part; the chest is where the heaviest chain upwards of the pelvis branches or ends. Names that say left
and right give the direction ahead (left cross up); without them the toes do.
"""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput, unknown_name
from toddle.robots.humanoids.skeleton import Skeleton, locate, poses

_LEFT = re.compile(r"(?i:left)|(^|[_\-. ])l([_\-. \d]|$)|^l(?=[A-Z])")
_RIGHT = re.compile(r"(?i:right)|(^|[_\-. ])r([_\-. \d]|$)|^r(?=[A-Z])")
_SAME_HEIGHT = 0.01  # two feet differ by no more [m]
_FEWEST, _MOST = 5, 6  # joints of a leg


class Legs(NamedTuple):
    """Two legs: the link where they part, the links of each from there to the foot, rows left and right."""

    fork: int
    chains: tuple[tuple[int, ...], tuple[int, ...]]

    @property
    def feet(self) -> tuple[int, int]:
        """The links of the left and the right foot."""
        return self.chains[0][-1], self.chains[1][-1]


def find_legs(skeleton: Skeleton, named: tuple[str | None, str | None], where: str) -> tuple[Legs, bool]:
    """The legs, and whether names (or the caller) told left from right.

    Args:
        skeleton: with only links that move.
        named: frames of the left and the right foot, where the caller knows them.
        where: the file, for messages.

    Raises:
        BadInput: no two feet are found.
    """
    if named[0] and named[1]:
        ends = _named(skeleton, named[0], where), _named(skeleton, named[1], where)
        sided = True
    else:
        ends = _lowest(skeleton, where)
        ends, sided = _sided(skeleton, ends)
    left, right = _up(skeleton, ends[0]), _up(skeleton, ends[1])
    fork = next((link for link in left if link in right), 0)
    chains = [tuple(reversed(chain[: chain.index(fork)])) for chain in (left, right)]
    cut = tuple(_foot_last(skeleton, chain) for chain in chains)
    counts = [sum(len(skeleton[link].hinges) for link in chain) for chain in cut]
    if counts[0] != counts[1] or counts[0] < _FEWEST:
        raise BadInput(
            f"its legs have {counts[0]} and {counts[1]} joints",
            where=where,
            remedy="a leg needs five or six: name the feet with left_foot and right_foot",
        )
    return Legs(fork, (cut[0], cut[1])), sided


def _named(skeleton: Skeleton, name: str, where: str) -> int:
    found = locate(skeleton, name)
    if found is None:
        raise unknown_name("frame", name, [frame for link in skeleton for frame in link.frames], where=where)
    return found[0]


def _up(skeleton: Skeleton, link: int) -> list[int]:
    chain = [link]
    while skeleton[chain[-1]].parent >= 0:
        chain.append(skeleton[chain[-1]].parent)
    return chain


def _lowest(skeleton: Skeleton, where: str) -> tuple[int, int]:
    parents = {link.parent for link in skeleton}
    height = [pose[0][2] for pose in poses(skeleton)]
    ends = sorted((link for link in range(1, len(skeleton)) if link not in parents), key=lambda link: height[link])
    if len(ends) < 2 or abs(height[ends[0]] - height[ends[1]]) > _SAME_HEIGHT:
        raise BadInput(
            "two feet at the same height are not found",
            where=where,
            remedy="name them with left_foot and right_foot in a configuration file",
        )
    return ends[0], ends[1]


def _sided(skeleton: Skeleton, ends: tuple[int, int]) -> tuple[tuple[int, int], bool]:
    votes = [_vote(skeleton, end) for end in ends]
    if votes[0] > votes[1]:
        return ends, True
    if votes[0] < votes[1]:
        return (ends[1], ends[0]), True
    return ends, False


def _vote(skeleton: Skeleton, end: int) -> int:
    """Names on the chain that say left, less those that say right."""
    names = [name for link in _up(skeleton, end)[:-1] for name in _names(skeleton, link)]
    return sum(bool(_LEFT.search(name)) - bool(_RIGHT.search(name)) for name in names)


def _names(skeleton: Skeleton, link: int) -> list[str]:
    return [skeleton[link].name, *(hinge.name for hinge in skeleton[link].hinges)]


def _foot_last(skeleton: Skeleton, chain: tuple[int, ...]) -> tuple[int, ...]:
    """A chain without its toes: no longer than a leg's joints."""
    count, kept = 0, []
    for link in chain:
        count += len(skeleton[link].hinges)
        if count > _MOST:
            break
        kept.append(link)
    return tuple(kept)


def ahead(lateral: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """The robot's axes (columns: ahead, left, up) in the base's frame.

    Args:
        lateral: from the right ankle to the left one.
    """
    left = np.array([lateral[0], lateral[1], 0.0])
    left /= np.linalg.norm(left)
    axis = np.zeros(3)
    axis[np.argmax(np.abs(left))] = np.sign(left[np.argmax(np.abs(left))])
    left = axis if axis @ left > np.cos(np.deg2rad(5)) else left
    up = np.array([0.0, 0.0, 1.0])
    return np.column_stack([np.cross(left, up), left, up])


def find_chest(skeleton: Skeleton, legs: Legs) -> int:
    """The link that carries the arms: where the heaviest chain above the pelvis branches or ends."""
    if legs.fork != 0:
        return 0
    weights = [link.mass for link in skeleton]
    for link in range(len(skeleton) - 1, 0, -1):
        weights[skeleton[link].parent] += weights[link]
    walking = {link for chain in legs.chains for link in chain}
    chest = legs.fork
    while True:
        above = [i for i, link in enumerate(skeleton) if link.parent == chest and i not in walking]
        if not above or (chest != legs.fork and len(above) > 1):
            return chest
        heaviest = max(above, key=lambda link: weights[link])
        if len(above) > 1 and weights[heaviest] < 0.5 * sum(weights[link] for link in above):
            return chest
        chest = heaviest
