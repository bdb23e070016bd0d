"""The world around a humanoid, told to MuJoCo: floor, bumps, obstacles, light, and the errors of its masses.

Who collides with whom is said by two bits, as in `toddle.robots.humanoids.physics`: floor and bumps carry the soles,
an obstacle stops soles and shells.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.outside.simulation.disturbances import TIMESTEP, WorldOptions
from toddle.robots.humanoid import Humanoid

GRAVITY = 9.81  # [m/s^2]
SOLES = ("left_sole", "right_sole")
OBSTACLE = "obstacle{}"
_GROUND, OBSTACLE_BIT = 1, 2  # bits of what collides
_TALL = 1.5  # of an obstacle [m]
_START = 0.3  # no bump lies nearer to the start [m]


def build(humanoid: Humanoid, options: WorldOptions, furnish: Callable[[Any], None] | None = None) -> mujoco.MjModel:
    """The humanoid on its floor, among the obstacles.

    Args:
        humanoid: its ``spec`` is copied, not changed.
        options: the world.
        furnish: adds to the description (an MjSpec) what else there is; what is to be touched has contype 3.

    Raises:
        BadInput: the description lacks something that a humanoid's must have.
    """
    spec = humanoid.spec.copy()
    if spec.joint("floating_base") is None:
        raise BadInput("there is no joint floating_base", where=humanoid.name, remedy="give it a free joint")
    for name in SOLES:
        if spec.geom(name) is None:
            raise BadInput(f"there is no geom {name}", where=humanoid.name, remedy="give each foot a box sole")
    spec.option.timestep = TIMESTEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.gravity = gravity(options)
    # A simulation that breaks must stay broken and be seen, not silently start again from zero.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    _scenery(spec)
    _floor(spec, options)
    _bumps(spec, options, np.random.default_rng([options.seed, 0]))
    _obstacles(spec, options)
    _slow_servos(spec, options)
    if furnish is not None:
        furnish(spec)
    return spec.compile()


def disturb_masses(model: mujoco.MjModel, options: WorldOptions) -> None:
    """Makes every body heavier or lighter than it was said to be, inertia included; the model changes in place."""
    if options.mass_error == 0:
        return
    draw = np.random.default_rng([options.seed, 3])
    scale = draw.uniform(1 - options.mass_error, 1 + options.mass_error, model.nbody)
    model.body_mass[:] *= scale
    model.body_inertia[:] *= scale[:, None]
    mujoco.mj_setConst(model, mujoco.MjData(model))


def gravity(options: WorldOptions) -> Float[np.ndarray, "3"]:
    """Gravity seen from the floor, which falls off towards ``downhill_deg`` [m/s^2]."""
    tilt, towards = math.radians(options.tilt_deg), math.radians(options.downhill_deg)
    ahead = math.sin(tilt)
    return GRAVITY * np.array([ahead * math.cos(towards), ahead * math.sin(towards), -math.cos(tilt)])


def upright(options: WorldOptions) -> Float[np.ndarray, "4"]:
    """The shortest rotation from the floor's frame to one whose z is the vertical, as a unit quaternion."""
    half, towards = math.radians(options.tilt_deg) / 2, math.radians(options.downhill_deg)
    axis = np.array([-math.sin(towards), math.cos(towards), 0.0])
    return np.array([math.cos(half), *(math.sin(half) * axis)])


def _floor(spec: Any, options: WorldOptions) -> None:
    # priority: the floor's friction counts, whatever that of the soles
    _ = spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0.0, 0.0, 0.05],
        friction=[options.friction, 0.005, 0.0001],
        priority=1,
        contype=_GROUND,
        conaffinity=_GROUND,
        material="floor",
    )


def _bumps(spec: Any, options: WorldOptions, draw: np.random.Generator) -> None:
    clear = _START + options.bump_side
    for number in range(options.bumps):
        # even over the ring's area
        distance = math.sqrt(draw.uniform(clear**2, max(options.bump_reach, clear) ** 2))
        angle, yaw = draw.uniform(-math.pi, math.pi, 2)
        _ = spec.worldbody.add_geom(
            name=f"bump{number}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[options.bump_side / 2, options.bump_side / 2, options.bump_height / 2],
            pos=[distance * math.cos(angle), distance * math.sin(angle), options.bump_height / 2],
            quat=[math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)],
            friction=[options.friction, 0.005, 0.0001],
            priority=1,
            contype=_GROUND,
            conaffinity=_GROUND,
            rgba=[0.45, 0.42, 0.38, 1.0],
        )


def _obstacles(spec: Any, options: WorldOptions) -> None:
    for number, circle in enumerate(options.circles):
        name, place = OBSTACLE.format(number), [circle.x, circle.y, _TALL / 2]
        body = spec.worldbody.add_body(name=name, pos=place, mocap=True)  # mocap: nothing but `move` moves it
        _ = body.add_geom(
            name=OBSTACLE.format(number),
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            size=[circle.radius, _TALL / 2, 0.0],
            contype=_GROUND | OBSTACLE_BIT,
            conaffinity=0,
            rgba=[0.80, 0.36, 0.28, 1.0],
        )


def _slow_servos(spec: Any, options: WorldOptions) -> None:
    """A first-order lag between command and servo, integrated exactly."""
    if options.lag_s == 0:
        return
    for servo in spec.actuators:
        servo.dyntype = mujoco.mjtDyn.mjDYN_FILTEREXACT
        servo.dynprm[0] = options.lag_s
        servo.actdim = 1
        servo.actearly = True


def _scenery(spec: Any) -> None:
    """A sky, a checked floor and soft light."""
    _ = spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.72, 0.82, 0.93],
        rgb2=[0.98, 0.98, 0.97],
        width=128,
        height=768,
    )
    _ = spec.add_texture(
        name="floor",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        mark=mujoco.mjtMark.mjMARK_EDGE,
        rgb1=[0.84, 0.86, 0.88],
        rgb2=[0.75, 0.78, 0.81],
        markrgb=[0.66, 0.69, 0.73],
        width=256,
        height=256,
    )
    material = spec.add_material(name="floor", texrepeat=[1.0, 1.0], texuniform=True)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "floor"
    for light in list(spec.lights):
        spec.delete(light)
    # the sun goes with the robot: it casts shadows only around itself
    _ = spec.joint("floating_base").parent.add_light(
        name="sun",
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        mode=mujoco.mjtCamLight.mjCAMLIGHT_TRACK,
        pos=[1.0, -1.3, 2.4],
        dir=[-0.35, 0.45, -0.82],
        diffuse=[0.62, 0.61, 0.58],
        specular=[0.10, 0.10, 0.10],
        castshadow=True,
    )
    look = spec.visual
    look.headlight.ambient, look.headlight.diffuse = [0.34, 0.34, 0.37], [0.20, 0.20, 0.20]
    look.headlight.specular = [0.05, 0.05, 0.05]
    spec.stat.extent = 2.0
    look.map.zfar, look.map.shadowclip = 30.0, 1.5
    look.quality.shadowsize, look.quality.offsamples = 2048, 2
    look.global_.offwidth, look.global_.offheight = 1920, 1080
