"""Obstacles on the floor as the walking pattern takes them: circles in the plan's frame, the nearest few.

A circle that no previewed foot and no preview of the body can touch costs nothing, so any number may stand around.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from jaxtyping import Float

from toddle.signals import Circle

MOST = 8
"""So many circles have rows in one programme: the nearest to the foot that stands."""

NONE = np.zeros((0, 3))
"""No obstacle."""


def circles(obstacles: Iterable[Circle]) -> Float[np.ndarray, "circles 3"]:
    """Centres and radii, one row each [m]."""
    return np.array([(o.x, o.y, o.radius) for o in obstacles], dtype=float).reshape(-1, 3)


def near(obstacles: Float[np.ndarray, "circles 3"], x: float, y: float, reach: float) -> Float[np.ndarray, "some 3"]:
    """The circles whose edge lies within reach of a point, relative to it, at most `MOST`; the nearest first.

    Args:
        obstacles: centres and radii [m].
        x: of the point [m].
        y: of the point [m].
        reach: [m].
    """
    if len(obstacles) == 0:
        return NONE
    moved = obstacles - np.array([x, y, 0.0])
    away = np.hypot(moved[:, 0], moved[:, 1]) - moved[:, 2]
    order = np.argsort(away, kind="stable")[:MOST]
    return moved[order[away[order] <= reach]]


def clearance(
    obstacles: Float[np.ndarray, "circles 3"],
    pose: tuple[float, float, float],
    sole: tuple[float, float, float],
) -> float:
    """From a sole, a rectangle, to the nearest circle [m]; negative where they overlap; infinite without obstacles.

    Args:
        obstacles: centres and radii [m].
        pose: x, y [m] and yaw [rad] of the sole's frame.
        sole: length, width and how far the middle is ahead of the frame [m].
    """
    if len(obstacles) == 0:
        return float("inf")
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    local = (obstacles[:, :2] - np.array(pose[:2])) @ np.array([[cos, -sin], [sin, cos]])
    gaps = np.abs(local - np.array([sole[2], 0.0])) - np.array([sole[0] / 2, sole[1] / 2])
    outside = np.linalg.norm(np.maximum(gaps, 0.0), axis=1)
    inside = np.minimum(gaps.max(axis=1), 0.0)
    return float((outside + inside - obstacles[:, 2]).min())
