"""Gains and force limits of the position servos, from the arm's own inertia.

A servo pushes with ``kp (command - m) - kv dm/dt``. With ``kp = w^2 d`` and ``kv = 2 w d`` a joint of inertia
d alone is critically damped. The joints of an arm move each other, so d is the sum of the absolute values of
the joint's row in the inertia matrix M, the largest over many postures: by Gershgorin's circles diag(d) - M
has no negative eigenvalue, and every mode of the arm, at inertia ratio r <= 1, obeys ``r s^2 + 2 w s + w^2 =
0``: none oscillates, and each dies out at w/2 or faster.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np
from jaxtyping import Float

from toddle.outside.simulation.options import PhysicsOptions

_HOLDING_MARGIN = 3.0  # force limit over the greatest weight a servo has to hold


def tune(
    model: mujoco.MjModel,
    postures: Float[np.ndarray, "postures servos"],
    low: Float[np.ndarray, " servos"],
    high: Float[np.ndarray, " servos"],
    options: PhysicsOptions,
) -> None:
    """Set the stiffness, damping and force limit of every servo of the model.

    The force limit holds three times the greatest weight met, and beside it brings the joint from the
    greatest speed of a movement to rest within 1/w.

    Args:
        model: one degree of freedom and one position servo each, changed in place.
        postures: where inertia and weight are looked at [rad or m].
        low: least motion of each axis [rad or m].
        high: greatest motion of each axis [rad or m].
        options: the natural frequency, and how fast the arm is driven.
    """
    inertia, weight = loads(model, postures)
    frequency = 2 * math.pi * options.natural_frequency_hz
    stiffness, damping = frequency**2 * inertia, 2 * frequency * inertia
    fastest = 1.875 * (high - low) / options.sweep_s  # a minimum-jerk movement peaks at 15/8 of its mean speed
    force = _HOLDING_MARGIN * weight + inertia * fastest * frequency
    model.actuator_gainprm[:, 0] = stiffness
    model.actuator_biasprm[:, 1] = -stiffness
    model.actuator_biasprm[:, 2] = -damping
    model.actuator_forcelimited[:] = True
    model.actuator_forcerange[:] = np.stack([-force, force], axis=1)


def loads(
    model: mujoco.MjModel, postures: Float[np.ndarray, "postures servos"]
) -> tuple[Float[np.ndarray, " servos"], Float[np.ndarray, " servos"]]:
    """The greatest inertia bound [kg m^2, or kg] and weight [N m, or N] that each servo meets."""
    data = mujoco.MjData(model)
    matrix = np.zeros((model.nv, model.nv))
    inertia, weight = np.zeros(model.nv), np.zeros(model.nv)
    for posture in postures:
        data.qpos[:] = posture
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fullM(model, data, matrix)
        inertia = np.maximum(inertia, np.abs(matrix).sum(axis=1))
        weight = np.maximum(weight, np.abs(data.qfrc_bias))
    return inertia, weight
