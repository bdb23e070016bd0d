"""Generalised advantage estimation (Huber 2019, equation 2.128; Schulman et al. 2016).

    delta_t = r_t + gamma V(s'_t) - V(s_t)          with V(s'_t) = 0 where the episode terminated
    A_t     = delta_t + gamma lambda A_{t+1}        with A_{t+1} = 0 where it ended, whatever the reason

s'_t is what was seen after the step, before a new episode began: where only the time was over, what would have
followed still counts by its value.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float


def advantages(
    rewards: Float[Array, "steps actors"],
    values: Float[Array, "steps actors"],
    after: Float[Array, "steps actors"],
    terminated: Bool[Array, "steps actors"],
    truncated: Bool[Array, "steps actors"],
    gamma: float | Float[Array, ""],
    lambda_: float | Float[Array, ""],
) -> Float[Array, "steps actors"]:
    """How much better each action was than expected.

    Args:
        rewards: of the steps, in their order.
        values: of the observations before them.
        after: of the observations after them.
        terminated: the episode ended with the step.
        truncated: it was cut off after the step.
        gamma: discount.
        lambda_: 0 trusts the values, 1 the rewards.
    """
    delta = rewards + gamma * jnp.where(terminated, 0.0, after) - values

    def back(later: Float[Array, " actors"], step: tuple[Array, Array]) -> tuple[Array, Array]:
        error, ended = step
        now = error + gamma * lambda_ * jnp.where(ended, 0.0, later)
        return now, now

    _, found = jax.lax.scan(back, jnp.zeros_like(delta[0]), (delta, terminated | truncated), reverse=True)
    return found
