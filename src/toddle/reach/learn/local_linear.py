"""The local linear map: linear pieces, blended by Gaussian responsibilities (Rolf, Steil and Gienger 2011).

    g(x) = sum_k b_k(x) g_k(x) / sum_k b_k(x),    b_k(x) = exp(-|x - p_k|^2 / d^2),
    g_k(x) = M_k (x - p_k) / d + o_k.

It starts as one piece that answers home everywhere. A new piece is put where the tip came further than d from all
prototypes, with the estimate's own value and slope there, so that the estimate stays as it is. Learning is gradient
descent on the weighted error w |q - g(x)|^2 of each sample.

Written with features phi = (b_k / sum b) [(x - p_k) / d, 1] the map is linear in its parameters, g = phi W, and a step
is W <- W + eta w phi (q - g). Only the nearest prototypes are touched: a further one counts for next to nothing, and
the time for a sample stays the same however many there are.
"""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from toddle.failures import BadInput
from toddle.reach.learn.learner import Learner

_FAR = 1e3  # where prototypes wait that are not placed yet, in the unit box: their responsibility is zero
_MOST = 4096


class LocalLinearState(NamedTuple):
    """The prototypes and their linear pieces; rows at and after `used` are not placed yet.

    Attributes:
        prototypes: p_k in the unit box.
        pieces: W: for each prototype the rows of M_k transposed, then o_k.
        used: how many prototypes there are.
    """

    prototypes: Float[Array, "capacity space"]
    pieces: Float[Array, "capacity features joints"]
    used: Int[Array, ""]


class LocalLinearMap(Learner):
    """A local linear map, learning online.

    Attributes:
        radius: d, the reach of a piece and the least distance of prototypes, as a fraction of the unit box.
        learning_rate: eta (Rolf 2011: 0.1).
        capacity: the most prototypes; when they are used up, the present ones go on learning.
        neighbours: how many of the nearest prototypes make an answer.
    """

    radius: Float[Array, ""]
    learning_rate: Float[Array, ""]
    capacity: int = eqx.field(static=True, default=512)
    neighbours: int = eqx.field(static=True, default=16)

    def init(self, key: jax.Array, home_x: Float[Array, " space"], home_q: Float[Array, " joints"]) -> LocalLinearState:
        """One piece that answers home everywhere (the key is not needed: nothing is random)."""
        del key
        space = len(home_x)
        pieces = jnp.zeros((self.capacity, space + 1, len(home_q)))
        return LocalLinearState(
            jnp.full((self.capacity, space), _FAR).at[0].set(home_x),
            pieces.at[0, space].set(home_q),
            jnp.int32(1),
        )

    def predict(self, state: LocalLinearState, x: Float[Array, " space"]) -> Float[Array, " joints"]:
        """Joint values for a position; not clipped to the limits."""
        features, rows = self._features(state, x)
        return jnp.einsum("kf,kfj->j", features, state.pieces[rows])

    def update(
        self,
        state: LocalLinearState,
        x: Float[Array, " space"],
        q: Float[Array, " joints"],
        weight: Float[Array, ""],
    ) -> LocalLinearState:
        """A new piece if x is far from all others, then one step of gradient descent."""
        state = self._grow(state, x)
        features, rows = self._features(state, x)
        error = q - jnp.einsum("kf,kfj->j", features, state.pieces[rows])
        # beyond all prototypes (they may be used up) features are large, and a full step would overshoot
        rate = self.learning_rate * weight / jnp.maximum(1.0, jnp.sum(features**2) / 2)
        step = rate * features[:, :, None] * error[None, None, :]
        return state._replace(pieces=state.pieces.at[rows].add(step, unique_indices=True))

    def _features(
        self, state: LocalLinearState, x: Float[Array, " space"]
    ) -> tuple[Float[Array, "near features"], Int[Array, " near"]]:
        """phi of the nearest prototypes, and which they are."""
        offset = (x[None] - state.prototypes) / self.radius
        nearness, rows = jax.lax.top_k(-jnp.sum(offset**2, axis=-1), min(self.neighbours, self.capacity))
        local = jnp.concatenate([offset[rows], jnp.ones((len(rows), 1))], axis=1)
        return jax.nn.softmax(nearness)[:, None] * local, rows

    def _grow(self, state: LocalLinearState, x: Float[Array, " space"]) -> LocalLinearState:
        """A new prototype at x if all others are at least d away: o = g(x), M = d dg/dx."""
        distance = jnp.min(jnp.sum((x[None] - state.prototypes) ** 2, axis=-1))
        grows = (distance >= self.radius**2) & (state.used < self.capacity)
        row = jnp.minimum(state.used, self.capacity - 1)
        # only one row passes through the condition, so that the tables are never copied
        piece = jax.lax.cond(grows, lambda: self._tangent(state, x), lambda: state.pieces[row])
        place = jnp.where(grows, x, state.prototypes[row])
        return LocalLinearState(
            state.prototypes.at[row].set(place),
            state.pieces.at[row].set(piece),
            state.used + grows.astype(jnp.int32),
        )

    def _tangent(self, state: LocalLinearState, x: Float[Array, " space"]) -> Float[Array, "features joints"]:
        """The piece that agrees with the estimate at x in value and slope."""
        value = self.predict(state, x)
        slope = jax.jacfwd(lambda at: self.predict(state, at))(x)
        return jnp.concatenate([self.radius * slope.T, value[None]])


def local_linear_map(
    space: int, *, radius: float = 0.05, learning_rate: float = 0.1, neighbours: int = 16
) -> LocalLinearMap:
    """A local linear map with room for as many prototypes as the unit box can hold.

    Args:
        space: how many coordinates a position has, 2 or 3.
        radius: d as a fraction of the unit box: 0.1 m on an arm whose workspace is 2 m wide is 0.05.
        learning_rate: eta, between 0 and 1.
        neighbours: how many of the nearest prototypes make an answer.

    Raises:
        BadInput: the radius is not in (0, 1], or the learning rate not in (0, 1].
    """
    for what, value in (("radius", radius), ("learning rate", learning_rate)):
        if not 0 < value <= 1:
            raise BadInput(f"the {what} is {value}", remedy="give a number above 0, at most 1")
    # points placed at random, d apart until none fits, come to about 0.7 in a cell of d x d (or d x d x d)
    capacity = min(_MOST, max(neighbours, int(0.75 * (1 / radius + 1) ** space)))
    return LocalLinearMap(jnp.float32(radius), jnp.float32(learning_rate), capacity, neighbours)
