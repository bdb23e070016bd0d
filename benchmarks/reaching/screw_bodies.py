"""The arms that are learned: those of the catalogue, of example-robot-data, and some drawn at random.

A drawn arm is named for what it is: ``random7-2P-1M-g#3`` has seven motors, two of them slide, one drives two axes, its
encoders turn by other amounts than they say and in either direction, and it is the third such arm.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import toddle
from toddle.robots.chain import Chain
from toddle.robots.linkage import Linkage, linkage_of

FILES = {
    "panda": ("panda_description/urdf/panda.urdf", "panda_hand_tcp"),
    "ur5": ("ur_description/urdf/ur5_robot.urdf", "tool0"),
    "xarm7": ("xarm_description/urdf/xarm7.urdf", None),
    "kinova": ("kinova_description/robots/kinova.urdf", "j2s6s200_end_effector"),
    "z1": ("z1_description/urdf/z1.urdf", None),
    "so101": ("so_arm_description/urdf/so101.urdf", "gripper_frame_link"),
    "tiago": ("tiago_description/robots/tiago.urdf", "arm_tool_link"),
    "talos7": ("talos_data/robots/talos_reduced.urdf", "gripper_left_fingertip_1_link"),
    "baxter": ("baxter_description/urdf/baxter.urdf", "left_gripper"),
}
CATALOGUE = ("nicu", "suralp", "icub_arm", "scara", "planar3", "planar:5", "planar:10", "planar:20")
NAMED = (*CATALOGUE, *FILES)
RANDOM = (
    *(f"random{joints}" for joints in range(4, 11)),
    *("random4-1P", "random6-1P", "random7-2P", "random8-2P", "random9-2P"),
)
HARD = ("random4-g", "random5-1M-g", "random6-1P-1M-g", "random7-g", "random7-2P-g", "random7-1P-1M-g", "random8-1P-g")
HELD = {"talos7": tuple(f"arm_left_{number}_joint" for number in range(1, 8))}


@dataclass(frozen=True)
class Arm:
    """A true arm.

    Attributes:
        name: of the arm.
        joints: their names.
        linkage: its constants.
        lower: limits [rad or m].
        upper: limits [rad or m].
        home: where the isolating movements start [rad or m].
        coordinates: which of x, y, z of its tip are seen.
    """

    name: str
    joints: tuple[str, ...]
    linkage: Linkage
    lower: np.ndarray
    upper: np.ndarray
    home: np.ndarray
    coordinates: tuple[int, ...] = (0, 1, 2)


def made(name: str) -> Arm:
    """The arm of a name."""
    return drawn(name) if name.startswith("random") else loaded(name)


def loaded(name: str) -> Arm:
    """An arm of the catalogue or of a file of example-robot-data."""
    path, tip = FILES.get(name, (name, None))
    if name in FILES:
        path = str(Path(sys.prefix, *_DATA, path))
    body = toddle.load(path, tip=tip, joints=HELD.get(name))
    assert isinstance(body, Chain)
    lower, upper, home = (np.asarray(values, float) for values in (body.lower, body.upper, body.home))
    return Arm(name, body.joints, linkage_of(body), lower, upper, home, body.coordinates)


_DATA = (
    "lib",
    f"python{sys.version_info.major}.{sys.version_info.minor}",
    "site-packages",
    "cmeel.prefix",
    "share",
    "example-robot-data",
    "robots",
)


def drawn(name: str) -> Arm:
    """An arm with axes in any direction and links of 5 to 35 cm."""
    found = re.fullmatch(r"random(\d+)(?:-(\d)P)?(?:-(\d)M)?(-g)?(?:#(\d+))?", name)
    assert found is not None, name
    joints, sliding, mimic, number = (int(found[group] or 0) for group in (1, 2, 3, 5))
    rng = np.random.default_rng([joints, sliding, mimic, number])
    slides = np.zeros(joints)
    slides[rng.choice(joints, sliding, replace=False)] = 1.0
    motor = np.arange(joints)
    for _ in range(mimic):
        turning = np.flatnonzero(slides == 0)
        motor = np.insert(motor, rng.integers(0, len(motor) + 1), rng.choice(turning))
    axes = len(motor)
    frames = np.tile(np.eye(4), (axes + 1, 1, 1))
    frames[:, :3, :3] = np.linalg.qr(rng.normal(size=(axes + 1, 3, 3)))[0]
    frames[:, :3, 0] *= np.linalg.det(frames[:, :3, :3])[:, None]
    away = rng.normal(size=(axes + 1, 3))
    frames[:, :3, 3] = away / np.linalg.norm(away, axis=1, keepdims=True) * rng.uniform(0.05, 0.35, (axes + 1, 1))
    own = rng.uniform(0.5, 1.5, joints) * rng.choice([-1, 1], joints) if found[4] else np.ones(joints)
    gain = np.zeros((axes, joints))
    for axis, joint in enumerate(motor):
        second = joint in motor[:axis]
        gain[axis, joint] = own[joint] * (rng.choice([-1, 1]) * rng.uniform(0.5, 1.5) if second else 1.0)
    offset = rng.uniform(-1, 1, axes) * np.where(slides[motor] > 0, 0.2, 1.0) if found[4] else np.zeros(axes)
    half = np.where(slides > 0, rng.uniform(0.15, 0.3, joints), rng.uniform(1.0, 2.8, joints))
    middle = rng.uniform(-0.3, 0.3, joints) * (1 - slides)
    linkage = Linkage(frames[:axes], slides[motor], gain, offset, frames[axes])
    names = tuple(f"joint_{index + 1}" for index in range(joints))
    return Arm(name, names, linkage, middle - half, middle + half, middle)
