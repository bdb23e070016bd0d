"""What a learned body is: a forward model that knows its slope and how wrong it may be.

Physical units throughout, in float64: radians or metres in, metres out, a batch at a time. A model is a frozen value;
who fits it returns a `Fit`. Models meet the solvers here and nowhere else.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

Joints = Float[np.ndarray, "batch joints"]


@runtime_checkable
class Model(Protocol):
    """Where a learned body puts its tip."""

    @property
    def space(self) -> int:
        """How many coordinates the tip's position has."""
        ...

    def forward(self, q: Joints) -> Float[np.ndarray, "batch space"]:
        """Tip positions [m] for joint values [rad or m]."""
        ...

    def slope(self, q: Joints) -> tuple[Float[np.ndarray, "batch space"], Float[np.ndarray, "batch space joints"]]:
        """Tip positions [m], and how they change with the joint values [m / rad, or m / m]."""
        ...

    def spread(self, q: Joints) -> Float[np.ndarray, "batch space space"]:
        """Covariance of what the model may be wrong by at each posture [m^2]; the noise of looking is not in it."""
        ...


@runtime_checkable
class PoseModel(Model, Protocol):
    """A model that knows the tip's orientation, too."""

    def pose(self, q: Joints) -> Float[np.ndarray, "batch 4 4"]:
        """Homogeneous transforms from the base to the tip [m]."""
        ...

    def pose_slope(self, q: Joints) -> tuple[Float[np.ndarray, "batch 4 4"], Float[np.ndarray, "batch 6 joints"]]:
        """The transforms, and the geometric Jacobian in the base frame: three rows shift [m], three turn [rad]."""
        ...


@dataclass(frozen=True)
class Fit:
    """A model, and how it sits in the movements that it was fitted to.

    Attributes:
        model: the learned body.
        kind: its structure: "screws", "multilinear", "curvature", "kernel" or "network".
        miss: distance between the seen and the modelled tip in each movement [m].
        sensor: standard deviation of the seen tip on each axis, as estimated from the fit [m].
        wild: movements that the fit left out as outliers.
        seconds: how long it took.
        notes: what was found, a sentence each, for the person who runs it ("joint wrist slides").
    """

    model: Model
    kind: str
    miss: Float[np.ndarray, " movements"]
    sensor: float
    wild: Bool[np.ndarray, " movements"]
    seconds: float
    notes: tuple[str, ...] = ()
