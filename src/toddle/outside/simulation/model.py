"""A chain's arrays, told to MuJoCo: one body an axis, a capsule from each axis to the next, a servo each.

The chain is the only description: nothing is read from a file again. Each axis' frame has the motion along
its own z, so a body stands at ``before[i]`` of its parent with a hinge or a slide about z. An axis that
cannot move (no joint drives it, or its limits coincide) becomes a fixed body. A mimic axis has a servo of its
own, commanded ``gain @ q + offset``.

Mass law: a link weighs ``link_density`` times its length, and never less than 20 g, the least that sits
between two axes that meet in one point. The default gives the upper arm and forearm of a NICU-sized arm about
0.35 and 0.25 kg.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from toddle.failures import BadInput
from toddle.outside.simulation.options import TIMESTEP, PhysicsOptions
from toddle.outside.simulation.servos import tune
from toddle.robots.chain import Chain

_LEAST_MASS = 0.02  # [kg]
_SHORTEST = 1e-4  # a shorter link is a sphere [m]
_STUCK = 1e-9  # an axis with less travel is fixed [rad or m]
_LIMIT_TIME = 2 * TIMESTEP  # the stiffest limit that MuJoCo integrates well [s]


@dataclass(frozen=True)
class ArmModel:
    """The compiled arm and how joint values become servo commands.

    Attributes:
        model: MuJoCo's model, with one degree of freedom and one servo for each moving axis, in the chain's order.
        gain: servo command for a unit of each joint.
        offset: servo command when all joints are zero [rad or m].
    """

    model: mujoco.MjModel
    gain: Float[np.ndarray, "servos joints"]
    offset: Float[np.ndarray, " servos"]


def build(chain: Chain, options: PhysicsOptions) -> ArmModel:
    """The chain as a MuJoCo model with tuned servos.

    Args:
        chain: the arm, with finite limits.
        options: gravity, servos and masses.

    Raises:
        BadInput: a limit or a constant of the chain is not finite, or nothing in it moves.
    """
    arrays = (chain.lower, chain.upper, chain.home, chain.before, chain.gain, chain.offset, chain.tip)
    if not all(np.isfinite(np.asarray(array)).all() for array in arrays):
        raise BadInput("a limit or a length is not finite", where=chain.name, remedy="give every joint finite limits")
    gain, offset = np.asarray(chain.gain, float), np.asarray(chain.offset, float)
    low, high = axis_range(chain)
    moving = high - low > _STUCK
    if not moving.any():
        raise BadInput("no joint of the arm can move", where=chain.name, remedy="check the joints' limits")
    model = _compile(chain, options, low, high, moving)
    tune(model, _postures(low[moving], high[moving]), low[moving], high[moving], options)
    return ArmModel(model, gain[moving], offset[moving])


def axis_range(chain: Chain) -> tuple[Float[np.ndarray, " axes"], Float[np.ndarray, " axes"]]:
    """Least and greatest motion of each axis over the joints' limits [rad or m]."""
    gain, offset = np.asarray(chain.gain, float), np.asarray(chain.offset, float)
    ends = gain * np.asarray(chain.lower, float), gain * np.asarray(chain.upper, float)
    return offset + np.minimum(*ends).sum(axis=1), offset + np.maximum(*ends).sum(axis=1)


def _postures(low: Float[np.ndarray, " servos"], high: Float[np.ndarray, " servos"]) -> np.ndarray:
    """Where the servos' loads are looked at: always the same 128 postures, spread over the arm's range."""
    return np.random.default_rng(0).uniform(low, high, (128, len(low)))


def _compile(
    chain: Chain,
    options: PhysicsOptions,
    low: Float[np.ndarray, " axes"],
    high: Float[np.ndarray, " axes"],
    moving: Bool[np.ndarray, " axes"],
) -> mujoco.MjModel:
    spec = _world(options)
    before, tip, slides = (np.asarray(array, float) for array in (chain.before, chain.tip, chain.slides))
    body = spec.worldbody
    for i, slide in enumerate(slides > 0.5):
        end = before[i + 1] if i + 1 < len(slides) else tip
        pose = before[i] if moving[i] else before[i] @ _fixed(low[i], slide)
        body = body.add_body(
            name=f"link{i}",
            pos=pose[:3, 3],
            quat=_quaternion(pose),
            gravcomp=float(options.gravity_compensation),
        )
        _add_link(body, end[:3, 3], options)
        if moving[i]:
            _add_axis(body, f"axis{i}", bool(slide), (low[i], high[i]), options)
            servo = spec.add_actuator(name=f"servo{i}", target=f"axis{i}", trntype=mujoco.mjtTrn.mjTRN_JOINT)
            servo.set_to_position(kp=1.0, kv=0.0)
    body.add_site(name="tip", pos=tip[:3, 3])
    return spec.compile()


def _world(options: PhysicsOptions) -> Any:
    """An empty world; nothing in it collides, as in the documents' simulators."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.timestep = TIMESTEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.gravity = options.gravity
    # A simulation that breaks must stay broken and be seen, not silently start again from zero.
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return spec


def _add_link(body: Any, end: Float[np.ndarray, "3"], options: PhysicsOptions) -> None:
    """The solid between an axis and the next: a capsule, or a small sphere where the two meet."""
    length = float(np.linalg.norm(end))
    shape: dict[str, Any] = {"type": mujoco.mjtGeom.mjGEOM_SPHERE}
    if length > _SHORTEST:
        shape = {"type": mujoco.mjtGeom.mjGEOM_CAPSULE, "fromto": [0.0, 0.0, 0.0, *end]}
    mass = max(options.link_density * length, _LEAST_MASS)
    body.add_geom(size=[options.link_radius, 0.0, 0.0], mass=mass, contype=0, conaffinity=0, **shape)


def _add_axis(
    body: Any, name: str, slide: bool, travel: tuple[np.floating, np.floating], options: PhysicsOptions
) -> None:
    kind = mujoco.mjtJoint.mjJNT_SLIDE if slide else mujoco.mjtJoint.mjJNT_HINGE
    joint = body.add_joint(name=name, type=kind, axis=[0.0, 0.0, 1.0], limited=True, range=travel)
    joint.armature, joint.frictionloss = options.armature, options.friction
    joint.solref_limit = [_LIMIT_TIME, 1.0]


def _fixed(motion: np.floating, slide: np.bool) -> Float[np.ndarray, "4 4"]:
    pose = np.eye(4)
    if slide:
        pose[2, 3] = motion
    else:
        pose[:2, :2] = [[np.cos(motion), -np.sin(motion)], [np.sin(motion), np.cos(motion)]]
    return pose


def _quaternion(pose: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "4"]:
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(pose[:3, :3]).ravel())
    return quaternion
