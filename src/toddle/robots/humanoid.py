"""A humanoid as the walker sees it: a tree of bodies that floats, soles, servos, and a way of walking.

The arrays of `Tree` are plain numpy, so that compiled kernels take them as they are. The same robot, for a
simulator, is ``spec``; a test holds the two equal.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from toddle.robots.gait import Gait

LEFT, RIGHT = 0, 1
"""Index of a side, in every array that has one row for each foot."""


class Tree(NamedTuple):
    """Rigid bodies joined by hinges, parents before children; body 0 floats freely.

    A configuration is ``q``: position of body 0 [m], its quaternion (w, x, y, z), then the joints [rad] in the order
    of `Humanoid.joints`. A velocity is ``v``: that position's derivative in the world [m/s], the angular velocity in
    body 0's own frame [rad/s], then the joints' speeds. This is MuJoCo's order.

    Attributes:
        parent: index of each body's parent; -1 for body 0.
        position: of each body in its parent, with its joint at zero [m].
        rotation: the same, as a matrix.
        axis: of the hinge, unit vector in the body's own frame; zero where there is none.
        anchor: a point of that axis, in the body's own frame [m].
        joint: index of the hinge among the joints; -1 where there is none.
        mass: of each body [kg].
        centre: of its mass, in its own frame [m].
    """

    parent: Int[np.ndarray, " bodies"]
    position: Float[np.ndarray, "bodies 3"]
    rotation: Float[np.ndarray, "bodies 3 3"]
    axis: Float[np.ndarray, "bodies 3"]
    anchor: Float[np.ndarray, "bodies 3"]
    joint: Int[np.ndarray, " bodies"]
    mass: Float[np.ndarray, " bodies"]
    centre: Float[np.ndarray, "bodies 3"]


class Frame(NamedTuple):
    """A frame fixed to a body of the tree: position [m] and rotation in the body. x is ahead, y left, z up."""

    body: int
    position: Float[np.ndarray, "3"]
    rotation: Float[np.ndarray, "3 3"]


@dataclass(frozen=True)
class Humanoid:
    """A humanoid robot that stands on two flat soles.

    Attributes:
        name: how it is called.
        tree: its bodies.
        joints: names of its servos' joints, in the tree's order.
        lower: limits of the joints [rad].
        upper: limits of the joints [rad].
        effort: greatest torque of each servo [N m].
        stiffness: of each position servo [N m/rad].
        damping: of each position servo [N m s/rad].
        moves: which joints walking moves (legs and torso); the others are held.
        home: a configuration with both soles flat on the floor, knees bent, the centre of mass at the gait's height.
        soles: frames of the left and the right sole: origin on the floor under the ankle.
        waist: frame of the pelvis, whose yaw is the robot's heading.
        chest: frame of the upper torso.
        imu: frame of the inertial unit.
        gait: how it steps.
        spec: MuJoCo's description (an MjSpec), without a floor. It has a free joint ``floating_base``; a hinge and a
            position servo named for each joint, in order; sites left_sole, right_sole, waist, chest, imu; sensors
            left_force, left_torque, right_force, right_torque (at the soles' frames), gyro, accelerometer and
            orientation (at the imu); box geoms left_sole and right_sole; cameras left_eye and right_eye.
            MuJoCo's force and torque sensors tell what the leg does to the sole: `Senses.wrenches` is their negative.
            Contacts: soles have bit 1; shells around the links have conaffinity 2 alone, so that a floor of contype 1
            never touches them and an obstacle of contype 3 does.
        notes: what the description did not say and was inferred, one line each.
    """

    name: str
    tree: Tree
    joints: tuple[str, ...]
    lower: Float[np.ndarray, " joints"]
    upper: Float[np.ndarray, " joints"]
    effort: Float[np.ndarray, " joints"]
    stiffness: Float[np.ndarray, " joints"]
    damping: Float[np.ndarray, " joints"]
    moves: Bool[np.ndarray, " joints"]
    home: Float[np.ndarray, " positions"]
    soles: tuple[Frame, Frame]
    waist: Frame
    chest: Frame
    imu: Frame
    gait: Gait
    spec: Any
    notes: tuple[str, ...] = ()

    @property
    def mass(self) -> float:
        """Of the whole robot [kg]."""
        return float(self.tree.mass.sum())
