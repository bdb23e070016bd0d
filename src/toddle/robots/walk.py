"""From a tree of links to a chain: the walk from base to tip, up to their common ancestor and down again.

A joint walked upwards is the inverse of the same joint walked downwards. Constant transforms between two
moving joints are multiplied together in float64, once, so that a chain holds one product for each axis that
moves.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np

from toddle.failures import BadInput, unknown_name
from toddle.robots.chain import Chain
from toddle.robots.frames import inverse, transform, turning_z_to, z_motion
from toddle.robots.tips import infer_tip
from toddle.robots.tree import Joint, Kind, Motion, Tree


def chain(tree: Tree, *, tip: str | None = None, base: str | None = None, joints: Sequence[str] | None = None) -> Chain:
    """The chain from a base to a tip.

    Args:
        tree: the robot.
        tip: the link whose position is reported; None: inferred, see `tips.infer_tip`.
        base: the link in whose frame it is reported, an ancestor of the tip or not; None: the root, or the
            first link beyond a joint above the tip that can't be used (a floating base).
        joints: names of the actuated joints, in any order (the chain's is base first); the others are held at
            zero, or at the limit nearest to zero where zero is out of range. None: every joint that moves the
            tip.

    Returns:
        The chain. Its home is what the file proposes, else the middle of each joint's range. Its notes tell
        what was inferred.

    Raises:
        BadInput: a name is not there, the tip is ambiguous, nothing moves it, or a joint between the two
            can't be used.
    """
    base, tip, notes = _ends(tree, base, tip, joints)
    path, readings = _path(tree, base, tip), _Readings(tree)
    for i, step in enumerate(path):
        if step.joint.kind is Kind.OTHER:
            raise BadInput(
                f"it lies between base {base!r} and tip {tip!r} and is neither revolute, prismatic nor fixed",
                where=f"{tree.where}: {step.joint.label}",
                remedy=_beyond(tree, path[i:]),
            )
    drives = {s.joint.name: readings.drive(s.joint) for s in path if s.joint.kind is not Kind.FIXED}
    leaders = list(dict.fromkeys(drive.leader for drive in drives.values() if drive.gain))
    movers = [name for name in leaders if not readings.motion(name).still]
    if leaders and not movers:
        raise BadInput(
            f"every joint between {base!r} and {tip!r} has the limits 0 to 0",
            where=f"{tree.where}: {readings.joints[leaders[0]].label}",
            remedy="give them ranges",
        )
    if not movers:
        raise BadInput(
            f"no joint moves {tip!r} with respect to {base!r}",
            where=tree.where,
            remedy="name a base and a tip with a revolute or prismatic joint between them",
        )
    actuated = movers if joints is None else _chosen(readings, movers, joints)
    notes += _range_notes(readings, leaders, actuated)
    return replace(_assemble(readings, path, drives, actuated), notes=tuple(notes))


def _range_notes(readings: _Readings, leaders: Sequence[str], actuated: Sequence[str]) -> list[str]:
    endless = [name for name in actuated if readings.motion(name).endless]
    still = [name for name in leaders if readings.motion(name).still]
    notes = []
    if endless:
        turn = "turns" if len(endless) == 1 else "turn"
        notes.append(f"{', '.join(endless)} {turn} without limits: took half a turn either way")
    if still:
        have = "has" if len(still) == 1 else "have"
        notes.append(f"{', '.join(still)} {have} the limits 0 to 0: held at 0")
    return notes


def _beyond(tree: Tree, path: Sequence[_Step]) -> str:
    """What to name as the base instead, when the path's first joint can't be used."""
    links = [step.joint.child if step.down else step.joint.parent for step in path]
    named = [link for link in links if link not in tree.hidden]
    return f"name a base beyond it, such as {named[0]!r}" if len(named) > 1 else "name another base and tip"


@dataclass(frozen=True)
class _Step:
    """One joint on the way from the base to the tip, walked down from parent to child, or up."""

    joint: Joint
    down: bool


@dataclass(frozen=True)
class _Drive:
    """What sets a joint's value in the end: value = gain * leader's value + offset."""

    leader: str
    gain: float
    offset: float


class _Readings:
    """The numbers of the joints that a chain uses, each read once."""

    def __init__(self, tree: Tree) -> None:
        self.tree = tree
        self.joints = {joint.name: joint for joint in tree.above.values()}
        self._motions: dict[str, Motion] = {}

    def motion(self, name: str) -> Motion:
        if name not in self._motions:
            self._motions[name] = self.joints[name].read()
        return self._motions[name]

    def spot(self, name: str) -> str:
        return f"{self.tree.where}: {self.joints[name].label}"

    def drive(self, joint: Joint) -> _Drive:
        """Follow mimic rules to the joint that is really actuated."""
        drive, seen = _Drive(joint.name, 1.0, 0.0), [joint.name]
        while rule := self.motion(drive.leader).follows:
            spot = self.spot(drive.leader)
            if rule.leader not in self.joints:
                raise unknown_name("joint", rule.leader, self.joints, where=f"{spot}, its mimic")
            if rule.leader in seen:
                ring = " -> ".join([*seen, rule.leader])
                raise BadInput(f"mimic joints go in a circle: {ring}", where=spot, remedy="let one move by itself")
            if self.joints[rule.leader].kind not in (Kind.TURNS, Kind.SLIDES):
                raise BadInput(
                    f"it mimics {rule.leader!r}, which is not a joint of one axis",
                    where=spot,
                    remedy="let it mimic a revolute, continuous or prismatic joint",
                )
            seen.append(rule.leader)
            drive = _Drive(rule.leader, drive.gain * rule.multiplier, drive.gain * rule.offset + drive.offset)
        return drive

    def limits(self, name: str) -> tuple[float, float]:
        limits = self.motion(name).limits
        if limits is None:
            raise BadInput("it has no limits", where=self.spot(name), remedy="give it a lower and an upper limit")
        lower, upper = limits
        if not lower < upper:
            raise BadInput(
                f"its lower limit {lower:g} is not below its upper limit {upper:g}",
                where=self.spot(name),
                remedy="give it a range, or make it a fixed joint",
            )
        return lower, upper

    def held(self, name: str) -> float:
        """Where a joint that is not actuated stays: zero, or the limit nearest to it."""
        if self.motion(name).limits is None or self.motion(name).still:
            return 0.0
        lower, upper = self.limits(name)
        return min(max(0.0, lower), upper)

    def home(self, name: str) -> float:
        lower, upper = self.limits(name)
        home = self.tree.home.get(name, math.nan)
        return home if lower < home < upper else (lower + upper) / 2


def _ends(tree: Tree, base: str | None, tip: str | None, joints: Sequence[str] | None) -> tuple[str, str, list[str]]:
    """The chain's base and tip, inferred where they are not named, and sentences that say so."""
    named = [link for link in tree.links if link not in tree.hidden]
    for link in (base, tip):
        if link is not None and link not in named:
            raise unknown_name("link", link, named, where=tree.where)
    notes = []
    if tip is None:
        tip, note = infer_tip(tree, base or tree.root, joints)
        notes += [note] if note else []
    if base is None:
        base, note = _base_above(tree, tip)
        notes += [note] if note else []
    return base, tip, notes


def _base_above(tree: Tree, tip: str) -> tuple[str, str]:
    """The root, or the first link beyond a joint that floats, where something still moves the tip from there."""
    line = tree.line_to_root(tip)
    for i, link in enumerate(line[:-1]):
        joint = tree.above[link]
        if joint.kind is Kind.OTHER:
            beyond = [place for place in line[: i + 1] if place not in tree.hidden]
            if not any(tree.above[place].kind in (Kind.TURNS, Kind.SLIDES) for place in line[:i]):
                break
            return beyond[-1], f"no base was named: took {beyond[-1]}, for {joint.label} above it can't be commanded"
    return tree.root, ""


def _path(tree: Tree, base: str, tip: str) -> list[_Step]:
    up, down = tree.line_to_root(base), tree.line_to_root(tip)
    while len(up) > 1 and len(down) > 1 and up[-2] == down[-2]:
        up.pop()
        down.pop()
    climbs = [_Step(tree.above[link], down=False) for link in up[:-1]]
    return climbs + [_Step(tree.above[link], down=True) for link in reversed(down[:-1])]


def _chosen(readings: _Readings, movers: list[str], joints: Sequence[str]) -> list[str]:
    """The chosen joints, base first."""
    where, known = readings.tree.where, f"known: {', '.join(movers)}"
    if not joints:
        raise BadInput("the list of joints is empty", where=where, remedy=known)
    for name, count in Counter(joints).items():
        if name not in readings.joints:
            raise unknown_name("joint", name, movers, where=where)
        if count > 1:
            raise BadInput(f"joint {name!r} is named twice", where=where, remedy="name each joint once")
        if name not in movers:
            rule = readings.motion(name).follows
            why = f"follows {rule.leader!r}" if rule else "does not move the tip"
            if readings.motion(name).still:
                why = "has the limits 0 to 0"
            raise BadInput(f"joint {name!r} {why}", where=where, remedy=known)
    return [name for name in movers if name in joints]


def _assemble(readings: _Readings, path: list[_Step], drives: Mapping[str, _Drive], actuated: list[str]) -> Chain:
    """Multiply the constants of the path together, one product before each axis that moves."""
    rigid, still = np.eye(4), np.eye(4)
    before, slides, gains, offsets = [], [], [], []
    carried: list[list[str]] = []
    for step in path:
        motion = readings.motion(step.joint.name)
        enter, leave = (motion.origin, still) if step.down else (still, inverse(motion.origin))
        beyond = step.joint.child if step.down else step.joint.parent
        if step.joint.kind is Kind.FIXED:
            _carry(carried, beyond)
            rigid = rigid @ enter @ leave
            continue
        drive, slide = drives[step.joint.name], step.joint.kind is Kind.SLIDES
        to_axis = transform(turning_z_to(motion.axis), np.zeros(3))
        sign, constant = (1.0 if step.down else -1.0), drive.offset - motion.reference
        rigid = rigid @ enter @ to_axis
        if drive.leader in actuated and drive.gain:
            before.append(rigid)
            slides.append(float(slide))
            gains.append([sign * drive.gain * (name == drive.leader) for name in actuated])
            offsets.append(sign * constant)
            carried.append([beyond])
            rigid = still
        else:
            _carry(carried, beyond)
            held = drive.gain * readings.held(drive.leader) if drive.gain else 0.0
            rigid = rigid @ z_motion(sign * (held + constant), slides=slide)
        rigid = rigid @ to_axis.T @ leave
    limits = np.array([readings.limits(name) for name in actuated])
    return Chain(
        name=readings.tree.name,
        joints=tuple(actuated),
        lower=_stored(limits[:, 0]),
        upper=_stored(limits[:, 1]),
        home=_stored([readings.home(name) for name in actuated]),
        before=_stored(before),
        slides=_stored(slides),
        gain=_stored(gains),
        offset=_stored(offsets),
        tip=_stored(rigid),
        links=tuple(map(tuple, carried)),
    )


def _carry(carried: list[list[str]], link: str) -> None:
    """The last axis carries one more link; before the first axis nothing moves it."""
    if carried:
        carried[-1].append(link)


def _stored(values: Sequence[object] | np.ndarray) -> jnp.ndarray:
    """In single precision, whatever precision JAX is set to: the learning loop's own."""
    return jnp.asarray(np.asarray(values, dtype=np.float32))
