"""First movements that show each joint by itself.

From home one joint after the other goes to a few places while the others stay, so that the tip draws a circle, a line,
or, where a motor drives more than one axis, neither. A fit of unknown screws starts from these.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

_PLACES = np.array([0.0, 0.29, 0.73, 1.0])
"""Of each joint, within its range: three points make a circle, two more show whether it is one, and uneven distances
keep an encoder from looking as if it turned some whole turns more from place to place."""

LOOKS = 3
"""How often home is looked at: all joints' movements hang on it, and one look may be wild."""


def isolating_movements(
    lower: Float[np.ndarray, " joints"], upper: Float[np.ndarray, " joints"], home: Float[np.ndarray, " joints"]
) -> Float[np.ndarray, "movements joints"]:
    """Home three times, then every joint by itself at four places across its range, at most half a turn from home.

    Args:
        lower: lower limits [rad or m].
        upper: upper limits [rad or m].
        home: where all joints but one stay [rad or m].
    """
    low, high = np.maximum(lower, home - np.pi), np.minimum(upper, home + np.pi)
    movements = np.tile(home, (LOOKS + len(_PLACES) * len(home), 1)).astype(float)
    for joint in range(len(home)):
        first = LOOKS + len(_PLACES) * joint
        movements[first : first + len(_PLACES), joint] = low[joint] + _PLACES * (high[joint] - low[joint])
    return movements
