"""What the robot's eyes tell who steers it, and the truth that is kept beside it for teachers and judges."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Float32, Int, UInt8

from toddle.navigate.scenarios.rooms import Hall

ROWS, COLUMNS = 60, 80
"""Of the small picture that policies see (Huber 2019, figure 4.15)."""

PERIOD = 0.2
"""A policy that sees decides so often [s]."""


class Sight(NamedTuple):
    """One look.

    Attributes:
        picture: of the left camera: red, green, blue.
        depth: along the optical axis [m]; 0 where it is not known.
    """

    picture: UInt8[np.ndarray, "60 80 3"]
    depth: Float32[np.ndarray, "60 80"]


class Showing(NamedTuple):
    """The truth at a look, in the room's frame. A fair teacher uses of it only things that show, or have shown.

    Attributes:
        place: x, y [m] and yaw [rad] of the waist.
        circles: x, y, radius [m] of the target, the other things and the people, where they are now.
        pixels: how many pixels of the small picture show each of these.
        hall: the walls; None: nobody tells.
    """

    place: Float[np.ndarray, "3"]
    circles: Float[np.ndarray, "things 3"]
    pixels: Int[np.ndarray, " things"]
    hall: Hall | None = None
