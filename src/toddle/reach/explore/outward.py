"""Random movements that keep to the ends of the joints' ranges, for the fit of an arm.

What a fit leaves uncertain is largest where joints are at their ends, and movements there tell most (of a line, the two
ends alone do). So a joint's places follow the arcsine law, evenly spread over all movements (a Latin hypercube); one
that goes around far enough has no ends, and its places are uniform.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

_AROUND = 4.5  # [rad]: a range as wide as this has no ends to speak of


def outward_movements(
    lower: Float[np.ndarray, " joints"], upper: Float[np.ndarray, " joints"], count: int, rng: np.random.Generator
) -> Float[np.ndarray, "movements joints"]:
    """Random joint values, more of them near the limits.

    Args:
        lower: lower limits [rad or m].
        upper: upper limits [rad or m].
        count: how many movements.
        rng: for the draw.
    """
    strata = np.tile(np.arange(count)[:, None], (1, len(lower)))
    even = (rng.permuted(strata, axis=0) + rng.random(strata.shape)) / count
    share = np.where(upper - lower < _AROUND, np.sin(np.pi / 2 * even) ** 2, even)
    return lower + share * (upper - lower)
