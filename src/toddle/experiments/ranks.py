"""Rank correlation: do two lists order the same things in the same way?"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float


def rank_correlation(a: Float[np.ndarray, " things"], b: Float[np.ndarray, " things"]) -> float:
    """Spearman's coefficient, -1 to 1: the linear correlation of the ranks; ties share their mean rank."""
    return float(np.corrcoef(_ranks(a), _ranks(b))[0, 1])


def _ranks(values: Float[np.ndarray, " things"]) -> Float[np.ndarray, " things"]:
    _, index, counts = np.unique(values, return_inverse=True, return_counts=True)
    return (np.cumsum(counts) - (counts - 1) / 2.0)[index]
