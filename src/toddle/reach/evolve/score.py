"""What a controller is worth: the mean squared distance between goals and where its answers bring the tip.

The document writes a sum over the goals (EvaluateIndividual) and prints figures that only a mean explains: SCARA runs
end at 810.9, and that is the mean squared distance of the best constant answer. So it is a mean here.

Forward kinematics is all that is asked of the robot. Hundreds of thousands of postures are asked for at a time, so
positions are carried from the tip to the base, coordinate by coordinate, without any transform.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from toddle.reach.evolve.controller import Scale
from toddle.robots.chain import Chain
from toddle.robots.linkage import Linkage, linkage_of

_POSTURES = 20_000  # from which a workspace is measured


@dataclass(frozen=True)
class Arm:
    """A robot as evolution sees it.

    Attributes:
        linkage: its constants.
        coordinates: which of x, y, z are its tip's position.
        lower, upper: limits of its joints [rad or m].
    """

    linkage: Linkage
    coordinates: tuple[int, ...]
    lower: Float[np.ndarray, " joints"]
    upper: Float[np.ndarray, " joints"]

    @property
    def joints(self) -> Scale:
        """Outputs of -1 to 1 over each joint's range."""
        return Scale((self.lower + self.upper) / 2, (self.upper - self.lower) / 2)

    def drawn(self, count: int, seed: int) -> Float[np.ndarray, "count space"]:
        """Positions that it can reach: those of postures uniform over the joints' ranges [m]."""
        share = np.random.default_rng(seed).random((len(self.lower), count))
        q = self.lower[:, None] + (self.upper - self.lower)[:, None] * share
        return tips(self, q).T

    def workspace(self) -> Scale:
        """The box around what it can reach, as -1 to 1 [m]."""
        reached = self.drawn(_POSTURES, 0)
        low, high = reached.min(axis=0), reached.max(axis=0)
        return Scale((low + high) / 2, (high - low) / 2)


def arm_of(chain: Chain) -> Arm:
    """A chain as evolution sees it."""
    return Arm(
        linkage_of(chain), tuple(chain.coordinates), np.asarray(chain.lower, float), np.asarray(chain.upper, float)
    )


def tips(arm: Arm, q: Float[np.ndarray, "joints *many"]) -> Float[np.ndarray, "space *many"]:
    """Tip positions [m] for joint values [rad or m], in their precision; joints and coordinates come first."""
    linkage, kind = arm.linkage, q.dtype
    flat = q.reshape(len(q), -1)
    motion = linkage.gain.astype(kind) @ flat + linkage.offset.astype(kind)[:, None]
    x, y, z = (np.full(flat.shape[1], value, kind) for value in linkage.tip[:3, 3])
    for axis in reversed(range(len(motion))):
        if linkage.slides[axis]:
            z = z + motion[axis]
        else:
            c, s = np.cos(motion[axis]), np.sin(motion[axis])
            x, y = c * x - s * y, s * x + c * y
        x, y, z = _moved(linkage.before[axis], x, y, z)
    return np.stack([(x, y, z)[k] for k in arm.coordinates]).reshape(-1, *q.shape[1:])


def scores(
    arm: Arm, q: Float[np.ndarray, "controllers joints goals"], goals: Float[np.ndarray, "goals space"]
) -> Float[np.ndarray, " controllers"]:
    """Mean over the goals of the squared distance [m^2]."""
    missed = tips(arm, q.transpose(1, 0, 2)) - goals.T.astype(q.dtype)[:, None]
    return np.einsum("scg,scg->c", missed, missed).astype(float) / len(goals)


def _moved(transform: Float[np.ndarray, "4 4"], *point: Float[np.ndarray, " many"]) -> list[Float[np.ndarray, " many"]]:
    """A rigid transform of points given by coordinate; what multiplies by 0 or 1 is left out."""
    moved = []
    for row in transform[:3]:
        terms = [
            value if part == 1 else part.astype(value.dtype) * value
            for part, value in zip(row, point, strict=False)
            if part
        ]
        total = sum(terms[1:], terms[0]) if terms else np.zeros_like(point[0])
        moved.append(total + row[3].astype(total.dtype) if row[3] else total)
    return moved
