"""What a body is: something that answers "where is the tip when the joints stand like this?".

Learners see pairs (q, x) and nothing else; they never look inside a body. A `Body` is a frozen JAX pytree, so
it runs under ``jit``, ``vmap`` and ``scan``; what can't (a plant in physics, a real robot, any callable)
answers the same question one call at a time (`Plant`).
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Protocol, runtime_checkable

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float


class Body(eqx.Module):
    """A robot arm, rigid or soft: named actuators with limits, a home, and forward kinematics."""

    name: eqx.AbstractVar[str]
    joints: eqx.AbstractVar[tuple[str, ...]]
    lower: eqx.AbstractVar[Float[Array, " joints"]]
    upper: eqx.AbstractVar[Float[Array, " joints"]]
    home: eqx.AbstractVar[Float[Array, " joints"]]

    @abstractmethod
    def forward(self, q: Float[Array, " joints"]) -> Float[Array, " space"]:
        """Tip position [m] in the base frame for actuator values q [rad or m]."""

    @property
    @abstractmethod
    def space(self) -> int:
        """How many coordinates the tip's position has: 2 in the plane, else 3."""


@runtime_checkable
class Plant(Protocol):
    """Whatever moves when it is told to, one movement at a time: physics, a real robot, a callable."""

    name: str
    joints: tuple[str, ...]
    lower: np.ndarray
    upper: np.ndarray
    home: np.ndarray

    def move(self, q: np.ndarray) -> np.ndarray:
        """Go to the joint values q [rad or m] and return the observed tip position [m]."""
        ...


@runtime_checkable
class Resumable(Protocol):
    """A plant whose state can be taken down and restored, so that an interrupted run goes on bit for bit."""

    def state(self) -> dict[str, np.ndarray]:
        """Everything that the next movement depends on, as arrays by name."""
        ...

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Go back to a state that was taken down."""
        ...
