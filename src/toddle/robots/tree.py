"""A robot as its file describes it: links joined by joints; and the walk from a base to a tip that makes it a chain.

Both readers (URDF, MJCF) end here. The file's structure is known at once; the numbers of a joint are read only when
the chain uses it, so a fault in a part of the robot that does not move the tip never stands in the way.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import jax.numpy as jnp
import numpy as np

from toddle.failures import BadInput, unknown_name
from toddle.robots.chain import Chain
from toddle.robots.frames import Transform, inverse, transform, turning_z_to, z_motion


class Kind(Enum):
    """How a joint lets its child link move."""

    FIXED = "fixed"
    TURNS = "turns"
    SLIDES = "slides"
    OTHER = "other"


@dataclass(frozen=True)
class Follows:
    """A mimic joint's rule: motion = multiplier * leader + offset [rad or m]."""

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
        follows: the rule of a mimic joint.
        reference: the joint's value at which its motion is zero [rad or m].
    """

    origin: Transform
    axis: np.ndarray
    limits: tuple[float, float] | None = None
    follows: Follows | None = None
    reference: float = 0.0


@dataclass(frozen=True)
class Joint:
    """One joint of the tree: what it joins, and a way to read its numbers when they are needed."""

    name: str
    kind: Kind
    parent: str
    child: str
    read: Callable[[], Motion]
    label: str


@dataclass(frozen=True)
class Tree:
    """A robot's links and joints, checked to be one tree.

    Attributes:
        name: the robot's name.
        where: the file, for messages.
        links: every place that may be a base or a tip.
        above: the joint that holds each link; the root has none.
        home: values that the file proposes as a home, by joint [rad or m].
    """

    name: str
    where: str
    links: tuple[str, ...]
    above: Mapping[str, Joint]
    home: Mapping[str, float]

    @property
    def joints(self) -> dict[str, Joint]:
        """Every joint, by name."""
        return {joint.name: joint for joint in self.above.values()}

    def line_to_root(self, link: str) -> list[str]:
        """The link, its parent, its parent's parent, ... up to the root."""
        line = [link]
        while line[-1] in self.above:
            line.append(self.above[line[-1]].parent)
        return line


def plant(name: str, where: str, links: Sequence[str], joints: Sequence[Joint]) -> Tree:
    """Build a tree of links and joints.

    Raises:
        BadInput: a name is used twice, a joint names a link that is not there, a link has two parents, or the links
            are not one tree.
    """
    for kind, names in (("link", links), ("joint", [joint.name for joint in joints])):
        for twice, count in Counter(names).items():
            if count > 1:
                raise BadInput(
                    f"{count} {kind}s are named {twice!r}", where=where, remedy="give each its own name"
                )
    above: dict[str, Joint] = {}
    known = set(links)
    for joint in joints:
        for end, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in known:
                raise unknown_name("link", link, known, where=f"{where}: {joint.label}, its {end}")
        if joint.child in above:
            raise BadInput(
                f"link {joint.child!r} has two parents, by joints {above[joint.child].name!r} and {joint.name!r}: a loop",
                where=where,
                remedy="a chain needs a tree: remove one of the two joints",
            )
        above[joint.child] = joint
    _check_one_tree(above, links, where)
    return Tree(name, where, tuple(links), above, {})


def _check_one_tree(above: Mapping[str, Joint], links: Sequence[str], where: str) -> None:
    roots = [link for link in links if link not in above]
    if len(roots) > 1:
        raise BadInput(
            f"links {roots[0]!r} and {roots[1]!r} are both roots: no joint holds them",
            where=where,
            remedy="join every link but one to a parent",
        )
    reached = set(roots)
    for link in links:
        line: list[str] = []
        while link not in reached:
            if link in line:
                ring = line[line.index(link) :]
                raise BadInput(
                    f"links {' -> '.join(reversed([*ring, link]))} form a loop",
                    where=where,
                    remedy="a chain needs a tree: remove one joint of the loop",
                )
            line.append(link)
            link = above[link].parent
        reached.update(line)


@dataclass(frozen=True)
class _Step:
    """One joint on the way from the base to the tip, walked down from parent to child, or up."""

    joint: Joint
    down: bool


def _path(tree: Tree, base: str, tip: str) -> list[_Step]:
    up, down = tree.line_to_root(base), tree.line_to_root(tip)
    while len(up) > 1 and len(down) > 1 and up[-2] == down[-2]:
        up.pop()
        down.pop()
    climbs = [_Step(tree.above[link], down=False) for link in up[:-1]]
    return climbs + [_Step(tree.above[link], down=True) for link in reversed(down[:-1])]


def _ends(tree: Tree, base: str | None, tip: str | None) -> tuple[str, str]:
    """The chain's base and tip, by the file's own root and only leaf where none are named."""
    for link in (base, tip):
        if link is not None and link not in tree.links:
            raise unknown_name("link", link, tree.links, where=tree.where)
    if base is None:
        base = next(link for link in tree.links if link not in tree.above)
    if tip is None:
        parents = {joint.parent for joint in tree.above.values()}
        leaves = [link for link in tree.links if link not in parents and link != base]
        if len(leaves) > 1:
            shown = ", ".join(leaves[:12]) + (", ..." if len(leaves) > 12 else "")
            raise BadInput(
                f"the robot has {len(leaves)} ends and no tip was named",
                where=tree.where,
                remedy=f"name one as the tip: {shown}",
            )
        tip = leaves[0] if leaves else base
    return base, tip


@dataclass(frozen=True)
class _Drive:
    """What moves an axis in the end: leader's value times gain, plus offset."""

    leader: str
    gain: float
    offset: float


class _Reading:
    """The numbers of the joints that a chain uses, each read once."""

    def __init__(self, tree: Tree) -> None:
        self.tree, self.joints = tree, tree.joints
        self._motions: dict[str, Motion] = {}

    def motion(self, name: str) -> Motion:
        if name not in self._motions:
            self._motions[name] = self.joints[name].read()
        return self._motions[name]

    def drive(self, name: str) -> _Drive:
        """Follow mimic rules to the joint that is really actuated."""
        drive, seen = _Drive(name, 1.0, 0.0), [name]
        while rule := self.motion(drive.leader).follows:
            where = f"{self.tree.where}: {self.joints[drive.leader].label}"
            if rule.leader not in self.joints:
                raise unknown_name("joint", rule.leader, self.joints, where=f"{where}, which mimics it")
            if rule.leader in seen:
                raise BadInput(
                    f"joints {' -> '.join([*seen, rule.leader])} mimic each other in a circle",
                    where=where,
                    remedy="let one of them move by itself",
                )
            if self.joints[rule.leader].kind not in (Kind.TURNS, Kind.SLIDES):
                raise BadInput(
                    f"it mimics {rule.leader!r}, which has no motion of its own",
                    where=where,
                    remedy="name a revolute or prismatic joint",
                )
            seen.append(rule.leader)
            drive = _Drive(rule.leader, drive.gain * rule.multiplier, drive.gain * rule.offset + drive.offset)
        return drive

    def limits(self, name: str) -> tuple[float, float]:
        limits = self.motion(name).limits
        where = f"{self.tree.where}: {self.joints[name].label}"
        if limits is None:
            raise BadInput("it has no limits", where=where, remedy="give it a lower and an upper limit")
        lower, upper = limits
        if not lower < upper:
            raise BadInput(
                f"its lower limit {lower:g} is not below its upper limit {upper:g}",
                where=where,
                remedy="give it a range, or make it a fixed joint",
            )
        return lower, upper


def chain(
    tree: Tree, *, tip: str | None = None, base: str | None = None, joints: Sequence[str] | None = None
) -> Chain:
    """The chain from a base to a tip.

    Args:
        tree: the robot.
        tip: the link whose position is reported; None: the only end of the tree.
        base: the link in whose frame it is reported, an ancestor of the tip or not; None: the root.
        joints: names of the actuated joints; the others are held at zero, or at the limit nearest to zero where zero
            is out of range. None: every joint that moves the tip.

    Raises:
        BadInput: a name is not there, the tip is ambiguous, nothing moves it, or a joint between the two can't be
            used.
    """
    base, tip = _ends(tree, base, tip)
    path, reading = _path(tree, base, tip), _Reading(tree)
    for step in path:
        if step.joint.kind is Kind.OTHER:
            raise BadInput(
                "it lies between base and tip and has more than one axis",
                where=f"{tree.where}: {step.joint.label}",
                remedy="choose a base beyond it, or describe it by revolute and prismatic joints",
            )
    moving = [step for step in path if step.joint.kind is not Kind.FIXED]
    drives = {step.joint.name: reading.drive(step.joint.name) for step in moving}
    movers = list(dict.fromkeys(drive.leader for drive in drives.values() if drive.gain))
    if not movers:
        raise BadInput(
            f"no joint moves {tip!r} with respect to {base!r}",
            where=tree.where,
            remedy="choose a tip that lies beyond a revolute or prismatic joint",
        )
    actuated = _actuated(tree, reading, movers, joints, f"{base!r} to {tip!r}")
    return _assemble(tree, reading, path, drives, actuated)


def _actuated(
    tree: Tree, reading: _Reading, movers: list[str], joints: Sequence[str] | None, span: str
) -> list[str]:
    """The chosen joints, base first."""
    if joints is None:
        return movers
    if not joints:
        raise BadInput("the list of joints is empty", where=tree.where, remedy=f"known: {', '.join(movers)}")
    for name, count in Counter(joints).items():
        if name not in reading.joints:
            raise unknown_name("joint", name, movers, where=tree.where)
        if count > 1:
            raise BadInput(f"joint {name!r} is named twice", where=tree.where, remedy="name each joint once")
        if name not in movers:
            rule = reading.motion(name).follows
            why = f"follows {rule.leader!r}" if rule else f"does not move the tip ({span})"
            raise BadInput(f"joint {name!r} {why}", where=tree.where, remedy=f"known: {', '.join(movers)}")
    return [name for name in movers if name in joints]


def _held(limits: tuple[float, float]) -> float:
    """Where a joint that is not actuated stays: zero, or the limit nearest to it."""
    return min(max(0.0, limits[0]), limits[1])


def _assemble(
    tree: Tree, reading: _Reading, path: list[_Step], drives: Mapping[str, _Drive], actuated: list[str]
) -> Chain:
    """Multiply the constants of the path together, one product before each axis that moves."""
    rigid = np.eye(4)
    before, slides, gains, offsets = [], [], [], []
    for step in path:
        motion = reading.motion(step.joint.name)
        if step.joint.kind is Kind.FIXED:
            rigid = rigid @ (motion.origin if step.down else inverse(motion.origin))
            continue
        drive, slide = drives[step.joint.name], step.joint.kind is Kind.SLIDES
        to_axis = transform(turning_z_to(motion.axis), np.zeros(3))
        rigid = rigid @ (motion.origin if step.down else np.eye(4)) @ to_axis
        sign, still = (1.0 if step.down else -1.0), drive.offset - motion.reference
        if drive.leader in actuated:
            before.append(rigid)
            slides.append(float(slide))
            gains.append([sign * drive.gain * (name == drive.leader) for name in actuated])
            offsets.append(sign * still)
            rigid = np.eye(4)
        else:
            value = drive.gain * _held(reading.limits(drive.leader)) if drive.gain else 0.0
            rigid = rigid @ z_motion(sign * (value + still), slides=slide)
        rigid = rigid @ to_axis.T @ (np.eye(4) if step.down else inverse(motion.origin))
    limits = [reading.limits(name) for name in actuated]
    homes = [_home(tree, name, *limit) for name, limit in zip(actuated, limits, strict=True)]
    lower, upper = zip(*limits, strict=True)

    def stored(values: object) -> jnp.ndarray:
        return jnp.asarray(np.asarray(values, dtype=np.float32))

    return Chain(
        name=tree.name,
        joints=tuple(actuated),
        lower=stored(lower),
        upper=stored(upper),
        home=stored(homes),
        before=stored(before),
        slides=stored(slides),
        gain=stored(gains),
        offset=stored(offsets),
        tip=stored(rigid),
    )


def _home(tree: Tree, name: str, lower: float, upper: float) -> float:
    """The file's own home where it lies inside the limits, else the middle of the range."""
    home = tree.home.get(name, math.nan)
    return home if lower < home < upper else (lower + upper) / 2
