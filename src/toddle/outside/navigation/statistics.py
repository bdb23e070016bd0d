"""What a share of successes is worth."""

from __future__ import annotations

import math

_Z = 1.959964  # of 95 %


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """The interval in which the true share lies with 95 % (Wilson 1927); 0 and 1 without trials."""
    if not trials:
        return 0.0, 1.0
    share = successes / trials
    middle = share + _Z**2 / (2 * trials)
    half = _Z * math.sqrt(share * (1 - share) / trials + _Z**2 / (4 * trials**2))
    scale = 1 + _Z**2 / trials
    return max((middle - half) / scale, 0.0), min((middle + half) / scale, 1.0)
