"""How alike two drivers command: the Kullback-Leibler divergence of their velocities (Huber 2019, equation 4.1)."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from toddle.failures import BadInput

AHEAD = np.linspace(-0.15, 0.31, 24)
"""Edges of the histogram of velocities ahead [m/s]: 0.02 wide, 0 in the middle of one. The document tells none."""

TURNING = np.linspace(-0.31, 0.31, 32)
"""Of turning velocities [rad/s], likewise."""


def counts(values: Float[np.ndarray, " looks"], edges: Float[np.ndarray, " edges"]) -> Int[np.ndarray, " bins"]:
    """How many values lie in each bin; what lies outside counts as outermost."""
    found, _ = np.histogram(np.clip(values, edges[0], edges[-1]), edges)
    return found


def divergence(truth: Int[np.ndarray, " bins"], said: Int[np.ndarray, " bins"], added: float = 0.5) -> float:
    """``sum p log(p / q)`` [nat] of two histograms (equation 4.1): 0 where they are the same.

    A bin that only the teacher ever used would make it infinite, so that a little is added to each bin of both.

    Args:
        truth: p, how often the teacher said each.
        said: q, how often the network did.
        added: to each bin's count; 0: the equation by the letter, which can be infinite.

    Raises:
        BadInput: a histogram is empty.
    """
    if not truth.sum() or not said.sum():
        raise BadInput("an empty histogram is no distribution", where="divergence", remedy="give at least one look")
    p, q = ((one + added) / (one + added).sum() for one in (truth, said))
    used = p > 0
    if (q[used] == 0).any():
        return float("inf")
    return float((p[used] * np.log(p[used] / q[used])).sum())
