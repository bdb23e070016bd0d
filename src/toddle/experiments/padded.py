"""Perceptrons of different sizes in one program: the smaller are padded with silent hidden units.

The size of a layer is part of a compiled program, and compiling takes longer than a whole cell of a study. A hidden
unit whose bias is far below zero answers exactly 0, passes no error back and never changes, so a padded perceptron
learns exactly as one without padding does.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from toddle.reach.learn.learner import Learner
from toddle.reach.learn.perceptron import Layer, Layers, Perceptron

_SILENT = -1e9
_REHEARSALS = 2000


class PaddedPerceptron(Learner):
    """A perceptron with one hidden layer, of which only the first units are awake.

    Attributes:
        perceptron: the learner with all its units.
        units: how many are awake.
    """

    perceptron: Perceptron
    units: Int[Array, ""]

    def init(self, key: jax.Array, home_x: Float[Array, " space"], home_q: Float[Array, " joints"]) -> Layers:
        """Silence the padding, then over-fit on home again."""
        state = silence(self.perceptron.init(key, home_x, home_q), self.units)
        rehearse = lambda _, layers: self.update(layers, home_x, home_q, jnp.float32(1.0))  # noqa: E731
        return jax.lax.fori_loop(0, _REHEARSALS, rehearse, state)

    def predict(self, state: Layers, x: Float[Array, " space"]) -> Float[Array, " joints"]:
        """Joint values for a position, from the present weights."""
        return self.perceptron.predict(state, x)

    def answer(self, state: Layers, x: Float[Array, " space"]) -> Float[Array, " joints"]:
        """Joint values for a position, from the averaged weights where they are kept."""
        return self.perceptron.answer(state, x)

    def update(
        self,
        state: Layers,
        x: Float[Array, " space"],
        q: Float[Array, " joints"],
        weight: Float[Array, ""],
    ) -> Layers:
        """One step of online back-propagation."""
        return self.perceptron.update(state, x, q, weight)


def silence(state: Layers, units: Int[Array, ""]) -> Layers:
    """The state with only the first hidden units awake; a perceptron without hidden layers stays as it is."""
    if len(state.now) == 1:
        return state
    (weights, bias), (out, out_bias) = state.now
    awake = jnp.arange(len(bias)) < units
    now = (
        Layer(jnp.where(awake[:, None], weights, 0.0), jnp.where(awake, bias, _SILENT)),
        Layer(jnp.where(awake, out, 0.0), out_bias),
    )
    return Layers(now, None if state.mean is None else now)
