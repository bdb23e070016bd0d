"""A skeleton told to MuJoCo: floating base, hinges with position servos, sites, sensors, soles and cameras.

Contacts go by two bits. Bit 1: the soles, and whatever they may stand on. Bit 2: `shells`, boxes around the links
that feel an obstacle and nothing else; the floor must leave that bit alone and an obstacle must set it
(``contype=3``). Each sole is a body of its own without mass, so that the sensors in it feel the floor's wrench alone.
MuJoCo gives it as the force that the leg applies to the sole: the floor's is its negative.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import mujoco
import numpy as np
from jaxtyping import Float

from toddle.robots.humanoids.description import quaternion
from toddle.robots.humanoids.skeleton import Hinge, Link, Pose, Shape, Skeleton
from toddle.robots.humanoids.soles import Sole, cloud

TIMESTEP = 0.002  # [s]
SOLE_BIT, SHELL_BIT = 1, 2
SHELL_GROUP, SOLE_GROUP, SHOWN_GROUP = 4, 3, 2  # the first two are hidden unless asked for
EYES_APART = 0.068  # [m] Huber 2019: the stereo cameras of Heicub
FIELD_OF_VIEW = 54.3  # [deg] of 240 rows at 234 pixels, the rectified calibration of the same
_THICKNESS = 0.01  # of a sole [m]
_THIN = 0.03  # a link with no more geometry has no shell [m]


class Place(NamedTuple):
    """A frame on a link of the skeleton."""

    link: int
    pose: Pose


class Places(NamedTuple):
    """Every frame that the walker asks for."""

    soles: tuple[Place, Place]
    waist: Place
    chest: Place
    imu: Place
    eyes: Place


class Servos(NamedTuple):
    """What moves the joints: stiffness [N m/rad], damping [N m s/rad], effort [N m], reflected inertia [kg m^2]."""

    stiffness: Float[np.ndarray, " joints"]
    damping: Float[np.ndarray, " joints"]
    effort: Float[np.ndarray, " joints"]
    reflected: Float[np.ndarray, " joints"]


def describe(name: str, skeleton: Skeleton, places: Places, sole: Sole, servos: Servos) -> Any:
    """MuJoCo's description (an MjSpec) of the robot, without a floor.

    Args:
        name: of the model.
        skeleton: with only the hinges that have servos.
        places: frames of soles, waist, chest, IMU and the point between the eyes.
        sole: size of both soles.
        servos: one for each hinge, in order.
    """
    spec = mujoco.MjSpec()
    spec.modelname = name
    spec.compiler.degree = False
    spec.option.timestep = TIMESTEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    bodies = _bodies(spec, skeleton, servos)
    _servos(spec, skeleton, servos)
    for side, place in zip(("left", "right"), places.soles, strict=True):
        _sole(bodies[place.link], side, place, sole)
    for site, place in (("waist", places.waist), ("chest", places.chest), ("imu", places.imu)):
        bodies[place.link].add_site(name=site, pos=place.pose[0], quat=quaternion(place.pose[1]))
    _sensors(spec)
    _eyes(bodies[places.eyes.link], places.eyes)
    spec.worldbody.add_light(pos=[0.0, 0.0, 4.0], dir=[0.2, 0.2, -1.0], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)
    return spec


def _bodies(spec: Any, skeleton: Skeleton, servos: Servos) -> list[Any]:
    bodies: list[Any] = []
    joint = 0
    for number, link in enumerate(skeleton):
        parent = bodies[link.parent] if link.parent >= 0 else spec.worldbody
        body = parent.add_body(name=link.name, pos=link.position, quat=quaternion(link.rotation))
        if number == 0:
            body.add_freejoint(name="floating_base")
        for hinge in link.hinges:
            _hinge(body, hinge, float(servos.reflected[joint]))
            joint += 1
        _weigh(body, link)
        dressed = any(not shape.solid for shape in link.shapes)
        for place, shape in enumerate(link.shapes):
            hidden = shape.solid and dressed
            _show(spec, body, shape, f"{link.name}_{place}", SOLE_GROUP if hidden else SHOWN_GROUP)
        _shell(body, link)
        bodies.append(body)
    return bodies


def _hinge(body: Any, hinge: Hinge, reflected: float) -> None:
    joint = body.add_joint(name=hinge.name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=hinge.axis, pos=hinge.anchor)
    joint.limited, joint.range = True, [hinge.lower, hinge.upper]
    joint.armature = reflected


def _weigh(body: Any, link: Link) -> None:
    moments, axes = np.linalg.eigh(link.inertia)
    if np.linalg.det(axes) < 0:
        axes[:, 0] = -axes[:, 0]
    body.explicitinertial = True
    body.mass, body.ipos, body.iquat, body.inertia = link.mass, link.centre, quaternion(axes), moments


def _show(spec: Any, body: Any, shape: Shape, name: str, group: int) -> None:
    geom = body.add_geom(
        type=mujoco.mjtGeom(shape.type),
        size=shape.size,
        pos=shape.position,
        quat=quaternion(shape.rotation),
        rgba=shape.rgba,
        contype=0,
        conaffinity=0,
        group=group,
        mass=0.0,
    )
    if shape.vertices is not None:
        shell = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        mesh = spec.add_mesh(name=name, uservert=shape.vertices.ravel(), inertia=shell)
        if shape.faces is not None:
            mesh.userface = shape.faces.ravel()
        geom.meshname = name


def _shell(body: Any, link: Link) -> None:
    """A box around a link's geometry that feels obstacles; the floor and other links never touch it."""
    seen = cloud(link, solid=False)
    if len(seen) == 0:
        return
    low, high = seen.min(axis=0), seen.max(axis=0)
    if (high - low).max() <= _THIN:
        return
    body.add_geom(
        name=f"{link.name}_shell",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=np.maximum((high - low) / 2, 1e-3),
        pos=(high + low) / 2,
        contype=0,
        conaffinity=SHELL_BIT,
        group=SHELL_GROUP,
        mass=0.0,
        rgba=[0.2, 0.4, 0.8, 0.3],
    )


def _servos(spec: Any, skeleton: Skeleton, servos: Servos) -> None:
    hinges = [hinge for link in skeleton for hinge in link.hinges]
    for i, hinge in enumerate(hinges):
        servo = spec.add_actuator(name=hinge.name, target=hinge.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.set_to_position(kp=float(servos.stiffness[i]), kv=float(servos.damping[i]))
        servo.forcelimited, servo.forcerange = True, [-float(servos.effort[i]), float(servos.effort[i])]


def _sole(foot: Any, side: str, place: Place, sole: Sole) -> None:
    body = foot.add_body(name=f"{side}_sole", pos=place.pose[0], quat=quaternion(place.pose[1]))
    body.add_site(name=f"{side}_sole")
    body.add_geom(
        name=f"{side}_sole",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[sole.length / 2, sole.width / 2, _THICKNESS / 2],
        pos=[sole.ahead, 0.0, _THICKNESS / 2],
        contype=SOLE_BIT,
        conaffinity=SOLE_BIT,
        group=SOLE_GROUP,
        mass=0.0,
        rgba=[0.3, 0.3, 0.3, 1.0],
    )


def _sensors(spec: Any) -> None:
    kinds, site = mujoco.mjtSensor, mujoco.mjtObj.mjOBJ_SITE
    for side in ("left", "right"):
        spec.add_sensor(name=f"{side}_force", type=kinds.mjSENS_FORCE, objtype=site, objname=f"{side}_sole")
        spec.add_sensor(name=f"{side}_torque", type=kinds.mjSENS_TORQUE, objtype=site, objname=f"{side}_sole")
    spec.add_sensor(name="gyro", type=kinds.mjSENS_GYRO, objtype=site, objname="imu")
    spec.add_sensor(name="accelerometer", type=kinds.mjSENS_ACCELEROMETER, objtype=site, objname="imu")
    spec.add_sensor(name="orientation", type=kinds.mjSENS_FRAMEQUAT, objtype=site, objname="imu")


def _eyes(body: Any, eyes: Place) -> None:
    """Two cameras beside each other; MuJoCo's look along their own -z with x to the right."""
    position, axes = eyes.pose
    looking = axes @ np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    for name, side in (("left_eye", 0.5), ("right_eye", -0.5)):
        body.add_camera(
            name=name,
            pos=position + side * EYES_APART * axes[:, 1],
            quat=quaternion(looking),
            fovy=FIELD_OF_VIEW,
            resolution=[320, 240],
        )
