"""The frozen records that travel between the stations.

Stations (robots, explorers, learners, solvers, evaluation) never meet each other; they meet here.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float


class Movement(NamedTuple):
    """One movement made and watched: what was commanded, where the tip went, what it was tried for.

    Every number is in the body's unit box: 0 and 1 are a joint's limits, or the edges of the workspace.
    A NamedTuple of arrays, so that it is a pytree: a chunk of movements is the same record with a leading axis.
    """

    q: Float[Array, "*batch joints"]
    x: Float[Array, "*batch space"]
    goal: Float[Array, "*batch space"]
    weight: Float[Array, "*batch"]


class Verdict(StrEnum):
    """How an answer ended."""

    REACHED = "reached"
    OUT_OF_REACH = "out of reach"
    AT_JOINT_LIMIT = "at a joint limit"
    NOT_CONVERGED = "not converged"


@dataclass(frozen=True)
class Solution:
    """An answer to "which joint angles bring the tip there?".

    Attributes:
        q: joint values, within the limits [rad, or m for a sliding joint].
        expected_error: the distance to expect between the tip and the target [m].
        steps: movements made to find it (0: open loop, the first answer).
        verdict: how it ended.
        reason: one sentence that explains the verdict.
    """

    q: np.ndarray
    expected_error: float
    steps: int
    verdict: Verdict
    reason: str
