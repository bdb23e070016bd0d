"""A network that learned by watching, at the stick: it sees, and knows what velocity it walks at."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from toddle.failures import BadInput
from toddle.navigate.cloning.policy import Cloned
from toddle.navigate.driver import Situation
from toddle.navigate.sight import PERIOD
from toddle.signals import Velocity


@dataclass(frozen=True, eq=False)
class Clone:
    """A `toddle.navigate.driver.Driver` of a network.

    Attributes:
        policy: decides.
    """

    policy: Cloned

    @property
    def period(self) -> float:
        """As in training [s]."""
        return PERIOD

    def start(self) -> Array:
        """The network's own memory."""
        return self.policy.start()

    def decide(self, memory: Array, situation: Situation) -> tuple[Velocity, Array]:
        """What the network says; what is not finite asks to stand.

        Raises:
            BadInput: nobody looks.
        """
        sight = situation.sight
        if sight is None:
            raise BadInput("nobody looks", where="policy", remedy="give the robot eyes: it steers by what it sees")
        felt = np.array([situation.velocity.vx, situation.velocity.omega], np.float32)
        depth = np.nan_to_num(sight.depth, nan=0.0, posinf=0.0, neginf=0.0).astype(np.float32)
        said, memory = _decision(self.policy)(sight.picture, depth, felt, memory)
        ahead, turning = np.asarray(said).astype(float).tolist()
        return Velocity(ahead, 0.0, turning), memory


@lru_cache(maxsize=8)
def _decision(policy: Cloned) -> Callable[..., Any]:
    """One compiled decision of a policy, its weights inside."""
    compiled = jax.jit(policy.__call__)

    def decision(picture: Any, depth: Any, felt: Any, memory: Any) -> Any:
        return compiled(jnp.asarray(picture), jnp.asarray(depth), jnp.asarray(felt), memory)

    return decision
