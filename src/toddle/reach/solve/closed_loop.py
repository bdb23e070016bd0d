"""Observed correction in metres and radians: the learned inverse and whoever looks, brought together.

`toddle.reach.solve.correction` does the work, in the unit box.
"""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from toddle.reach.learn.learner import Learner, State
from toddle.reach.observe import Observe
from toddle.reach.solve.correction import correct
from toddle.reach.solve.memory import Memory
from toddle.reach.unit_box import UnitBox


def reach_for(
    box: UnitBox,
    learner: Learner,
    state: State,
    observe: Observe,
    targets: Float[np.ndarray, "points space"],
    looks: int,
    memory: Memory | None = None,
) -> tuple[Float[np.ndarray, "points joints"], Float[np.ndarray, "answers points"]]:
    """Reach for targets, looking where the tip went.

    Args:
        box: the unit box that the learner works in.
        learner: the learner.
        state: what it learned.
        observe: moves to joint values [rad or m] and says where the tip went [m].
        targets: where it should go [m].
        looks: how often an answer is corrected.
        memory: remembered movements to start from, where they came closer than the first answer.

    Returns:
        The best joint values tried [rad or m], and row by row the best error after 0 (open loop), 1, ... looks [m].
    """

    def seen(q: Float[Array, "points joints"]) -> Float[Array, "points space"]:
        return box.x_to_unit(jnp.asarray(observe(np.asarray(box.q_from_unit(q), float)), jnp.float32))

    units = box.x_to_unit(jnp.asarray(targets, jnp.float32))
    best = correct(eqx.Partial(learner.answer, state), seen, units, looks, scale=box.space_span, memory=memory)
    return np.asarray(box.q_from_unit(best.q), float), np.asarray(best.errors, float)
