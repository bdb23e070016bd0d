"""Where the humanoid's parts are, how they move and what holding them costs, for a given configuration.

The balance asks these of the measured joints, at every tick; each is one call of a compiled kernel.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.walk.posture.kernels import jacobians_kernel, static_kernel, survey_kernel
from toddle.walk.posture.model import CHEST, IMU, SOLES, WAIST, PostureModel


class Survey(NamedTuple):
    """Where things are in the world: centre of mass and frames [m], rotations as matrices."""

    com: Float[np.ndarray, "3"]
    soles_p: Float[np.ndarray, "2 3"]
    soles_R: Float[np.ndarray, "2 3 3"]
    waist_R: Float[np.ndarray, "3 3"]
    chest_R: Float[np.ndarray, "3 3"]
    imu_R: Float[np.ndarray, "3 3"]
    waist_p: Float[np.ndarray, "3"]
    chest_p: Float[np.ndarray, "3"]
    imu_p: Float[np.ndarray, "3"]


class Jacobians(NamedTuple):
    """Derivatives by the velocity in MuJoCo's order, in the world; of a sole: its origin's, then its turning's."""

    com: Float[np.ndarray, "3 velocities"]
    soles: Float[np.ndarray, "2 6 velocities"]


def survey(model: PostureModel, q: Float[np.ndarray, " positions"]) -> Survey:
    """Where the centre of mass and the frames are.

    Args:
        model: the robot.
        q: configuration [m], quaternion, [rad].

    Raises:
        BadInput: a configuration of the wrong size.
    """
    com, at, facing = survey_kernel(model.skeleton, checked(model, q))
    return Survey(
        com, at[SOLES], facing[SOLES], facing[WAIST], facing[CHEST], facing[IMU], at[WAIST], at[CHEST], at[IMU]
    )


def jacobians(model: PostureModel, q: Float[np.ndarray, " positions"]) -> Jacobians:
    """How the centre of mass and the soles move with the base and the joints.

    Args:
        model: the robot.
        q: configuration [m], quaternion, [rad].

    Raises:
        BadInput: a configuration of the wrong size.
    """
    return Jacobians(*jacobians_kernel(model.skeleton, checked(model, q)))


def static_torques(
    model: PostureModel,
    q: Float[np.ndarray, " positions"],
    load: Float[np.ndarray, "2"],
    cop: Float[np.ndarray, "2 2"],
) -> Float[np.ndarray, " joints"]:
    """Torques that hold the robot still: gravity less J^T of the floor's forces on the soles.

    Args:
        model: the robot.
        q: configuration [m], quaternion, [rad].
        load: shares of the weight on the left and the right sole.
        cop: where they act, x and y in each sole's frame [m].

    Returns:
        One for each joint [N m]; a servo of stiffness kp that is sent q + torque / kp sags no more.

    Raises:
        BadInput: an argument of the wrong size.
    """
    load, cop = np.array(load, float), np.array(cop, float)
    if load.shape != (2,) or cop.shape != (2, 2):
        raise BadInput(f"loads {load.shape}, centres of pressure {cop.shape}", remedy="give (2,) and (2, 2)")
    return static_kernel(model.skeleton, checked(model, q), load, cop)


def checked(model: PostureModel, q: Float[np.ndarray, " positions"]) -> Float[np.ndarray, " positions"]:
    """A copy that a kernel can take: a kernel reads past the end of what is too short.

    Raises:
        BadInput: a configuration of the wrong size.
    """
    q = np.array(q, float)
    if q.shape != (7 + len(model.joints),):
        raise BadInput(f"a configuration of shape {q.shape}", remedy=f"it has {7 + len(model.joints)} numbers")
    return q
