"""Looking and correcting, for any inverse that has a slope: Newton's step with an inverse Jacobian that looks mend.

The joints move by H (x* - x), where H begins as the slope dq/dx of a learned inverse and takes Broyden's good update
from each movement, H <- H + (dq - H dx) (dq' H) / (dq' H dx). In NumPy and float64, joints in the unit box;
`toddle.reach.solve.correction` does the like for learners that run under JAX.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

Joints = Float[np.ndarray, "points joints"]
Positions = Float[np.ndarray, "points space"]


def looked_for(
    observe: Callable[[Joints], Positions],
    targets: Positions,
    q: Joints,
    inverse: Float[np.ndarray, "points joints space"],
    looks: int,
    *,
    largest: float = 0.15,
) -> tuple[Joints, Float[np.ndarray, "answers points"]]:
    """Answers corrected by what is seen after each movement.

    Args:
        observe: moves to joint values (unit box) and says where the tip went [m].
        targets: where it should go [m].
        q: the answers to begin with.
        inverse: their dq/dx [1/m].
        looks: how often an answer is corrected.
        largest: the most that a joint moves in one correction, as a share of its range.

    Returns:
        The best joint values tried, and row by row the best error after 0, 1, ... looks [m].
    """
    x = observe(q)
    best, least = q, np.linalg.norm(x - targets, axis=1)
    errors = [least]
    for _ in range(looks):
        step = np.einsum("pjs,ps->pj", inverse, targets - x)
        step *= np.minimum(1.0, largest / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-12))
        moved = np.clip(q + step, 0, 1)
        seen = observe(moved)
        inverse = mended(inverse, moved - q, seen - x)
        q, x = moved, seen
        miss = np.linalg.norm(x - targets, axis=1)
        best, least = np.where((miss < least)[:, None], q, best), np.minimum(miss, least)
        errors.append(least)
    return best, np.stack(errors)


def mended(
    inverse: Float[np.ndarray, "points joints space"], dq: Joints, dx: Positions
) -> Float[np.ndarray, "points joints space"]:
    """Broyden's good update: afterwards H dx = dq; left alone where a movement led nowhere or against the slope."""
    along = np.einsum("pj,pjs->ps", dq, inverse)
    size = np.einsum("ps,ps->p", along, dx)
    safe = size > 1e-3 * np.linalg.norm(along, axis=1) * np.linalg.norm(dx, axis=1) + 1e-12
    update = np.einsum("pj,ps->pjs", dq - np.einsum("pjs,ps->pj", inverse, dx), along)
    return inverse + np.where(safe[:, None, None], update / np.where(safe, size, 1.0)[:, None, None], 0.0)
