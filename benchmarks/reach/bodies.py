"""The arms, each as a plain URDF that every solver reads: the file's own joints, axes and origins, and nothing else.

Kept is the path from the base to the tip: other branches, meshes and colours are left out, links get a nominal mass
(MuJoCo wants one), joints that aren't asked for are fixed at zero, and a continuous joint becomes a revolute one with
limits at a half turn. So no solver fails on a mesh, and all of them solve one problem with the same limits.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from toddle.robots.chain import Chain
from toddle.robots.frames import from_rpy, transform, turning_z_to
from toddle.robots.linkage import Linkage
from toddle.robots.markup import numbers, parse, read_bytes
from toddle.robots.packages import ICUB_MODEL, ICUB_TIP
from toddle.robots.urdf import read_urdf
from toddle.robots.urdf_elements import light_link, written


class Source(NamedTuple):
    """Where an arm's numbers come from: a file of example-robot-data, or the iCub's of icub-models.

    Attributes:
        file: under the package's folder; "icub" for the iCub.
        tip: the link that is to reach.
        base: the link that targets are seen from; None: the root.
        joints: those that move; None: all on the path.
        posed: whether a target says how the tip is turned, too.
    """

    file: str
    tip: str
    base: str | None = None
    joints: tuple[str, ...] | None = None
    posed: bool = True


BODIES = {
    "panda": Source("panda_description/urdf/panda.urdf", "panda_hand_tcp"),
    "xarm7": Source("xarm_description/urdf/xarm7.urdf", "link7"),
    "icub_arm": Source("icub", ICUB_TIP, "chest"),
    "talos_arm": Source(
        "talos_data/robots/talos_reduced.urdf",
        "gripper_left_fingertip_1_link",
        joints=tuple(f"arm_left_{number}_joint" for number in range(1, 8)),
    ),
    "tiago": Source("tiago_description/robots/tiago.urdf", "arm_tool_link"),
    "ur5": Source("ur_description/urdf/ur5_robot.urdf", "tool0"),
    "kinova": Source("kinova_description/robots/kinova.urdf", "j2s6s200_end_effector"),
    "so101": Source("so_arm_description/urdf/so101.urdf", "gripper_frame_link", posed=False),
}


@dataclass(frozen=True)
class Body:
    """An arm as all solvers get it.

    Attributes:
        name: of the arm.
        text: its URDF.
        base, tip: links at its two ends.
        joints: those that move, base first.
        linkage: its constants, by which targets are made and answers scored.
        lower, upper: limits [rad or m].
        posed: whether targets say how the tip is turned.
    """

    name: str
    text: str
    base: str
    tip: str
    joints: tuple[str, ...]
    linkage: Linkage
    lower: np.ndarray
    upper: np.ndarray
    posed: bool


def body(name: str) -> Body:
    """An arm by its name in `BODIES`."""
    source = BODIES[name]
    path = _icub() if source.file == "icub" else Path(sys.prefix, *_DATA, source.file)
    whole = read_urdf(path, tip=source.tip, base=source.base, joints=source.joints)
    robot, base = plain(parse(read_bytes(path), str(path)), whole, source.tip, source.base)
    moving = [joint for joint in robot.iter("joint") if joint.get("type") != "fixed"]
    limits = np.array([[float(limit.attrib[end]) for end in ("lower", "upper")] for limit in robot.iter("limit")])
    names = tuple(joint.attrib["name"] for joint in moving)
    return Body(
        name, written(robot), base, source.tip, names, constants(robot), limits[:, 0], limits[:, 1], source.posed
    )


def constants(robot: Element) -> Linkage:
    """The constants of a plain arm in double precision; a `Chain` has them in single, too coarse for exact solvers."""
    frame, before, slides = np.eye(4), [], []
    for joint in robot.iter("joint"):
        origin = joint.find("origin")
        if origin is not None:
            frame = frame @ transform(
                from_rpy(_three(origin, "rpy", (0.0, 0.0, 0.0))), _three(origin, "xyz", (0.0, 0.0, 0.0))
            )
        if joint.get("type") == "fixed":
            continue
        axis = joint.find("axis")
        along = np.array([1.0, 0.0, 0.0]) if axis is None else _three(axis, "xyz", (1.0, 0.0, 0.0))
        tilt = transform(turning_z_to(along), np.zeros(3))
        before.append(frame @ tilt)
        slides.append(float(joint.get("type") == "prismatic"))
        frame = tilt.T
    return Linkage(np.array(before), np.array(slides), np.eye(len(before)), np.zeros(len(before)), frame)


def _three(element: Element, attribute: str, default: tuple[float, ...]) -> np.ndarray:
    return np.array(numbers(element, attribute, default, ""), float)


def plain(robot: Element, chain: Chain, tip: str, base: str | None) -> tuple[Element, str]:
    """The path to the tip alone, as a URDF, and the link that it starts from."""
    moved = set(chain.joints)
    parts, link = [light_link(tip)], tip
    while link != base and (joint := _above(robot, link)) is not None:
        name, parent = joint.attrib["name"], joint.find("parent")
        assert parent is not None, name
        copy = Element("joint", name=name, type=_kind(joint) if name in moved else "fixed")
        copy.extend(part for part in joint if part.tag in ("parent", "child", "origin"))
        if name in moved:
            copy.extend(part for part in joint if part.tag == "axis")
            lower, upper = _limits(joint)
            SubElement(copy, "limit", lower=lower, upper=upper, effort="100.0", velocity="10.0")
        link = parent.attrib["link"]
        parts += [copy, light_link(link)]
    alone = Element("robot", name=chain.name)
    alone.extend(reversed(parts))
    return alone, link


def _above(robot: Element, link: str) -> Element | None:
    for joint in robot.findall("joint"):
        child = joint.find("child")
        if child is not None and child.get("link") == link:
            return joint
    return None


def _limits(joint: Element) -> tuple[str, str]:
    limit = joint.find("limit")
    if joint.get("type") == "continuous" or limit is None:
        return repr(-np.pi), repr(np.pi)
    return limit.attrib["lower"], limit.attrib["upper"]


def _kind(joint: Element) -> str:
    return "prismatic" if joint.get("type") == "prismatic" else "revolute"


def _icub() -> Path:
    import icub_models

    return Path(icub_models.get_model_file(ICUB_MODEL))


_DATA = (
    "lib",
    f"python{sys.version_info.major}.{sys.version_info.minor}",
    "site-packages",
    "cmeel.prefix",
    "share",
    "example-robot-data",
    "robots",
)
