"""A skeleton cut down to what walks and what weighs, and the names of its parts; what can't walk is refused."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput, unknown_name
from toddle.robots.humanoid import LEFT, RIGHT
from toddle.robots.humanoids.limbs import Legs, axes_of, find_chest, find_legs
from toddle.robots.humanoids.settings import Settings
from toddle.robots.humanoids.skeleton import Skeleton, hinges, locate, poses, weld
from toddle.robots.humanoids.soles import sole_of

_LIGHT = 0.01  # a joint besides the legs that carries a smaller share of the mass is welded
_LEAST_MASS = 1e-6  # of a link that moves [kg]
_FORWARD = {"x": (1, 0, 0), "-x": (-1, 0, 0), "y": (0, 1, 0), "-y": (0, -1, 0), "z": (0, 0, 1), "-z": (0, 0, -1)}


@dataclass(frozen=True)
class Anatomy:
    """What was found: legs, chest, the axes ahead, left, up (columns) in the base's frame, the ankles there."""

    legs: Legs
    chest: int
    axes: Float[np.ndarray, "3 3"]
    ankles: Float[np.ndarray, "2 3"]


def trimmed(skeleton: Skeleton, settings: Settings, where: str, notes: list[str]) -> Skeleton:
    """The skeleton with only the joints of legs and torso, and those that carry something.

    Args:
        skeleton: every link of the robot.
        settings: what is known of it.
        where: the file, for messages.
        notes: what is welded is added to them.

    Raises:
        BadInput: it has no legs, or a named joint is not there.
    """
    everything = weld(skeleton, [hinge.name for hinge in hinges(skeleton)])
    known = [hinge.name for hinge in hinges(everything)]
    for key in ("moves", "held", "welded"):
        for name in getattr(settings, key):
            if name not in known:
                raise unknown_name("joint", name, known, where=f"{where}: {key}")
    rest = weld(skeleton, [name for name in known if name not in settings.welded])
    legs = find_legs(rest, (settings.left_foot, settings.right_foot), where)
    _check_hinges(skeleton, [rest[foot].name for foot in legs.feet], rest[legs.fork].name, where)
    needed = {link for chain in legs.chains for link in chain} | _spine(rest, legs)
    weights = [link.mass for link in rest]
    for link in range(len(rest) - 1, 0, -1):
        weights[rest[link].parent] += weights[link]
    keep, light, endless = [], [], []
    for number, part in enumerate(rest):
        heavy = number in needed or weights[number] > _LIGHT * weights[0]
        for hinge in part.hinges:
            if not np.isfinite([hinge.lower, hinge.upper]).all() or hinge.lower >= hinge.upper:
                endless.append(hinge.name)
            elif heavy or hinge.name in settings.held or hinge.name in settings.moves:
                keep.append(hinge.name)
            else:
                light.append(hinge.name)
    others = [name for link in rest for name in link.others]
    for names, why in ((light, f"they carry under {_LIGHT:.0%} of the mass"), (endless, "they have no range")):
        if names:
            notes.append(f"welded at zero, for {why}: {', '.join(names)}")
    if others:
        notes.append(f"welded at zero, for they are no hinges: {', '.join(others)}")
    return weld(skeleton, keep)


def _check_hinges(skeleton: Skeleton, feet: list[str], fork: str, where: str) -> None:
    """Refuses legs with joints that slide or are balls, which were held until here."""
    names = [link.name for link in skeleton]
    for foot in feet:
        link = skeleton[names.index(foot)]
        while link.name != fork and link.parent >= 0:
            if link.others:
                raise BadInput(
                    f"the leg's joint {link.others[0]!r} is no hinge",
                    where=where,
                    remedy="only legs whose joints turn can walk",
                )
            link = skeleton[link.parent]


def _spine(body: Skeleton, legs: Legs) -> set[int]:
    """Links from the pelvis to the chest."""
    link, found = find_chest(body, legs), set()
    for end in (link, legs.fork):
        while end > 0:
            found.add(end)
            end = body[end].parent
    return found


def anatomy_of(body: Skeleton, settings: Settings, where: str, notes: list[str]) -> Anatomy:
    """The parts of a trimmed skeleton.

    Args:
        body: the skeleton.
        settings: what is known of it.
        where: the file, for messages.
        notes: how left was told from right is added to them.

    Raises:
        BadInput: what is said of its forward axis can't be.
    """
    legs = find_legs(body, (settings.left_foot, settings.right_foot), where)
    ankles = np.array([_ankle(body, foot) for foot in legs.feet])
    hips = np.array([poses(body)[chain[0]][0] for chain in legs.chains])
    upward = (hips - ankles).mean(axis=0)
    axes = axes_of(ankles[LEFT] - ankles[RIGHT], upward)
    if not legs.sided and _backward(body, legs, axes, ankles):
        legs, ankles = Legs(legs.fork, (legs.chains[1], legs.chains[0]), sided=False), ankles[::-1]
        axes = axes_of(ankles[LEFT] - ankles[RIGHT], upward)
    if settings.forward is not None:
        if settings.forward not in _FORWARD:
            raise unknown_name("axis", settings.forward, _FORWARD, where=f"{where}: forward")
        given = np.array(_FORWARD[settings.forward], float)
        if given @ axes[:, 0] < 0.9:
            raise BadInput(
                f"{settings.forward} is not ahead: left and right foot would be exchanged",
                where=f"{where}: forward",
                remedy="leave it out, or exchange left_foot and right_foot",
            )
    if not legs.sided:
        notes.append(f"left and right, from the toes: {body[legs.feet[LEFT]].name} is the left foot")
    if sum(len(body[link].hinges) for link in legs.chains[LEFT]) == 5:
        notes.append("its legs have five joints: soles can't be kept flat while the pelvis sways")
    return Anatomy(legs, find_chest(body, legs), axes, ankles)


def _backward(body: Skeleton, legs: Legs, axes: Float[np.ndarray, "3 3"], ankles: Float[np.ndarray, "2 3"]) -> bool:
    """Whether the soles lie behind the ankles."""
    at, turn = poses(body)[legs.feet[LEFT]]
    sole = sole_of(body[legs.feet[LEFT]], turn.T @ (ankles[LEFT] - at), turn.T @ axes)
    return sole is not None and sole[0].ahead < 0


def check_masses(skeleton: Skeleton, body: Skeleton, anatomy: Anatomy, where: str) -> None:
    """Refuses links that move and weigh nothing.

    Args:
        skeleton: every link of the robot.
        body: the same, trimmed.
        anatomy: its parts.
        where: the file, for messages.

    Raises:
        BadInput: there is one, or its numbers are not finite.
    """
    walking = {0, anatomy.chest, *anatomy.legs.chains[LEFT], *anatomy.legs.chains[RIGHT]}
    for link in skeleton:
        host = locate(body, link.name)
        if link.weightless and host is not None and host[0] in walking:
            raise _no_mass(link.name, where)
    for link in body:
        if link.mass < _LEAST_MASS:
            raise _no_mass(link.name, where)
        if not np.isfinite([link.mass, *link.centre, *link.inertia.ravel(), *link.position]).all():
            raise BadInput(
                "its numbers are not finite", where=f"{where}: link {link.name!r}", remedy="mend its inertial"
            )


def _no_mass(link: str, where: str) -> BadInput:
    return BadInput("its mass is 0", where=f"{where}: link {link!r}", remedy="give its inertial a positive mass")


def _ankle(body: Skeleton, foot: int) -> Float[np.ndarray, "3"]:
    """The foot's last axis, in the base's frame."""
    at, turn = poses(body)[foot]
    return at + turn @ body[foot].hinges[-1].anchor
