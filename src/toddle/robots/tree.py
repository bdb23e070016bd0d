"""A robot as its file describes it: links joined by joints, checked to be one tree.

Every reader (URDF, MJCF) ends here, and `walk.chain` goes on from here. The structure is known at once; the
numbers of a joint are read only when a chain uses it, so a fault elsewhere in the robot never stands in the
way.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from toddle.failures import BadInput, unknown_name
from toddle.robots.frames import Transform


class Kind(Enum):
    """How a joint lets its child link move."""

    FIXED = "fixed"
    TURNS = "turns"
    SLIDES = "slides"
    OTHER = "other"


@dataclass(frozen=True)
class Follows:
    """A mimic joint's rule: value = multiplier * leader's value + offset [rad or m]."""

    leader: str
    multiplier: float
    offset: float


@dataclass(frozen=True)
class Motion:
    """The numbers of one joint.

    Attributes:
        origin: the joint's frame in its parent link, at zero motion [m].
        axis: what it turns about or slides along, in the joint's frame, of length one.
        limits: lower and upper limit [rad or m], or None where the file gives none.
        follows: the rule of a mimic joint; its own limits then do not count, its leader's do.
        reference: the joint's value at which its motion is zero [rad or m].
        endless: whether it turns without limits, those given here are only where its values are sought.
    """

    origin: Transform
    axis: np.ndarray
    limits: tuple[float, float] | None = None
    follows: Follows | None = None
    reference: float = 0.0
    endless: bool = False

    @property
    def still(self) -> bool:
        """Whether its limits are both zero: it stands still, or its file was never filled in."""
        return self.follows is None and self.limits == (0.0, 0.0)


@dataclass(frozen=True)
class Joint:
    """One joint of the tree: what it joins, and a way to read its numbers when they are needed."""

    name: str
    kind: Kind
    parent: str
    child: str
    read: Callable[[], Motion]

    @property
    def label(self) -> str:
        """How messages call it."""
        return f"joint {self.name!r}"


@dataclass(frozen=True)
class Tree:
    """A robot's links and joints.

    Attributes:
        name: the robot's name.
        where: the file, for messages.
        links: every link, the places that may be a base or a tip.
        above: the joint that holds each link; the root has none.
        ends: the links that may be the tip where none is named.
        home: values that the file proposes as a home, by joint [rad or m].
        hidden: links that the file does not name; messages do not offer them.
    """

    name: str
    where: str
    links: tuple[str, ...]
    above: Mapping[str, Joint]
    ends: tuple[str, ...]
    home: Mapping[str, float] = field(default_factory=dict)
    hidden: frozenset[str] = frozenset()

    @property
    def root(self) -> str:
        """The link that no joint holds."""
        return next(link for link in self.links if link not in self.above)

    def line_to_root(self, link: str) -> list[str]:
        """The link, its parent, its parent's parent, ... up to the root."""
        line = [link]
        while line[-1] in self.above:
            line.append(self.above[line[-1]].parent)
        return line


def plant(name: str, where: str, links: Sequence[str], joints: Sequence[Joint]) -> Tree:
    """Build a tree of links and joints.

    Raises:
        BadInput: a name is used twice, a joint names a link that is not there, a link has two parents, or the
            links are not one tree.
    """
    _refuse_twins("link", links, where)
    _refuse_twins("joint", [joint.name for joint in joints], where)
    above: dict[str, Joint] = {}
    known = set(links)
    for joint in joints:
        for end, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in known:
                raise unknown_name("link", link, known, where=f"{where}: {joint.label}, its {end}")
        if joint.child in above:
            both = f"{above[joint.child].name!r} and {joint.name!r}"
            raise BadInput(
                f"link {joint.child!r} has two parents, by joints {both}: a loop",
                where=where,
                remedy="a chain needs a tree: remove one of the two joints",
            )
        above[joint.child] = joint
    _refuse_loops(above, links, where)
    parents = {joint.parent for joint in joints}
    ends = tuple(link for link in links if link not in parents and link in above)
    return Tree(name, where, tuple(links), above, ends)


def _refuse_twins(kind: str, names: Sequence[str], where: str) -> None:
    for name, count in Counter(names).items():
        if count > 1:
            raise BadInput(f"{count} {kind}s are named {name!r}", where=where, remedy="give each its own name")


def _refuse_loops(above: Mapping[str, Joint], links: Sequence[str], where: str) -> None:
    """Climb from every link to a root: a climb that meets itself is a loop, a second root a second tree."""
    roots = [link for link in links if link not in above]
    reached = set(roots)
    for start in links:
        link, line = start, dict[str, None]()
        while link not in reached:
            if link in line:
                climb = list(line)
                ring = [link, *reversed(climb[climb.index(link) :])]
                raise BadInput(
                    f"links {_shortened(ring)} form a loop",
                    where=where,
                    remedy="a chain needs a tree: remove one joint of the loop",
                )
            line[link] = None
            link = above[link].parent
        reached.update(line)
    if len(roots) > 1:
        raise BadInput(
            f"links {roots[0]!r} and {roots[1]!r} are both roots: no joint holds them",
            where=where,
            remedy="join every link but one to a parent",
        )


def _shortened(ring: list[str]) -> str:
    shown = ring if len(ring) <= 8 else [*ring[:4], "...", *ring[-3:]]
    return " -> ".join(shown)
