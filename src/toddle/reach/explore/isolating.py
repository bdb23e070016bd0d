"""First movements that show each joint by itself.

From home one joint after the other goes to a few places while the others stay, so that the tip draws a circle, a line,
or, where a motor drives more than one axis, neither. A fit of unknown screws starts from these.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

PLACES = 4
"""Movements of each joint: three points make a circle, two more show whether it is one."""

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
    movements = np.tile(home, (LOOKS + PLACES * len(home), 1)).astype(float)
    for joint in range(len(home)):
        places = np.linspace(low[joint], high[joint], 2 * PLACES + 1)[1::2]
        places[0], places[-1] = low[joint], high[joint]
        first = LOOKS + PLACES * joint
        movements[first : first + PLACES, joint] = places
    return movements
