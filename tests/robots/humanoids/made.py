"""A humanoid made to order, as a URDF: box feet, six joints a leg, any axis ahead, any names."""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

AXES = {"x": (1, 0, 0), "-x": (-1, 0, 0), "y": (0, 1, 0), "-y": (0, -1, 0)}


@dataclass(frozen=True)
class Order:
    """What is wanted; lengths [m] before ``scale``."""

    forward: str = "x"
    names: tuple[str, str] = ("left", "right")
    scale: float = 1.0
    hips: float = 0.16
    thigh: float = 0.25
    shank: float = 0.25
    ankle: float = 0.06
    sole: tuple[float, float] = (0.20, 0.10)
    ahead: float = 0.03
    mass: float = 30.0


def rotation(order: Order) -> np.ndarray:
    """Ahead, left, up in the links' frames, as columns."""
    forward = np.array(AXES[order.forward], float)
    up = np.array([0.0, 0.0, 1.0])
    return np.column_stack([forward, np.cross(up, forward), up])


def urdf(order: Order) -> Element:
    """The robot's description."""
    robot = Element("robot", name="made")
    axes, size = rotation(order), order.scale
    _link(robot, "pelvis", 0.3 * order.mass, (0, 0, 0.05 * size), (0.1 * size, 0.2 * size, 0.1 * size), axes)
    _link(robot, "trunk", 0.4 * order.mass, (0, 0, 0.15 * size), (0.1 * size, 0.2 * size, 0.3 * size), axes)
    _joint(robot, "waist_yaw", "pelvis", "trunk", (0, 0, 0.1 * size), (0, 0, 1), (-1.0, 1.0), axes)
    for sign, side in zip((1, -1), order.names, strict=True):
        above, at = "pelvis", (0.0, sign * order.hips * size / 2, 0.0)
        parts = (
            ("hip_yaw", (0, 0, 1), (-1.0, 1.0), 0.0),
            ("hip_roll", (1, 0, 0), (-0.6, 0.6), 0.0),
            ("hip_pitch", (0, 1, 0), (-1.8, 0.6), order.thigh),
            ("knee", (0, 1, 0), (0.0, 2.2), order.shank),
            ("ankle_pitch", (0, 1, 0), (-0.9, 0.9), 0.0),
            ("ankle_roll", (1, 0, 0), (-0.5, 0.5), 0.0),
        )
        for name, axis, limits, length in parts:
            link = f"{side}_{name}_link"
            if name == "ankle_roll":
                middle = (order.ahead * size, 0.0, -order.ankle * size + 0.005)
                _link(robot, link, 0.025 * order.mass, middle, (*(size * s for s in order.sole), 0.01), axes)
            else:
                _link(robot, link, 0.025 * order.mass, (0, 0, -length * size / 2), (0.05 * size,) * 3, axes)
            _joint(robot, f"{side}_{name}", above, link, at, axis, limits, axes)
            above, at = link, (0.0, 0.0, -length * size)
    return robot


def text(robot: Element) -> str:
    """The description as it stands in a file."""
    return ElementTree.tostring(robot, encoding="unicode")


def _link(robot: Element, name: str, mass: float, centre: object, size: tuple[float, ...], axes: np.ndarray) -> None:
    link = SubElement(robot, "link", name=name)
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "origin", xyz=_words(axes @ np.array(centre)))
    SubElement(inertial, "mass", value=str(mass))
    SubElement(inertial, "inertia", **dict.fromkeys(("ixx", "iyy", "izz"), str(0.01 * mass)), ixy="0", ixz="0", iyz="0")
    collision = SubElement(link, "collision")
    SubElement(collision, "origin", xyz=_words(axes @ np.array(centre)))
    SubElement(SubElement(collision, "geometry"), "box", size=_words(np.abs(axes @ np.array(size))))


def _joint(
    robot: Element,
    name: str,
    parent: str,
    child: str,
    at: tuple[float, ...],
    axis: tuple[float, ...],
    limits: tuple[float, float],
    axes: np.ndarray,
) -> None:
    joint = SubElement(robot, "joint", name=name, type="revolute")
    SubElement(joint, "origin", xyz=_words(axes @ np.array(at)))
    SubElement(joint, "axis", xyz=_words(axes @ np.array(axis, float)))
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=child)
    SubElement(joint, "limit", lower=str(limits[0]), upper=str(limits[1]), effort="80", velocity="10")


def _words(numbers: np.ndarray) -> str:
    return " ".join(repr(float(number)) for number in numbers)
