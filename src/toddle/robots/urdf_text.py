"""A rigid arm written as a URDF: axes, link offsets, joint zeros, directions and gains, and nothing else of a robot.

Every axis turns about, or slides along, its own z, so a joint's ``<origin>`` is ``before[i] Z(offset_i)`` and its
``<axis>`` is 0 0 1, or 0 0 -1 where it moves the other way. A joint that moves by another amount than it is told is two
joints on the same axis, one after the other: the named one, and a mimic joint that adds the rest,
``gain q = q + (gain - 1) q``. So limits and values stay those of the encoder, and whoever ignores mimic joints is wrong
by that rest only.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.robots.frames import Transform, z_motion
from toddle.robots.linkage import Linkage
from toddle.robots.urdf_elements import comment, fixed_joint, fresh_names, light_link, moving_joint, written

BASE, TIP = "base", "tip"
SAME_GAIN = 1e-9  # a gain nearer to 1 than that is 1
MASSES = "Masses and inertias are nominal, for simulators that want some: a tip's movements do not show them."


class _Motion(NamedTuple):
    """One axis that a joint moves: what is constant before it, which joint, and by how much for a unit of it."""

    origin: Transform
    slides: bool
    joint: int
    gain: float


def urdf_text(
    name: str,
    joints: Sequence[str],
    linkage: Linkage,
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    *,
    about: str = "",
) -> str:
    """A URDF with the linkage's kinematics, from link ``base`` to link ``tip``.

    Args:
        name: the robot's.
        joints: names of the joints, in the order of the gain's columns.
        linkage: the constants.
        lower: lower limits of what the joints are told [rad or m].
        upper: upper limits.
        about: said in a comment at the head: where the numbers come from, and how sure they are.

    Raises:
        BadInput: an axis is moved by several joints, a joint moves no axis, or limits that are none.
    """
    _check(joints, linkage, lower, upper)
    motions, rest = _motions(linkage)
    robot = Element("robot", name=name)
    robot.append(comment(f"{about} {MASSES}"))
    SubElement(SubElement(robot, "mujoco"), "compiler", fusestatic="false")  # MuJoCo keeps the tip as a body
    SubElement(robot, "link", name=BASE)
    link, last = fresh_names({BASE, TIP}), BASE
    for joint in _joints(motions, joints, lower, upper):
        child = link(f"{joint['name']}_link")
        robot.append(light_link(child))
        robot.append(moving_joint(**joint, parent=last, child=child))
        last = child
    SubElement(robot, "link", name=TIP)
    robot.append(fixed_joint(fresh_names(set(joints))("to_tip"), last, TIP, rest))
    return written(robot)


def _check(
    joints: Sequence[str], linkage: Linkage, lower: Float[np.ndarray, " joints"], upper: Float[np.ndarray, " joints"]
) -> None:
    for axis, row in enumerate(linkage.gain):
        if np.count_nonzero(row) > 1:
            names = " and ".join(joints[j] for j in np.flatnonzero(row).tolist())
            raise BadInput(
                f"its axis {axis + 1} is moved by {names}, which no URDF joint can be",
                remedy="export it as ONNX, or write the kinematics yourself",
            )
    for j, name in enumerate(joints):
        if not linkage.gain[:, j].any():
            raise BadInput(f"joint {name!r} moves nothing", remedy="leave it out")
        if not (np.isfinite([lower[j], upper[j]]).all() and lower[j] < upper[j]):
            raise BadInput(f"joint {name!r} has limits {lower[j]:g} and {upper[j]:g}", remedy="give it a range")


def _motions(linkage: Linkage) -> tuple[list[_Motion], Transform]:
    """The axes that move, and what is constant after the last."""
    motions, rigid = [], np.eye(4)
    for before, slides, row, offset in zip(
        linkage.before, linkage.slides > 0, linkage.gain, linkage.offset, strict=True
    ):
        rigid = rigid @ before @ z_motion(offset, slides=bool(slides))
        if row.any():
            joint = int(np.flatnonzero(row)[0])
            motions.append(_Motion(rigid, bool(slides), joint, float(row[joint])))
            rigid = np.eye(4)
    return motions, rigid @ linkage.tip


def _joints(
    motions: Sequence[_Motion],
    names: Sequence[str],
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
) -> Iterator[dict[str, Any]]:
    """The joints to write, base first: each named one once, and what follows it."""
    fresh, told = fresh_names(set(names)), set[int]()
    for origin, slides, joint, gain in motions:
        name, limits = names[joint], np.array([lower[joint], upper[joint]])
        forward = np.array([0.0, 0.0, 1.0])
        if joint in told:
            mimic = {"mimics": (name, gain), "limits": tuple(gain * limits)}
            yield {"name": fresh(f"{name}_follower"), "origin": origin, "slides": slides, "axis": forward, **mimic}
            continue
        told.add(joint)
        axis, rest = np.sign(gain) * forward, abs(gain) - 1
        yield {"name": name, "origin": origin, "slides": slides, "axis": axis, "limits": tuple(limits)}
        if abs(rest) > SAME_GAIN:
            mimic = {"mimics": (name, rest), "limits": tuple(rest * limits)}
            yield {"name": fresh(f"{name}_gain"), "origin": np.eye(4), "slides": slides, "axis": axis, **mimic}
