"""Which link is the tip of an arm, where nobody named one: found in the tree's shape and in what links are called.

A place is a link that a moving joint carries rigidly. Fingers are cut off first: what they hang on is the palm,
and only the joints above it are the arm's. Among the places the tip is the one whose name says tool, then hand,
then wrist; among several arms the one with the most joints; of left and right twins the right one. Legs, heads,
wheels and sensors are no tips, and where two arms are left that are no twins, none is taken.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from toddle.failures import BadInput
from toddle.robots.tip_names import LEG, NO_ARM, WHEEL, TipName, is_finger, is_sensor, opens, tip_name, twins, words
from toddle.robots.tree import Joint, Kind, Motion, Tree

_FORK = 4  # joints above a fork, from which on the shorter branches behind it are fingers
_INNER, _AT_LAST = 2, 9  # what a link with others on it, and one that is no tip, loses against names
_SHOWN = 12


class Tip(NamedTuple):
    """A tip that was inferred.

    Attributes:
        link: its name.
        note: a sentence that says so; empty where there was nothing to choose.
    """

    link: str
    note: str = ""


@dataclass(frozen=True)
class _Arm:
    """The best tip on one rigid part: how well its name suits, and which joints move it."""

    link: str
    rank: int
    movers: tuple[str, ...]

    @property
    def said(self) -> bool:
        return self.rank <= TipName.WRIST


def infer_tip(tree: Tree, base: str, joints: Sequence[str] | None = None) -> Tip:
    """The tip of the robot's arm.

    Args:
        tree: the robot.
        base: the chain's base; where joints move beyond it, the tip is sought there.
        joints: names of joints that must move the tip; None: any.

    Raises:
        BadInput: it has no arm, or several that differ in more than left and right.
    """
    ends = [end for end in tree.ends if end != base]
    shape = _Shape(tree, base)
    if len(ends) < 2:
        return _only(shape, ends[0] if ends else base)
    arms = _arms(shape, joints)
    best = [arm for arm in arms if (arm.said, len(arm.movers)) == (arms[0].said, len(arms[0].movers))]
    if len(best) == 1:
        return Tip(best[0].link, _told(best[0].link, best[0].movers))
    sides = twins(best[0].link, best[1].link) if len(best) == 2 else None
    if sides is None:
        raise _refusal(tree, shape, ends, [arm.link for arm in best])
    left, right = sides
    movers = next(arm.movers for arm in best if arm.link == right)
    return Tip(right, _told(right, movers, f" (not its left twin {left})"))


def _told(link: str, movers: Sequence[str], aside: str = "") -> str:
    count = f"{len(movers)} joint{'s' if len(movers) > 1 else ''}"
    return f"no tip was named: took {link}{aside}, moved by {count}; name another with --tip"


class _Shape:
    """The tree below the base (the whole tree, where nothing moves below it), cut where fingers begin."""

    def __init__(self, tree: Tree, base: str) -> None:
        self.tree = tree
        self.motions: dict[str, Motion | None] = {}
        self.joints = {joint.name: joint for joint in tree.above.values()}
        self.below: dict[str, list[Joint]] = defaultdict(list)
        for joint in tree.above.values():
            self.below[joint.parent].append(joint)
        inside = {link for link in tree.links if base in tree.line_to_root(link)}
        if not any(_moves(joint) for joint in tree.above.values() if joint.parent in inside):
            base, inside = tree.root, set(tree.links)
        self.base = base
        self.ways = {link: self._way(link) if link in inside else [] for link in tree.links}
        self.branches: dict[str, dict[str, set[str]]] = defaultdict(lambda: defaultdict(set))
        for way in self.ways.values():
            moving = [joint.name for joint in way if _moves(joint)]
            for i, name in enumerate(moving):
                self.branches[moving[i - 1] if i else ""][name].update(moving[i:])

    def motion(self, name: str) -> Motion | None:
        """A joint's numbers; None where they can't be read, which is the chain's to tell, if it uses them."""
        if name not in self.motions:
            try:
                self.motions[name] = self.joints[name].read()
            except BadInput:
                self.motions[name] = None
        return self.motions[name]

    def movers(self, way: Sequence[Joint]) -> tuple[str, ...]:
        """The joints that move what is at the end of the way, each mimic joint by the one it follows."""
        leaders = [self._leader(joint.name) for joint in way if _moves(joint)]
        return tuple(dict.fromkeys(leader for leader in leaders if leader))

    def _leader(self, name: str) -> str:
        """The joint that sets another's value; none where it follows with nothing, or has no range."""
        seen = {name}
        while (motion := self.motion(name)) is not None and motion.follows is not None:
            if not motion.follows.multiplier or motion.follows.leader in seen:
                return ""
            name = motion.follows.leader
            seen.add(name)
            if name not in self.joints:
                return ""
        return "" if motion is not None and motion.still else name

    def _way(self, link: str) -> list[Joint]:
        """The joints from the base to the link, or from below the last joint that is neither turn nor slide."""
        way: list[Joint] = []
        while link != self.base and link in self.tree.above and self.tree.above[link].kind is not Kind.OTHER:
            way.append(self.tree.above[link])
            link = way[-1].parent
        return way[::-1]

    def stem(self, link: str) -> str:
        """The link itself, or the palm that its fingers hang on."""
        above = ""
        way = self.ways[link]
        for i, joint in enumerate(way):
            if not _moves(joint):
                continue
            if self._is_finger(joint, above, way[:i]):
                return self._named(joint.parent)
            above = joint.name
        return link

    def _named(self, link: str) -> str:
        while link in self.tree.hidden:
            link = self.tree.above[link].parent
        return link

    def _is_finger(self, joint: Joint, above: str, way: Sequence[Joint]) -> bool:
        if opens(joint.name, joint.child):
            return True
        branches, arm = self.branches[above], len(self.movers(way))
        if len(branches) < 2 or arm < _FORK or any(word in NO_ARM for word in words(self._named(joint.parent))):
            return False
        return max(len({self._leader(name) for name in names} - {""}) for names in branches.values()) < arm


def _moves(joint: Joint) -> bool:
    return joint.kind in (Kind.TURNS, Kind.SLIDES)


def _only(shape: _Shape, end: str) -> Tip:
    """The only end, or a site beside it that is called a tool; a gripper's own joint is told, not cut off."""
    palm = shape.stem(end)
    last = _last(shape, palm)
    sites = [
        link
        for link in _leaves(shape)
        if link not in shape.tree.ends and tip_name(link) < TipName.HAND and _last(shape, link) == last
    ]
    if sites and last:
        link = min(sites, key=tip_name)
        return Tip(link, _told(link, shape.movers(shape.ways[link])))
    if palm == end:
        return Tip(end)
    movers, arm = shape.movers(shape.ways[end]), shape.movers(shape.ways[palm])
    extra = ", ".join(name for name in movers if name not in arm)
    if not arm or not extra:
        return Tip(end)
    counts = f"the gripper's joint {extra} counts as the arm's, leave it out with --joints"
    return Tip(end, f"no tip was named: took {end}, the only end; {counts}")


def _leaves(shape: _Shape) -> list[str]:
    return [link for link in shape.tree.links if not shape.below[link] and link not in shape.tree.hidden]


def _last(shape: _Shape, link: str) -> str:
    """The joint that carries the link; empty where none does."""
    return next((joint.name for joint in reversed(shape.ways[link]) if _moves(joint)), "")


def _arms(shape: _Shape, joints: Sequence[str] | None) -> list[_Arm]:
    """The best tip of each part that ends an arm, the best arm first."""
    parts: dict[str, list[str]] = defaultdict(list)
    palms = {link: shape.stem(link) for link in shape.tree.links if link not in shape.tree.hidden}
    for link, palm in palms.items():
        if palm == link and _last(shape, link):
            parts[_last(shape, link)].append(link)
    held = {palm for link, palm in palms.items() if palm != link}
    arms = [arm for links in parts.values() if (arm := _best(shape, links, held)) is not None]
    chosen = [arm for arm in arms if joints is not None and set(joints) <= set(arm.movers)]
    arms = [arm for arm in chosen or arms if not any(_passes(other, arm) for other in chosen or arms)]
    return sorted(arms, key=lambda arm: (not arm.said, -len(arm.movers)))


def _passes(one: _Arm, other: _Arm) -> bool:
    """Whether one goes on where the other stops; a tool's frame is passed by nothing but another."""
    longer = set(other.movers) < set(one.movers)
    return longer and not (other.rank < TipName.HAND <= one.rank)


def _best(shape: _Shape, links: Sequence[str], palms: set[str]) -> _Arm | None:
    """The link of one rigid part that is its tip; None where the part ends no arm."""
    way = shape.ways[links[0]]
    movers = shape.movers(way)
    ranked = [(_rank(shape, link, palms), -len(shape.ways[link]), i, link) for i, link in enumerate(links)]
    rank, _, _, link = min(ranked)
    few = len(movers) < 2 and rank > TipName.WRIST
    if not movers or few or _is_no_arm(shape, link, way, movers):
        return None
    return _Arm(link, rank, movers)


def _rank(shape: _Shape, link: str, palms: set[str]) -> int:
    """How well a link suits as a tip, by its name and its place: less is better."""
    rank, leaf = int(tip_name(link)), link in shape.tree.ends
    if not leaf and not shape.below[link]:  # a site: a mark of anything, if it is not called a tool
        return rank if rank <= TipName.HAND else _AT_LAST
    if is_finger(link) or is_sensor(link):
        return _AT_LAST if leaf or link not in palms else int(TipName.HAND)
    if link in palms:
        return min(max(rank, TipName.HAND), TipName.WRIST)
    return rank if leaf else max(rank, TipName.HAND) + _INNER


def _is_no_arm(shape: _Shape, link: str, way: Sequence[Joint], movers: Sequence[str]) -> bool:
    """Whether it is a leg, a head, a trunk or a wheel, by what its last two joints carry."""
    moving = [joint for joint in way if _moves(joint)]
    said = [word for joint in moving[-2:] for name in (joint.name, joint.child) for word in words(name)]
    said += words(link)
    if any(word in LEG or word in WHEEL for word in said):
        return True
    last = words(moving[-1].name) + words(moving[-1].child) + words(link)
    if any(word in NO_ARM for word in last):
        return True
    motion = shape.motion(moving[-1].name)
    return len(movers) <= 2 and motion is not None and motion.endless and moving[-1].kind is Kind.TURNS


def _refusal(tree: Tree, shape: _Shape, ends: Sequence[str], best: Sequence[str]) -> BadInput:
    """Names the ends, the plausible ones first."""

    def doubt(end: str) -> tuple[bool, int]:
        return is_sensor(end), -len(shape.movers(shape.ways[end]))

    names = list(dict.fromkeys([*best, *sorted(ends, key=doubt)]))
    shown = ", ".join(names[:_SHOWN]) + (", ..." if len(names) > _SHOWN else "")
    return BadInput(
        f"the robot has {len(ends)} ends and no tip was named",
        where=tree.where,
        remedy=f"name one: {shown}",
    )
