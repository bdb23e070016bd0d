"""Obstacles of the world in the plan's frame, by where the waist is in both."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from toddle.signals import Circle, Senses
from toddle.walk.balance.estimate import Estimate
from toddle.walk.pattern.displacement import rotate
from toddle.walk.pattern.obstacles import NONE
from toddle.walk.posture.model import PostureModel
from toddle.walk.posture.survey import survey


def placed(
    model: PostureModel, sensed: Estimate, senses: Senses, circles: tuple[Circle, ...]
) -> Float[np.ndarray, "circles 3"]:
    """Centre and radius of each [m]; none where the robot does not know its place.

    Args:
        model: the robot.
        sensed: where it is in the plan's frame.
        senses: where it is in the world.
        circles: in the world.
    """
    if not circles or not np.isfinite(senses.place).all():
        return NONE
    x, y = survey(model, sensed.q).waist_p[:2].tolist()
    east, north, heading = senses.place.tolist()
    found = np.array(circles, float)
    for row in found:
        dx, dy = rotate(sensed.yaw - heading, (row[0] - east, row[1] - north))
        row[:2] = x + dx, y + dy
    return found
