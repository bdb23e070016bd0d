"""Where a foot may land, and the commands that such steps can follow."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.robots.gait import Gait

_TRIED = 0.465  # centre of mass of the robot that the box below was found on [m]; it scales


class Hull(NamedTuple):
    """Where the left sole's origin may land, in the right sole's frame; mirrored for the right one.

    Attributes:
        rows: of each edge the outward normal and its distance: x nx + y ny <= d [m].
        corners: x, y, clockwise [m].
        reach: of the farthest corner [m].
    """

    rows: Float[np.ndarray, "edges 3"]
    corners: Float[np.ndarray, "edges 2"]
    reach: float


def landing_hull(gait: Gait) -> Hull:
    """The gait's own hull; without one a box: 0.24 m ahead and back, 0.12 to 0.3 m aside for a robot of iCub's size.

    Raises:
        BadInput: the corners don't go round a convex area clockwise, or the foot distance isn't in it.
    """
    corners = np.array(gait.hull, dtype=float) if gait.hull else landing_box(gait)
    along = np.roll(corners, -1, axis=0) - corners
    following = np.roll(along, -1, axis=0)
    turns = along[:, 0] * following[:, 1] - along[:, 1] * following[:, 0]
    lengths = np.linalg.norm(along, axis=1)
    if len(corners) < 3 or (lengths < 1e-9).any() or (turns > 1e-12).any():
        raise BadInput(
            "the corners don't go clockwise round a convex area",
            where="gait, hull",
            remedy="begin with the rear inner corner of the left sole, then outwards, ahead, and back inside",
        )
    normals = np.column_stack([-along[:, 1], along[:, 0]]) / lengths[:, None]
    rows = np.column_stack([normals, (normals * corners).sum(axis=1)])
    if (normals @ np.array([0.0, gait.foot_distance]) > rows[:, 2] + 1e-9).any():
        raise BadInput(
            f"the hull leaves no room for feet {gait.foot_distance:g} m apart",
            where="gait, hull",
            remedy="its inner edge must not lie beyond foot_distance",
        )
    return Hull(np.ascontiguousarray(rows), corners, float(np.linalg.norm(corners, axis=1).max()))


def landing_box(gait: Gait) -> Float[np.ndarray, "4 2"]:
    """Corners of the box for a gait that has no hull: the inner edge lies nearer than the foot distance [m]."""
    scale = gait.com_height / _TRIED
    ahead, inner, outer = 0.24 * scale, gait.foot_distance - 0.02 * scale, gait.foot_distance + 0.16 * scale
    return np.array([[-ahead, inner], [-ahead, outer], [ahead, outer], [ahead, inner]])
