"""URDF files: the kinematics of a robot's description, and nothing else of it.

Meshes, colours and masses are never looked at, so a missing mesh does not matter. What the elements mean is
defined at http://wiki.ros.org/urdf/XML/joint.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from toddle.failures import BadInput, unknown_name
from toddle.robots.chain import Chain
from toddle.robots.frames import Transform, from_rpy, transform
from toddle.robots.markup import number, numbers, parse, read_bytes
from toddle.robots.tree import Follows, Joint, Kind, Motion, plant
from toddle.robots.walk import chain

_KINDS = {
    "fixed": Kind.FIXED,
    "revolute": Kind.TURNS,
    "continuous": Kind.TURNS,
    "prismatic": Kind.SLIDES,
    "planar": Kind.OTHER,
    "floating": Kind.OTHER,
    "ball": Kind.OTHER,
    "spherical": Kind.OTHER,
}


def read_urdf(
    path: Path, *, tip: str | None = None, base: str | None = None, joints: Sequence[str] | None = None
) -> Chain:
    """The chain of a URDF file from a base to a tip.

    Args:
        path: the file.
        tip: the link whose position is reported; None: inferred, see `tips.infer_tip`.
        base: the link in whose frame it is reported; None: the root, or what floats on it.
        joints: names of the actuated joints; None: every joint that moves the tip.

    Raises:
        BadInput: the file can't be used, or a name is not in it.
    """
    return chain_of(parse(read_bytes(path), str(path)), str(path), tip=tip, base=base, joints=joints)


def chain_of(robot: Element, where: str, *, tip: str | None, base: str | None, joints: Sequence[str] | None) -> Chain:
    """The chain of a URDF's root element; see `read_urdf`."""
    if robot.tag != "robot":
        raise BadInput(
            f"its root element is <{robot.tag}>, not <robot>", where=where, remedy="name a URDF or MJCF file"
        )
    links = [_named(link, where) for link in robot.findall("link")]
    if not links:
        raise BadInput("the robot has no link", where=where, remedy="name a URDF file with links and joints")
    found = [_joint(joint, where) for joint in robot.findall("joint")]
    tree = plant(robot.get("name") or Path(where).stem, where, links, found)
    return chain(tree, tip=tip, base=base, joints=joints)


def _named(element: Element, where: str) -> str:
    name = element.get("name")
    if not name:
        raise BadInput(f"a <{element.tag}> has no name", where=where, remedy="give it a name")
    return name


def _joint(element: Element, where: str) -> Joint:
    name = _named(element, where)
    spot = f"{where}: joint {name!r}"
    kind = element.get("type", "")
    if kind not in _KINDS:
        raise unknown_name("joint type", kind, _KINDS, where=spot)

    def end(tag: str) -> str:
        found = element.find(tag)
        link = found.get("link") if found is not None else None
        if not link:
            raise BadInput(f"it has no {tag} link", where=spot, remedy=f'give it <{tag} link="..."/>')
        return link

    return Joint(name, _KINDS[kind], end("parent"), end("child"), lambda: _motion(element, kind, spot))


def _motion(element: Element, kind: str, spot: str) -> Motion:
    return Motion(
        origin=_origin(element, spot),
        axis=_axis(element, spot) if kind != "fixed" else np.array([1.0, 0.0, 0.0]),
        limits=_limits(element, kind, spot),
        follows=_follows(element, spot),
        endless=kind == "continuous",
    )


def _origin(element: Element, spot: str) -> Transform:
    origin = element.find("origin")
    if origin is None:
        return np.eye(4)
    zeros = (0.0, 0.0, 0.0)
    rpy = numbers(origin, "rpy", zeros, f"{spot}, <origin>")
    return transform(from_rpy(np.array(rpy)), np.array(numbers(origin, "xyz", zeros, f"{spot}, <origin>")))


def _axis(element: Element, spot: str) -> np.ndarray:
    found = element.find("axis")
    if found is None:
        return np.array([1.0, 0.0, 0.0])
    axis = np.array(numbers(found, "xyz", (1.0, 0.0, 0.0), f"{spot}, <axis>"))
    largest = float(np.abs(axis).max())
    if largest < 1e-9:
        raise BadInput("its axis has no direction", where=f"{spot}, <axis>", remedy="give it one, such as 0 0 1")
    return axis / largest / np.linalg.norm(axis / largest)


def _limits(element: Element, kind: str, spot: str) -> tuple[float, float] | None:
    if kind == "continuous":
        return -math.pi, math.pi
    limit = element.find("limit")
    if limit is None or (limit.get("lower") is None and limit.get("upper") is None):
        return None
    where = f"{spot}, <limit>"
    return number(limit, "lower", 0.0, where), number(limit, "upper", 0.0, where)  # 0 is the format's default


def _follows(element: Element, spot: str) -> Follows | None:
    mimic = element.find("mimic")
    if mimic is None:
        return None
    leader = mimic.get("joint")
    if not leader:
        raise BadInput("its <mimic> names no joint", where=spot, remedy='write <mimic joint="..."/>')
    where = f"{spot}, <mimic>"
    return Follows(leader, number(mimic, "multiplier", 1.0, where), number(mimic, "offset", 0.0, where))
