"""A humanoid's rigid parts as plain numpy: what was read from a file, and what a simulator is told later.

A skeleton is a tuple of links, parents before children; link 0 is the base. Links that no kept hinge moves are
welded to their parents: masses add up, inertias by the parallel axis theorem, and their frames stay known by name.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float, Int

Pose = tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3 3"]]


@dataclass(frozen=True)
class Hinge:
    """A joint that turns: its axis and a point of it in the link's own frame, limits [rad] and torque [N m].

    ``effort`` is 0 where the description gives none; ``reflected`` is the motor's inertia at the joint [kg m^2],
    0 where it gives none.
    """

    name: str
    axis: Float[np.ndarray, "3"]
    anchor: Float[np.ndarray, "3"]
    lower: float
    upper: float
    effort: float = 0.0
    reflected: float = 0.0


@dataclass(frozen=True)
class Shape:
    """A piece of geometry: MuJoCo's type and size, its pose in the link; a mesh has vertices and faces.

    ``solid`` says that the description lets it collide.
    """

    type: int
    size: Float[np.ndarray, "3"]
    position: Float[np.ndarray, "3"]
    rotation: Float[np.ndarray, "3 3"]
    rgba: Float[np.ndarray, "4"]
    solid: bool
    vertices: Float[np.ndarray, "vertices 3"] | None = None
    faces: Int[np.ndarray, "faces 3"] | None = None


@dataclass(frozen=True)
class Link:
    """A rigid body: pose in its parent with the hinges at zero, mass [kg], its centre and inertia about it.

    The inertia [kg m^2] has the axes of the link. ``frames`` are names of places on it: itself, welded links, sites.
    ``others`` are joints that are no hinges, which are held; ``weightless`` says that the description gives a link
    with geometry no mass.
    """

    name: str
    parent: int
    position: Float[np.ndarray, "3"]
    rotation: Float[np.ndarray, "3 3"]
    mass: float
    centre: Float[np.ndarray, "3"]
    inertia: Float[np.ndarray, "3 3"]
    hinges: tuple[Hinge, ...] = ()
    shapes: tuple[Shape, ...] = ()
    frames: Mapping[str, Pose] = field(default_factory=dict)
    others: tuple[str, ...] = ()
    weightless: bool = False


Skeleton = tuple[Link, ...]


def moved(shape: Shape, position: Float[np.ndarray, "3"], rotation: Float[np.ndarray, "3 3"]) -> Shape:
    """The shape seen from a frame in which its link has this pose."""
    return replace(shape, position=position + rotation @ shape.position, rotation=rotation @ shape.rotation)


def weld(skeleton: Skeleton, keep: Collection[str]) -> Skeleton:
    """The skeleton with only some hinges, at zero where they are gone.

    A link that weighs nothing and carries one other is no body of its own: its hinge turns the one it carries.

    Args:
        skeleton: all of it.
        keep: names of the hinges that stay.
    """
    links: list[Link] = []
    place: list[tuple[int, Pose]] = []
    for link in skeleton:
        hinges = tuple(hinge for hinge in link.hinges if hinge.name in keep)
        host, (at, turn) = place[link.parent] if link.parent >= 0 else (-1, (np.zeros(3), np.eye(3)))
        position, rotation = at + turn @ link.position, turn @ link.rotation
        if link.parent < 0 or hinges:
            place.append((len(links), (np.zeros(3), np.eye(3))))
            own = {link.name: (np.zeros(3), np.eye(3)), **link.frames}
            links.append(replace(link, parent=host, position=position, rotation=rotation, hinges=hinges, frames=own))
        else:
            place.append((host, (position, rotation)))
            links[host] = _joined(links[host], link, position, rotation)
    return _without_virtual(tuple(links))


def _without_virtual(links: Skeleton) -> Skeleton:
    """Hinges of links that weigh nothing and carry one other, told of the other."""
    children = [sum(link.parent == number for link in links) for number in range(len(links))]
    virtual = {
        number
        for number, link in enumerate(links)
        if number > 0 and children[number] == 1 and link.mass == 0 and not link.shapes
    }
    kept: list[Link] = []
    place = {-1: -1}
    for number, link in enumerate(links):
        found = link
        while found.parent in virtual:
            found = _carried(links[found.parent], found)
        if number not in virtual:
            place[number] = len(kept)
            kept.append(replace(found, parent=place[found.parent]))
    return tuple(kept)


def _carried(carrier: Link, link: Link) -> Link:
    """The link with its carrier's hinges before its own, on the carrier's parent."""
    back = link.rotation.T
    hinges = tuple(
        replace(hinge, axis=back @ hinge.axis, anchor=back @ (hinge.anchor - link.position)) for hinge in carrier.hinges
    )
    frames = {name: (back @ (at - link.position), back @ turn) for name, (at, turn) in carrier.frames.items()}
    return replace(
        link,
        parent=carrier.parent,
        position=carrier.position + carrier.rotation @ link.position,
        rotation=carrier.rotation @ link.rotation,
        hinges=(*hinges, *link.hinges),
        frames={**frames, **link.frames},
        others=(*carrier.others, *link.others),
    )


def _joined(host: Link, part: Link, position: Float[np.ndarray, "3"], rotation: Float[np.ndarray, "3 3"]) -> Link:
    """One link of two: a part fixed to its host at this pose."""
    frames = {part.name: (position, rotation)}
    frames |= {name: (position + rotation @ at, rotation @ turn) for name, (at, turn) in part.frames.items()}
    mass = host.mass + part.mass
    other = position + rotation @ part.centre
    centre = (host.mass * host.centre + part.mass * other) / mass if mass > 0 else host.centre
    inertia = _about(host.inertia, host.mass, host.centre - centre)
    inertia = inertia + _about(rotation @ part.inertia @ rotation.T, part.mass, other - centre)
    return replace(
        host,
        mass=mass,
        centre=centre,
        inertia=inertia,
        shapes=(*host.shapes, *(moved(shape, position, rotation) for shape in part.shapes)),
        frames={**host.frames, **frames},
        others=(*host.others, *part.others),
    )


def _about(inertia: Float[np.ndarray, "3 3"], mass: float, offset: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Parallel axis theorem: the inertia about a point ``offset`` away from the centre of mass."""
    return inertia + mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))


def hinges(skeleton: Skeleton) -> tuple[Hinge, ...]:
    """Every hinge, in order."""
    return tuple(hinge for link in skeleton for hinge in link.hinges)


def poses(skeleton: Skeleton) -> tuple[Pose, ...]:
    """Every link's pose in the base's frame with all hinges at zero."""
    found: list[Pose] = []
    for link in skeleton:
        if link.parent < 0:
            found.append((np.zeros(3), np.eye(3)))
            continue
        at, turn = found[link.parent]
        found.append((at + turn @ link.position, turn @ link.rotation))
    return tuple(found)


def locate(skeleton: Skeleton, name: str) -> tuple[int, Pose] | None:
    """The link that a frame is fixed to, and its pose there; None where no frame has this name."""
    for index, link in enumerate(skeleton):
        if name in link.frames:
            return index, link.frames[name]
    return None
