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
from toddle.robots.linkage import Linkage, linkage_of
from toddle.robots.markup import parse, read_bytes
from toddle.robots.packages import ICUB_MODEL, ICUB_TIP
from toddle.robots.urdf import chain_of, read_urdf
from toddle.robots.urdf_elements import light_link, numerals, written


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
        linkage: its constants in float64, by which answers are scored.
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
    text = written(robot)
    chain = chain_of(parse(text.encode(), name), name, tip=source.tip, base=None, joints=None)
    lower, upper = np.asarray(chain.lower, float), np.asarray(chain.upper, float)
    return Body(name, text, base, source.tip, chain.joints, linkage_of(chain), lower, upper, source.posed)


def plain(robot: Element, chain: Chain, tip: str, base: str | None) -> tuple[Element, str]:
    """The path to the tip alone, as a URDF, and the link that it starts from."""
    limits = dict(zip(chain.joints, zip(np.asarray(chain.lower), np.asarray(chain.upper), strict=True), strict=True))
    parts, link = [light_link(tip)], tip
    while link != base and (joint := _above(robot, link)) is not None:
        name, parent = joint.attrib["name"], joint.find("parent")
        assert parent is not None, name
        copy = Element("joint", name=name, type=_kind(joint) if name in limits else "fixed")
        copy.extend(part for part in joint if part.tag in ("parent", "child", "origin"))
        if name in limits:
            copy.extend(part for part in joint if part.tag == "axis")
            lower, upper = (numerals(np.array([limit])) for limit in limits[name])
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
