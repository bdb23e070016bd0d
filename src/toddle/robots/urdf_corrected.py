"""The owner's own URDF with a corrected arm in it: joint origins change, meshes, masses and all the rest are kept.

A chain's constants are products of the file's transforms (`toddle.robots.walk`): an axis' frame in the chain is the
joint's frame turned by ``A``, which brings z onto the joint's ``<axis>``. What a correction does to that frame,
``D = before^-1 before'``, becomes ``origin' = origin A D A'`` at the same joint. What it does to the tip goes to the
last fixed joint on the way, and where there is none, to a new one. A gain that is off becomes a mimic joint on the same
axis that adds the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from xml.etree.ElementTree import Element, SubElement, TreeBuilder

import defusedxml.ElementTree
import numpy as np

from toddle.failures import BadInput
from toddle.robots.frames import Transform, from_rpy, transform, turning_z_to, z_motion
from toddle.robots.linkage import Linkage, linkage_of
from toddle.robots.markup import number, numbers, parse
from toddle.robots.urdf import chain_of
from toddle.robots.urdf_elements import (
    comment,
    fixed_joint,
    fresh_names,
    light_link,
    moving_joint,
    numerals,
    origin_element,
    written,
)
from toddle.robots.urdf_text import SAME_GAIN

_STILL = 1e-12  # a motion smaller than that leaves the file's own digits alone


def corrected_urdf(
    text: bytes,
    where: str,
    linkage: Linkage,
    *,
    tip: str | None = None,
    base: str | None = None,
    joints: Sequence[str] | None = None,
    about: str = "",
) -> str:
    """A URDF with the joints between base and tip moved so that its chain is the corrected one.

    Args:
        text: the file.
        where: its name, for messages.
        linkage: the corrected chain, of the same axes.
        tip: as the chain was read, see `toddle.robots.urdf.read_urdf`.
        base: as the chain was read.
        joints: as the chain was read.
        about: said in a comment at the head: where the changes come from, and how sure they are.

    Raises:
        BadInput: the file can't be used, its base doesn't lie between the root and the tip, or its axes aren't the
            linkage's.
    """
    chain = chain_of(parse(text, where), where, tip=tip, base=base, joints=joints)
    nominal = linkage_of(chain)
    robot = _with_comments(text)
    path = _path(robot, tip, base, where)
    end = _end(path[-1], "child")
    axes = [joint for joint in path if _moves(joint, robot, chain.joints)]
    if nominal.gain.shape != linkage.gain.shape or len(axes) != len(linkage.slides):
        raise BadInput("its axes are not those of the corrected arm", where=where, remedy="name the file that was read")
    link = fresh_names({element.get("name", "") for element in robot.iter("link")})
    name = fresh_names({element.get("name", "") for element in robot.iter("joint")})
    if about:
        robot.insert(0, comment(about))
    for i, joint in enumerate(axes):
        flip = 1.0 if (linkage.gain[i] * nominal.gain[i]).sum() > 0 else -1.0
        slides = bool(linkage.slides[i] > 0)
        spin = z_motion(linkage.offset[i] - flip * nominal.offset[i], slides=slides)
        _move(joint, np.linalg.solve(nominal.before[i], linkage.before[i] @ spin), flip)
        leader = int(np.argmax(np.abs(nominal.gain[i])))
        rest = float(flip * linkage.gain[i, leader] - nominal.gain[i, leader])
        if abs(rest) > SAME_GAIN:
            limits = rest * float(chain.lower[leader]), rest * float(chain.upper[leader])
            wish, rule = f"{joint.get('name')}_gain", (chain.joints[leader], rest)
            ends = _make_room(robot, joint, link(wish))
            ways = {"slides": slides, "axis": _axis(joint), "limits": limits}
            robot.append(moving_joint(name(wish), *ends, np.eye(4), **ways, mimics=rule))
    holder = next(joint for joint in robot.findall("joint") if _end(joint, "child") == end)
    _move_tip(robot, holder, np.linalg.solve(nominal.tip, linkage.tip), link, name)
    return written(robot)


def _with_comments(text: bytes) -> Element:
    """The root element, the file's comments kept; the text was parsed before, so it is XML."""
    parser = defusedxml.ElementTree.DefusedXMLParser(target=TreeBuilder(insert_comments=True), forbid_dtd=True)
    parser.feed(text)
    return parser.close()


def _path(robot: Element, tip: str | None, base: str | None, where: str) -> list[Element]:
    """The joints from base to tip.

    Raises:
        BadInput: the base is not on the way from the root to the tip.
    """
    above = {_end(joint, "child"): joint for joint in robot.findall("joint")}
    parents = {_end(joint, "parent") for joint in above.values()}
    links = [link.get("name", "") for link in robot.findall("link")]
    start = next(link for link in links if link not in above) if base is None else base
    path, link = [], next(link for link in links if link not in parents) if tip is None else tip
    while link != start:
        if link not in above:
            raise BadInput(
                f"base {start!r} is not on the way from the root to the tip",
                where=where,
                remedy="write the learned arm as a file of its own",
            )
        path.insert(0, above[link])
        link = _end(above[link], "parent")
    return path


def _moves(joint: Element, robot: Element, actuated: Sequence[str]) -> bool:
    """Whether a joint is an axis of the chain: one of the actuated, or a mimic of one."""
    while (rule := joint.find("mimic")) is not None and joint.get("type") != "fixed":
        if number(rule, "multiplier", 1.0, "mimic") == 0:
            return False
        joint = next(other for other in robot.findall("joint") if other.get("name") == rule.get("joint"))
    return joint.get("type") != "fixed" and joint.get("name") in actuated


def _move(joint: Element, motion: Transform, flip: float) -> None:
    """Move a joint's origin by a motion in the chain's frame, whose z is the axis; flip the axis."""
    axis = _axis(joint)
    if np.abs(motion - np.eye(4)).max() > _STILL:
        turned = transform(turning_z_to(axis), np.zeros(3))
        _set_origin(joint, _origin(joint) @ turned @ motion @ turned.T)
    if flip < 0:
        element = joint.find("axis")
        element = SubElement(joint, "axis") if element is None else element
        element.set("xyz", numerals(-axis))


def _move_tip(
    robot: Element, last: Element, motion: Transform, link: Callable[[str], str], name: Callable[[str], str]
) -> None:
    """Move the tip in its last link: its fixed joint, or a new one."""
    if np.abs(motion - np.eye(4)).max() <= _STILL:
        return
    if last.get("type") == "fixed":
        _set_origin(last, _origin(last) @ motion)
        return
    wish = f"{_end(last, 'child')}_mount"
    robot.append(fixed_joint(name(wish), *_make_room(robot, last, link(wish)), motion))


def _make_room(robot: Element, joint: Element, link: str) -> tuple[str, str]:
    """Let a joint hold a new link instead of its child; returns both, to be joined."""
    robot.append(light_link(link))
    child = joint.find("child")
    held = _end(joint, "child")
    if child is not None:
        child.set("link", link)
    return link, held


def _end(joint: Element, tag: str) -> str:
    element = joint.find(tag)
    return "" if element is None else element.get("link", "")


def _origin(joint: Element) -> Transform:
    element, zeros = joint.find("origin"), (0.0, 0.0, 0.0)
    if element is None:
        return np.eye(4)
    turn, place = (np.array(numbers(element, key, zeros, "origin")) for key in ("rpy", "xyz"))
    return transform(from_rpy(turn), place)


def _set_origin(joint: Element, frame: Transform) -> None:
    old = joint.find("origin")
    if old is not None:
        joint.remove(old)
    joint.insert(0, origin_element(frame))


def _axis(joint: Element) -> np.ndarray:
    element = joint.find("axis")
    axis = (1.0, 0.0, 0.0) if element is None else numbers(element, "xyz", (1.0, 0.0, 0.0), "axis")
    return np.array(axis) / np.linalg.norm(axis)
