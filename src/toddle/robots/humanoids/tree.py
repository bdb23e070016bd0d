"""A skeleton as the plain arrays of `Tree`, in MuJoCo's order of joints.

A link with several hinges (MJCF allows them) becomes as many bodies; only the last of them has mass.
"""

from __future__ import annotations

import numpy as np

from toddle.robots.humanoid import Frame, Tree
from toddle.robots.humanoids.skeleton import Pose, Skeleton


def tree_of(skeleton: Skeleton) -> tuple[Tree, tuple[int, ...]]:
    """The tree, and for each link the body of the tree that carries its mass and its frames."""
    rows: list[tuple[object, ...]] = []
    bodies: list[int] = []
    joint = 0
    for link in skeleton:
        parent = bodies[link.parent] if link.parent >= 0 else -1
        position, rotation = (link.position, link.rotation) if link.parent >= 0 else (np.zeros(3), np.eye(3))
        for number, hinge in enumerate(link.hinges):
            last = number + 1 == len(link.hinges)
            mass, centre = (link.mass, link.centre) if last else (0.0, np.zeros(3))
            rows.append((parent, position, rotation, hinge.axis, hinge.anchor, joint, mass, centre))
            parent, position, rotation, joint = len(rows) - 1, np.zeros(3), np.eye(3), joint + 1
        if not link.hinges:
            rows.append((parent, position, rotation, np.zeros(3), np.zeros(3), -1, link.mass, link.centre))
        bodies.append(len(rows) - 1)
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return Tree(*columns), tuple(bodies)


def frame(bodies: tuple[int, ...], link: int, pose: Pose) -> Frame:
    """A frame of a link, as one of the tree."""
    return Frame(bodies[link], np.array(pose[0]), np.array(pose[1]))
