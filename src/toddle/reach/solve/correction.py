"""Observed correction: look where the tip went, shift the commanded target by what was missed, ask again."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

Map = Callable[[np.ndarray], np.ndarray]


def correct(
    predict: Map, observe: Map, targets: Float[np.ndarray, "batch space"], looks: int
) -> tuple[Float[np.ndarray, "batch joints"], Float[np.ndarray, "looks batch"]]:
    """Reach for targets [m] with so many corrections.

    Returns:
        The best joint values seen, and the best error so far [m] after 0 (open loop), 1, ... looks.
    """
    commanded = targets.copy()
    best_q, best = np.zeros(0), np.full(len(targets), np.inf)
    errors = []
    for look in range(looks + 1):
        q = predict(commanded)
        x = observe(q)
        error = np.linalg.norm(x - targets, axis=1)
        best_q = np.where((error < best)[:, None], q, best_q) if look else q
        best = np.minimum(error, best)
        errors.append(best)
        commanded = commanded + targets - x
    return best_q, np.stack(errors)
