"""The senses of a simulated humanoid: which numbers of MuJoCo they are, and what they have of noise, bias and age.

A force-torque sensor also feels what hangs under it. As on the real robot that weight is known and taken off, for a
foot that is level; what its acceleration adds stays. Forces and the inertial unit's
rates are means over a tick, as a sensor that measures faster than it reports gives them: the servos' targets change
once a tick, and a force that is looked at always at the same moment after it shows only that moment.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from jaxtyping import Float, Int

from toddle.failures import BadInput
from toddle.outside.simulation.disturbances import Noise, WorldOptions
from toddle.outside.simulation.world import GRAVITY, SOLES, upright
from toddle.robots.humanoid import Humanoid
from toddle.signals import Senses

_VECTORS = ("left_force", "left_torque", "right_force", "right_torque", "gyro", "accelerometer")


class Organs(NamedTuple):
    """Where a humanoid's senses are in MuJoCo's arrays, and their errors.

    The measured numbers stand in one row: joints, their rates, both wrenches, gyro and accelerometer.

    Attributes:
        joints: how many.
        places: in ``sensordata``, of both wrenches, gyro and accelerometer.
        orientation: of the inertial unit's quaternion in ``sensordata``.
        waist: number of the site.
        sign: of those 18 numbers: MuJoCo tells what a foot does to the leg, not what the floor does to the foot.
        tare: what is added to them: the weight under the sensors.
        sigma: standard deviation of the noise of the row, then of orientation (3), x, y and heading.
        bias: constant error of the same.
        upright: rotation from the floor's frame to the vertical's.
    """

    joints: int
    places: Int[np.ndarray, "18"]
    orientation: int
    waist: int
    sign: Float[np.ndarray, "18"]
    tare: Float[np.ndarray, "18"]
    sigma: Float[np.ndarray, " row"]
    bias: Float[np.ndarray, " row"]
    upright: Float[np.ndarray, "4"]


def organs(humanoid: Humanoid, model: mujoco.MjModel, options: WorldOptions) -> Organs:
    """Finds the senses of a humanoid in its model and draws their constant errors.

    Raises:
        BadInput: a sensor or a site is not there.
    """
    joints = len(humanoid.joints)
    places = np.concatenate([_place(humanoid, model, name) + np.arange(3) for name in _VECTORS])
    bias = _deviations(options.bias, joints)
    bias *= np.random.default_rng([options.seed, 1]).standard_normal(len(bias))
    return Organs(
        joints,
        places,
        _place(humanoid, model, "orientation"),
        site(humanoid, model, "waist"),
        np.array([-1.0] * 12 + [1.0] * 6),
        _tare(humanoid, model),
        _deviations(options.noise, joints),
        bias,
        upright(options),
    )


def sense(
    organs: Organs,
    mean: Float[np.ndarray, " sensors"],
    data: mujoco.MjData,
    t: float,
    q: Float[np.ndarray, " positions"],
    v: Float[np.ndarray, " speeds"],
    options: WorldOptions,
    draw: np.random.Generator,
) -> Senses:
    """What the robot's sensors tell.

    Args:
        organs: see `Organs`.
        mean: of ``sensordata`` over the tick: what forces, gyro and accelerometer tell.
        data: whose ``sensordata`` and sites belong to q and v.
        t: time of the measurement [s].
        q: configuration.
        v: velocity.
        options: the world.
        draw: of the noise.
    """
    n = organs.joints
    error = organs.bias + organs.sigma * draw.standard_normal(len(organs.sigma))
    vectors = mean[organs.places]
    vectors *= organs.sign
    vectors += organs.tare
    vectors += error[2 * n : 2 * n + 18]
    turned = data.sensordata[organs.orientation : organs.orientation + 4]
    return Senses(
        t,
        q[7:] + error[:n],
        v[6:] + error[n : 2 * n],
        vectors[:12].reshape(2, 6),
        _orientation(organs.upright, turned, error[-6:-3], options.yaw_drift * t),
        vectors[12:15],
        vectors[15:],
        _waist(organs, data, error[-3:]) if options.localised else np.full(3, math.nan),
    )


def site(humanoid: Humanoid, model: mujoco.MjModel, name: str) -> int:
    """Number of a site.

    Raises:
        BadInput: it is not there.
    """
    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, name)
    if number < 0:
        raise BadInput(f"there is no site {name}", where=humanoid.name, remedy="add it to the description")
    return number


def _place(humanoid: Humanoid, model: mujoco.MjModel, name: str) -> int:
    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, name)
    if number < 0:
        raise BadInput(f"there is no sensor {name}", where=humanoid.name, remedy="add it to the description")
    return int(model.sensor_adr[number])


def _tare(humanoid: Humanoid, model: mujoco.MjModel) -> Float[np.ndarray, "18"]:
    """The weight that hangs under each sensor on a level floor, by the masses that the description gives."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    tare = np.zeros(18)
    for side, name in enumerate(SOLES):
        number = site(humanoid, model, name)
        body = int(model.site_bodyid[number])
        away = data.subtree_com[body] - data.site_xpos[number]
        centre = data.site_xmat[number].reshape(3, 3).T @ away
        weight = np.array([0.0, 0.0, model.body_subtreemass[body] * GRAVITY])
        tare[6 * side : 6 * side + 6] = *weight, *np.cross(centre, weight)
    return tare


def _deviations(noise: Noise, joints: int) -> Float[np.ndarray, " row"]:
    wrench = [noise.force] * 3 + [noise.torque] * 3
    unit = [noise.gyro] * 3 + [noise.acceleration] * 3 + [noise.orientation] * 3
    place = [noise.place, noise.place, noise.heading]
    return np.array([noise.encoder] * joints + [noise.rate] * joints + 2 * wrench + unit + place)


def _orientation(
    upright: Float[np.ndarray, "4"],
    turned: Float[np.ndarray, "4"],
    error: Float[np.ndarray, "3"],
    drift: float,
) -> Float[np.ndarray, "4"]:
    """Of the unit against the vertical, off by small rotations about its axes and by a drift of its yaw."""
    w, x, y, z = product(upright.tolist(), turned.tolist())
    if drift:
        w, x, y, z = product((math.cos(drift / 2), 0.0, 0.0, math.sin(drift / 2)), (w, x, y, z))
    a, b, c = (0.5 * error).tolist()
    quaternion = np.array(product((w, x, y, z), (1.0, a, b, c)))
    quaternion /= math.sqrt(quaternion @ quaternion)
    return quaternion


def product(p: Sequence[float], q: Sequence[float]) -> tuple[float, float, float, float]:
    """Of two quaternions (w, x, y, z)."""
    a, b, c, d = p
    w, x, y, z = q
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def _waist(organs: Organs, data: mujoco.MjData, error: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    x, y, _ = data.site_xpos[organs.waist].tolist()
    turned = data.site_xmat[organs.waist]
    return np.array([x, y, math.atan2(turned[3], turned[0])]) + error
