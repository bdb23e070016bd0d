"""What the names of links and joints say of their place on a robot: tool, hand, wrist, finger, leg, head, sensor."""

from __future__ import annotations

import re
from enum import IntEnum
from functools import cache

_WORD = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+")


def _each(text: str) -> frozenset[str]:
    return frozenset(text.split())


LEG = _each("leg foot feet sole toe heel ankle calf shin thigh knee hip haa hfe kfe hock paw")
NO_ARM = _each(
    "head neck eye eyes eyelid gaze jawbone skull torso chest trunk waist pelvis antenna tail mast lidar laser"
)
WHEEL = _each("wheel wheels caster castor roller rotor propeller")
_SENSOR = _each(
    "imu camera cam optical depth rgb rgbd ft force torque sensor skin contact accelerometer gyro gyrometer range "
    "sonar laser lidar led light motor visual collision collisions inertia inertial safety itb ems fsr touch "
    "display marker cover screen parallel antenna calibration"
)
_TURNED = _each("roll pitch yaw pan lift flex rotate rotation swivel wrist")
"""Words of a joint's name that make it one of the arm's, even where it is the gripper's or the hand's."""

_FINGERS = ("finger", "fngr", "thumb", "index", "pinky", "knuckle", "phalanx", "metacarp", "jaw", "claw")
_FINGERS_OF_HANDS = _each("middle medium ring little")
_TOOL = ("tcp", "grasp", "pinch", "tool", "eef", "ee", "effector", "attachment")
_HAND = _each("hand palm gripper grip gripperframe")
_WRIST = _each("wrist flange")


class TipName(IntEnum):
    """How well a name suits a tip, the best first; tools before `HAND` are told apart by `_TOOL`'s order."""

    TOOL = -len(_TOOL)
    HAND = 0
    WRIST = 1
    OTHER = 2


@cache
def words(name: str) -> tuple[str, ...]:
    """The words of a name in small letters: ``RFinger13_link`` is r, finger, 13, link."""
    return tuple(word.lower() for word in _WORD.findall(name))


def is_finger(name: str) -> bool:
    """Whether a link or joint is called a finger, a thumb, a jaw."""
    said = words(name)
    if any(word.startswith(_FINGERS) and word not in NO_ARM for word in said):
        return True
    return "hand" in said and any(word in _FINGERS_OF_HANDS for word in said)


def is_sensor(name: str) -> bool:
    """Whether a link is called a sensor, a mark, a skin; a tool's frame beyond a force sensor is none."""
    said = words(name)
    return any(word in _SENSOR and not (word == "ft" and "tool" in said) for word in said)


def opens(joint: str, child: str) -> bool:
    """Whether a joint moves a finger, by its name and its child link's, and not the whole hand."""
    said = words(joint)
    if any(word in _TURNED for word in said):
        return is_finger(joint)
    return is_finger(joint) or is_finger(child) or any(word.startswith("gripper") for word in said)


def tip_name(link: str) -> int:
    """How well the link's name suits a tip, see `TipName`; less is better."""
    said = words(link)
    for i, tool in enumerate(_TOOL):
        if tool in said or (len(tool) > 2 and any(word.startswith(tool) for word in said)):
            return int(TipName.TOOL) + i
    if any(word in _HAND for word in said):
        return int(TipName.HAND)
    return int(TipName.WRIST) if any(word in _WRIST for word in said) else int(TipName.OTHER)


def twins(one: str, other: str) -> tuple[str, str] | None:
    """The left and the right of two links that are each other's mirror by name; None where they are not."""
    pairs = list(zip(words(one), words(other), strict=False))
    if len(words(one)) != len(words(other)):
        return None
    sides = {_sides(a, b) for a, b in pairs if a != b}
    if sides == {"lr"}:
        return one, other
    return (other, one) if sides == {"rl"} else None


def _sides(a: str, b: str) -> str:
    """``lr`` or ``rl`` where two words differ in left and right alone, else nothing."""
    for left, right in (("left", "right"), ("l", "r")):
        if a.startswith(left) and b.startswith(right) and a[len(left) :] == b[len(right) :]:
            return "lr"
        if a.startswith(right) and b.startswith(left) and a[len(right) :] == b[len(left) :]:
            return "rl"
    return ""
