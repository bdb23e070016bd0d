"""Standing with bent knees: both soles flat, the centre of mass over the middle between them, waist upright.

Gauss-Newton on the residuals of both soles' poses, the centre of mass and the waist's orientation; joints that a
step would take beyond their limits are clamped there and left out of the next one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np
from jaxtyping import Float, Int

_STEPS = 200
_CLOSE = 1e-9  # residual at which the posture is taken [m, rad]
_DAMPING = 1e-9


class Stand(NamedTuple):
    """A posture that was looked for: configuration, and what is left of the residual [m, rad]."""

    q: Float[np.ndarray, " positions"]
    residual: float


def stand(
    model: Any,
    start: Float[np.ndarray, " positions"],
    free: Sequence[int],
    com: Float[np.ndarray, "3"],
    soles: Float[np.ndarray, "2 3"],
) -> Stand:
    """The posture nearest to standing so.

    Args:
        model: MuJoCo's, with a floating base and the sites left_sole, right_sole and waist.
        start: configuration to start from.
        free: numbers of the joints that may turn.
        com: where the centre of mass is wanted [m].
        soles: where the soles' origins are wanted [m].
    """
    data = mujoco.MjData(model)
    data.qpos[:] = start
    dofs = np.array([*range(6), *(6 + joint for joint in free)])
    lower, upper = model.jnt_range[1:, 0], model.jnt_range[1:, 1]
    for _ in range(_STEPS):
        residual, jacobian = _residual(model, data, com, soles)
        if np.abs(residual).max() < _CLOSE:
            break
        step = _bounded(jacobian, residual, dofs, data.qpos[7:], lower, upper)
        step *= min(1.0, 0.3 / max(float(np.abs(step).max()), 1e-12))
        mujoco.mj_integratePos(model, data.qpos, step, 1.0)
        data.qpos[7:] = np.clip(data.qpos[7:], lower, upper)
    residual, _ = _residual(model, data, com, soles)
    return Stand(data.qpos.copy(), float(np.abs(residual).max()))


def _residual(
    model: Any, data: Any, com: Float[np.ndarray, "3"], soles: Float[np.ndarray, "2 3"]
) -> tuple[Float[np.ndarray, " rows"], Float[np.ndarray, "rows dofs"]]:
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    rows, blocks = [], []
    place, turn = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    for side, name in enumerate(("left_sole", "right_sole", "waist")):
        site = model.site(name).id
        mujoco.mj_jacSite(model, data, place, turn, site)
        if name != "waist":
            rows.append(soles[side] - data.site_xpos[site])
            blocks.append(place.copy())
        rows.append(_tilt(data.site_xmat[site].reshape(3, 3)))
        blocks.append(turn.copy())
    mujoco.mj_jacSubtreeCom(model, data, place, 1)
    return np.concatenate([*rows, com - data.subtree_com[1]]), np.vstack([*blocks, place])


def _tilt(rotation: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3"]:
    """The rotation vector [rad] that turns a frame upright with yaw zero."""
    quaternion, vector = np.zeros(4), np.zeros(3)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(rotation.T).ravel())
    mujoco.mju_quat2Vel(vector, quaternion, 1.0)
    return vector


def _bounded(
    jacobian: Float[np.ndarray, "rows dofs"],
    residual: Float[np.ndarray, " rows"],
    dofs: Int[np.ndarray, " free"],
    joints: Float[np.ndarray, " joints"],
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
) -> Float[np.ndarray, " dofs"]:
    """A damped least-squares step; joints at a limit that it would cross are held, one round after the other."""
    active = list(dofs)
    while True:
        part = jacobian[:, active]
        weight = part.T @ part + _DAMPING * np.eye(len(active))
        step = np.zeros(jacobian.shape[1])
        step[active] = np.linalg.solve(weight, part.T @ residual)
        blocked = [
            dof
            for dof in active
            if dof >= 6
            and (
                (joints[dof - 6] <= lower[dof - 6] and step[dof] < 0)
                or (joints[dof - 6] >= upper[dof - 6] and step[dof] > 0)
            )
        ]
        if not blocked:
            return step
        active = [dof for dof in active if dof not in blocked]
