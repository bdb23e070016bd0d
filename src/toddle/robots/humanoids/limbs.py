"""Which parts of a skeleton are legs, pelvis and chest, and which way is ahead.

The feet are the two lowest ends of the tree with the base upright (z up, or y) and every joint at zero; the pelvis
is where their chains part; the chest is where the heaviest chain upwards of the pelvis branches or ends. Names that
say left and right give the direction ahead (left cross up); without them the toes do.
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
_ARM = re.compile(r"(?i)shoulder|elbow|wrist|gripper|hand")
_SAME_HEIGHT = 0.01  # two feet differ by no more [m]
_UPWARD = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0))  # the base's axes that may point up, the usual one first
_FEWEST, _MOST = 5, 6  # joints of a leg
_ALMOST = np.cos(np.deg2rad(5))  # directions this near to an axis are that axis


class Legs(NamedTuple):
    """Two legs: the link where they part, the links of each from there to the foot, rows left and right.

    ``sided`` says that names told left from right.
    """

    fork: int
    chains: tuple[tuple[int, ...], tuple[int, ...]]
    sided: bool

    @property
    def feet(self) -> tuple[int, int]:
        """The links of the left and the right foot."""
        return self.chains[0][-1], self.chains[1][-1]


def find_legs(skeleton: Skeleton, named: tuple[str | None, str | None], where: str) -> Legs:
    """The legs of a skeleton with only links that move.

    Args:
        skeleton: the robot.
        named: frames of the left and the right foot, where the caller knows them.
        where: the file, for messages.

    Raises:
        BadInput: no two feet are found, or a frame is not there.
    """
    if named[0] is not None and named[1] is not None:
        ends = _named(skeleton, named[0], f"{where}: left_foot"), _named(skeleton, named[1], f"{where}: right_foot")
        return _checked(skeleton, _legs(skeleton, ends, sided=True), where)
    if named[0] is not None or named[1] is not None:
        raise BadInput("only one foot is named", where=where, remedy="give both left_foot and right_foot, or neither")
    for up in _UPWARD:
        ends = _lowest(skeleton, np.array(up))
        if ends is None:
            continue
        sided, ends = _sided(skeleton, ends)
        legs = _legs(skeleton, ends, sided=sided)
        if not _arms(skeleton, legs) and min(_joints(skeleton, legs)) >= _FEWEST:
            return _checked(skeleton, legs, where)
    raise BadInput(
        "feet are not found: two limbs of five or six joints that end lowest, at one height",
        where=where,
        remedy="name them with left_foot and right_foot in a configuration file",
    )


def _legs(skeleton: Skeleton, ends: tuple[int, int], *, sided: bool) -> Legs:
    left, right = _up(skeleton, ends[0]), _up(skeleton, ends[1])
    fork = next(link for link in left if link in right)
    chains = [_foot_last(skeleton, tuple(reversed(chain[: chain.index(fork)]))) for chain in (left, right)]
    return Legs(fork, (chains[0], chains[1]), sided)


def _joints(skeleton: Skeleton, legs: Legs) -> tuple[int, int]:
    left, right = (sum(len(skeleton[link].hinges) for link in chain) for chain in legs.chains)
    return left, right


def _arms(skeleton: Skeleton, legs: Legs) -> bool:
    return any(_ARM.search(name) for chain in legs.chains for link in chain for name in _names(skeleton, link))


def _checked(skeleton: Skeleton, legs: Legs, where: str) -> Legs:
    left, right = _joints(skeleton, legs)
    if left != right or left < _FEWEST:
        raise BadInput(
            f"its legs have {left} and {right} joints",
            where=where,
            remedy="each needs five or six hinges: check left_foot, right_foot and the joints' types",
        )
    for chain in legs.chains:
        for link in chain:
            for hinge in skeleton[link].hinges:
                if not hinge.lower < hinge.upper < np.inf or hinge.lower == -np.inf:
                    raise BadInput(
                        f"the leg's joint {hinge.name!r} has no limits", where=where, remedy="give it a range"
                    )
    return legs


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


def _lowest(skeleton: Skeleton, up: Float[np.ndarray, "3"]) -> tuple[int, int] | None:
    parents = {link.parent for link in skeleton}
    height = [float(pose[0] @ up) for pose in poses(skeleton)]
    ends = sorted((link for link in range(1, len(skeleton)) if link not in parents), key=lambda link: height[link])
    if len(ends) < 2 or abs(height[ends[0]] - height[ends[1]]) > _SAME_HEIGHT:
        return None
    return ends[0], ends[1]


def _sided(skeleton: Skeleton, ends: tuple[int, int]) -> tuple[bool, tuple[int, int]]:
    votes = [_vote(skeleton, end) for end in ends]
    if votes[0] == votes[1]:
        return False, ends
    return True, ends if votes[0] > votes[1] else (ends[1], ends[0])


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


def axes_of(lateral: Float[np.ndarray, "3"], upward: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """The robot's axes (columns: ahead, left, up) in the base's frame.

    Args:
        lateral: from the right ankle to the left one.
        upward: from the ankles to the hips.
    """
    up = np.zeros(3)
    steepest = np.argmax(np.abs(upward))
    up[steepest] = np.sign(upward[steepest])
    left = lateral - (lateral @ up) * up
    left = left / np.linalg.norm(left)
    axis = np.zeros(3)
    widest = np.argmax(np.abs(left))
    axis[widest] = np.sign(left[widest])
    left = axis if axis @ left > _ALMOST else left
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
