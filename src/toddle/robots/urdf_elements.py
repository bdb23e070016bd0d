"""Elements of a URDF as they are written, all digits of their numbers kept.

What they mean is defined at http://wiki.ros.org/urdf/XML/joint.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from jaxtyping import Float

from toddle.robots.frames import Transform


def written(robot: Element) -> str:
    """The text of a robot's root element."""
    ElementTree.indent(robot)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{ElementTree.tostring(robot, encoding="unicode")}\n'


def comment(text: str) -> Element[Any]:
    """A comment; two dashes, which would end it, become one."""
    while "--" in text:
        text = text.replace("--", "-")
    return ElementTree.Comment(f" {text.strip()} ")


def fixed_joint(name: str, parent: str, child: str, origin: Transform) -> Element:
    """A joint that doesn't move."""
    joint = Element("joint", name=name, type="fixed")
    _between(joint, parent, child, origin)
    return joint


def moving_joint(
    name: str,
    parent: str,
    child: str,
    origin: Transform,
    *,
    slides: bool,
    axis: Float[np.ndarray, "3"],
    limits: tuple[float, float],
    mimics: tuple[str, float] | None = None,
) -> Element:
    """A revolute or prismatic joint; ``mimics`` is the joint that it follows, and the multiplier."""
    joint = Element("joint", name=name, type="prismatic" if slides else "revolute")
    _between(joint, parent, child, origin)
    SubElement(joint, "axis", xyz=numerals(axis))
    lower, upper = (numerals(np.array([limit])) for limit in sorted(limits))
    SubElement(joint, "limit", lower=lower, upper=upper, effort="100.0", velocity="10.0")
    if mimics:
        SubElement(joint, "mimic", joint=mimics[0], multiplier=numerals(np.array([mimics[1]])), offset="0.0")
    return joint


def light_link(name: str) -> Element:
    """A link with a small nominal mass, which simulators want of whatever moves."""
    link = Element("link", name=name)
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "mass", value="0.1")
    SubElement(inertial, "inertia", ixx="1e-4", iyy="1e-4", izz="1e-4", ixy="0.0", ixz="0.0", iyz="0.0")
    return link


def origin_element(frame: Transform) -> Element:
    """The ``<origin>`` of a transform."""
    return Element("origin", xyz=numerals(frame[:3, 3]), rpy=numerals(rpy(frame[:3, :3])))


def numerals(values: Float[np.ndarray, " count"]) -> str:
    """Numbers as attributes hold them."""
    return " ".join(repr(float(value) + 0.0) for value in values)


def rpy(turn: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3"]:
    """Roll, pitch and yaw of a rotation [rad]; at a pitch of 90 degrees, too, where any yaw would do."""
    pitch = np.arctan2(-turn[2, 0], np.hypot(turn[0, 0], turn[1, 0]))
    yaw = np.arctan2(turn[1, 0], turn[0, 0])
    s, c = np.sin(yaw), np.cos(yaw)
    roll = np.arctan2(s * turn[0, 2] - c * turn[1, 2], c * turn[1, 1] - s * turn[0, 1])
    return np.array([roll, pitch, yaw])


def fresh_names(taken: set[str]) -> Callable[[str], str]:
    """Makes names, near to those wished for, that are not taken yet."""
    known = set(taken)

    def fresh(wish: str) -> str:
        while wish in known:
            wish += "_"
        known.add(wish)
        return wish

    return fresh


def _between(joint: Element, parent: str, child: str, origin: Transform) -> None:
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=child)
    joint.append(origin_element(origin))
