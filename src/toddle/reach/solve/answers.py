"""What every solver gives back: joint values for a batch of targets, and how far from them the model puts the tip."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float


class Answers(NamedTuple):
    """Answers for a batch of targets, within the joint limits.

    Attributes:
        q: joint values [rad or m].
        distance: from the target to where the model puts the tip [m].
        angle: between the orientation asked for and the modelled one [rad]; 0 where none was asked for.
        solved: whether both are within the solver's tolerance.
        held: joints that stand at a limit.
    """

    q: Float[np.ndarray, "batch joints"]
    distance: Float[np.ndarray, " batch"]
    angle: Float[np.ndarray, " batch"]
    solved: Bool[np.ndarray, " batch"]
    held: Bool[np.ndarray, "batch joints"]


class Answer(NamedTuple):
    """An answer for one target, within the joint limits; see `Answers`.

    Attributes:
        q: joint values [rad or m].
        distance: from the target to where the model puts the tip [m].
        angle: between the orientation asked for and the modelled one [rad]; 0 where none was asked for.
        solved: whether both are within the solver's tolerance.
    """

    q: Float[np.ndarray, " joints"]
    distance: float
    angle: float
    solved: bool
