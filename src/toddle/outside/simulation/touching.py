"""How near feet, legs and body come to the obstacles, and which of them touches one."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int

from toddle.outside.simulation.world import OBSTACLE_BIT, SOLES

FEET, LEGS, BODY = 0, 1, 2
_NONE = -1
_FAR = 1.0  # no clearance is told beyond it [m]


class Shapes(NamedTuple):
    """What each of MuJoCo's geoms is.

    Attributes:
        part: of each geom: 0 a foot, 1 a leg, 2 the body, -1 nothing of the robot that can touch.
        obstacle: whether each geom is one.
        robot: geoms of the robot that can touch.
        obstacles: geoms of the obstacles.
    """

    part: Int[np.ndarray, " geoms"]
    obstacle: Bool[np.ndarray, " geoms"]
    robot: tuple[int, ...]
    obstacles: tuple[int, ...]


def shapes(model: mujoco.MjModel) -> Shapes:
    """Sorts a model's geoms: a foot is all that is rigid with a sole, a leg what is between it and the waist."""
    rigid = model.body_weldid
    feet = {int(rigid[model.site_bodyid[model.site(name).id]]) for name in SOLES}
    trunk = set(_upwards(model, int(rigid[model.site_bodyid[model.site("waist").id]])))
    legs = {body for foot in feet for body in _upwards(model, foot)} - feet - trunk
    part = np.full(model.ngeom, _NONE)
    solid = (model.geom_contype | model.geom_conaffinity) != 0
    theirs = (rigid[model.geom_bodyid] != 0) & (model.body_mocapid[model.geom_bodyid] < 0)
    for geom in np.flatnonzero(solid & theirs).tolist():
        body = int(rigid[model.geom_bodyid[geom]])
        part[geom] = FEET if body in feet else LEGS if body in legs else BODY
    obstacle = (model.geom_contype & OBSTACLE_BIT) != 0
    robot = tuple(np.flatnonzero(part != _NONE).tolist())
    return Shapes(part, obstacle, robot, tuple(np.flatnonzero(obstacle).tolist()))


def touching(shapes: Shapes, data: mujoco.MjData) -> Bool[np.ndarray, "3"]:
    """Whether feet, legs and body touch an obstacle."""
    parts = np.zeros(3, bool)
    if data.ncon:
        first, second = data.contact.geom.T
        for one, other in ((first, second), (second, first)):
            parts[shapes.part[one[shapes.obstacle[other] & (shapes.part[one] != _NONE)]]] = True
    return parts


def clearances(shapes: Shapes, model: mujoco.MjModel, data: mujoco.MjData) -> Float[np.ndarray, "3"]:
    """Distance of feet, legs and body to the nearest obstacle [m], at most 1; under 0 they overlap."""
    nearest = np.full(3, _FAR)
    for obstacle in shapes.obstacles:
        bound = _away(model, data, obstacle) - model.geom_rbound
        for geom in shapes.robot:
            part = shapes.part[geom]
            if bound[geom] < nearest[part]:
                distance = mujoco.mj_geomDistance(model, data, geom, obstacle, nearest[part], None)
                nearest[part] = min(nearest[part], distance)
    return nearest


def _away(model: mujoco.MjModel, data: mujoco.MjData, obstacle: int) -> Float[np.ndarray, " geoms"]:
    """Level distance of each geom's middle to an upright cylinder or box [m]; for a cylinder, negative inside."""
    off = data.geom_xpos[:, :2] - data.geom_xpos[obstacle, :2]
    if model.geom_type[obstacle] == mujoco.mjtGeom.mjGEOM_BOX:
        turn = data.geom_xmat[obstacle].reshape(3, 3)[:2, :2]
        return np.linalg.norm(np.maximum(np.abs(off @ turn) - model.geom_size[obstacle, :2], 0.0), axis=1)
    return np.linalg.norm(off, axis=1) - model.geom_size[obstacle, 0]


def _upwards(model: mujoco.MjModel, body: int) -> list[int]:
    """A body and all that it hangs on, but the world."""
    chain: list[int] = []
    while body:
        chain.append(body)
        body = int(model.body_weldid[model.body_parentid[body]])
    return chain
