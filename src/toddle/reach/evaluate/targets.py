"""Test targets: points of the reachable space, at least a given distance apart (Mahboob 2015, sections 4.2 and 5.3).

They are drawn from their own random stream and are never shown to a learner.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float


def spread_out(
    positions: Float[np.ndarray, "samples space"], spacing: float, most: int
) -> Float[np.ndarray, "points space"]:
    """The first positions, in their order, that keep `spacing` [m] from all chosen before; at most `most` of them."""
    chosen: list[np.ndarray] = []
    left = positions
    while len(left) and len(chosen) < most:
        chosen.append(left[0])
        left = left[np.sum((left - left[0]) ** 2, axis=1) >= max(spacing, 1e-12) ** 2]
    return np.array(chosen)


def fixed_targets(
    positions: Float[np.ndarray, "samples space"], count: int, spacing: float | None = None
) -> tuple[Float[np.ndarray, "points space"], float]:
    """The fixed test set.

    Args:
        positions: reachable positions in random order [m].
        count: how many targets are wanted.
        spacing: distance that they keep [m]; None for the widest one at which `count` of them fit.

    Returns:
        The targets [m] (fewer than `count` if they do not fit at the given spacing), and the spacing [m].
    """
    if spacing is not None:
        return spread_out(positions, spacing, count), spacing
    low, high = 0.0, float(np.linalg.norm(np.ptp(positions, axis=0)))
    best = positions[:count]
    for _ in range(12):
        middle = (low + high) / 2
        points = spread_out(positions, middle, count)
        if len(points) == count:
            low, best = middle, points
        else:
            high = middle
    return best, low
