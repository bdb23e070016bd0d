"""Remembered movements: answer with the nearest movement seen, moved on along its neighbours (lazy, local learning).

Nothing is averaged: where an arm reaches a place in several ways, each is remembered for itself, and an answer comes
from one of them. To answer for x, take the movement (q_0, x_0) whose tip came nearest; fit the slope J of forward
kinematics there to the movements with postures most like q_0 (locally weighted regression, Atkeson, Moore and Schaal
1997); and move by the smallest step dq within the joint limits with J dq = x - x_0.
"""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from toddle.failures import BadInput
from toddle.reach.learn.learner import Learner

_FAR = 1e3  # where rows wait that are not filled yet: no target is near them
_RIDGE = 1e-3  # of the regression, relative to the spread of the neighbours
_DAMPING = 1e-3  # of the step, relative to the slope's own size
_PASSES = 3  # joints that meet a limit are held there, and the others take their share; so often


class Movements(NamedTuple):
    """Movements seen (unit box); the oldest are overwritten when all rows are filled.

    Attributes:
        q: joint values.
        x: where they brought the tip.
        seen: how many movements there were in all.
    """

    q: Float[Array, "capacity joints"]
    x: Float[Array, "capacity space"]
    seen: Int[Array, ""]


class Recall(Learner):
    """A memory of movements.

    Attributes:
        capacity: how many movements are kept; an answer takes time in proportion.
        neighbours: how many movements the slope is fitted to.
        largest: the most that an answer's joints differ from the remembered posture, as a fraction of their ranges.
    """

    capacity: int = eqx.field(static=True, default=20_000)
    neighbours: int = eqx.field(static=True, default=40)
    largest: float = eqx.field(static=True, default=0.15)

    def __check_init__(self) -> None:
        """Refuse a memory too small to fit a slope to."""
        if not 2 <= self.neighbours < self.capacity:
            raise BadInput(
                f"{self.neighbours} neighbours of {self.capacity} movements",
                remedy="keep more movements than neighbours, and take two or more",
            )

    def init(self, key: jax.Array, home_x: Float[Array, " space"], home_q: Float[Array, " joints"]) -> Movements:
        """Home is remembered (the key is not needed: nothing is random)."""
        del key
        return Movements(
            jnp.full((self.capacity, len(home_q)), _FAR).at[0].set(home_q),
            jnp.full((self.capacity, len(home_x)), _FAR).at[0].set(home_x),
            jnp.int32(1),
        )

    def predict(self, state: Movements, x: Float[Array, " space"]) -> Float[Array, " joints"]:
        """Joint values for a position, within the limits."""
        nearest = jnp.argmin(jnp.sum((x[None] - state.x) ** 2, axis=1))
        q, tip = state.q[nearest], state.x[nearest]
        return q + self._step(self._slope(state, q, tip), q, x - tip)

    def update(
        self,
        state: Movements,
        x: Float[Array, " space"],
        q: Float[Array, " joints"],
        weight: Float[Array, ""],
    ) -> Movements:
        """The movement is remembered, whatever its weight: it happened."""
        row = state.seen % self.capacity
        return Movements(state.q.at[row].set(q), state.x.at[row].set(x), state.seen + 1)

    def _slope(
        self, state: Movements, q: Float[Array, " joints"], x: Float[Array, " space"]
    ) -> Float[Array, "space joints"]:
        """dx/dq at a remembered movement, from those with postures most like its own."""
        nearness, rows = jax.lax.top_k(-jnp.sum((state.q - q[None]) ** 2, axis=1), self.neighbours + 1)
        filled = nearness > -_FAR
        reach = jnp.max(jnp.where(filled, -nearness, 0.0))
        weight = jnp.where(filled, jnp.exp(2 * nearness / jnp.maximum(reach, 1e-12)), 0.0)[:, None]
        dq = jnp.where(filled[:, None], state.q[rows] - q[None], 0.0)
        dx = jnp.where(filled[:, None], state.x[rows] - x[None], 0.0)
        spread = dq.T @ (weight * dq)
        ridge = (_RIDGE * jnp.trace(spread) / len(q) + 1e-9) * jnp.eye(len(q))
        return jnp.linalg.solve(spread + ridge, dq.T @ (weight * dx)).T

    def _step(
        self, slope: Float[Array, "space joints"], q: Float[Array, " joints"], miss: Float[Array, " space"]
    ) -> Float[Array, " joints"]:
        """The smallest step within the limits that the slope says brings the tip there."""
        damping = (_DAMPING * jnp.sum(slope**2) + 1e-9) * jnp.eye(len(miss))
        free, step = jnp.ones_like(q), jnp.zeros_like(q)
        for _ in range(_PASSES):
            held = step * (1 - free)
            reduced = slope * free[None]
            wanted = free * (reduced.T @ jnp.linalg.solve(reduced @ reduced.T + damping, miss - slope @ held))
            size = jnp.max(jnp.abs(wanted))
            # the limit of a step is no property of the slope: whoever asks for the slope of the answer gets it unscaled
            wanted = wanted * jax.lax.stop_gradient(jnp.minimum(1.0, self.largest / jnp.maximum(size, 1e-12)))
            within = jnp.clip(q + wanted + held, 0.0, 1.0) - q
            met = jnp.abs(within - wanted - held) > 1e-7
            step = jnp.where(met, within, wanted + held)
            free = jnp.where(met, 0.0, free)
        return step
