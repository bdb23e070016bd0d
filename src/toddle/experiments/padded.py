"""Perceptrons of different sizes in one program: the smaller are padded with silent hidden units.

The size of a layer is part of a compiled program, and compiling takes longer than a whole cell of a study. A hidden
unit whose bias is far below zero answers exactly 0, passes no error back and never changes, so a padded perceptron
learns exactly as one without padding does.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from toddle.reach.learn.learner import Learner
from toddle.reach.learn.perceptron import Layer, Perceptron

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

    def init(
        self, key: jax.Array, home_x: Float[Array, " space"], home_q: Float[Array, " joints"]
    ) -> tuple[Layer, ...]:
        """Silence the padding, then over-fit on home again."""
        state = silence(self.perceptron.init(key, home_x, home_q), self.units)
        rehearse = lambda _, layers: self.update(layers, home_x, home_q, jnp.float32(1.0))  # noqa: E731
        return jax.lax.fori_loop(0, _REHEARSALS, rehearse, state)

    def predict(self, state: tuple[Layer, ...], x: Float[Array, " space"]) -> Float[Array, " joints"]:
        """Joint values for a position, each in (0, 1)."""
        return self.perceptron.predict(state, x)

    def update(
        self,
        state: tuple[Layer, ...],
        x: Float[Array, " space"],
        q: Float[Array, " joints"],
        weight: Float[Array, ""],
    ) -> tuple[Layer, ...]:
        """One step of online back-propagation."""
        return self.perceptron.update(state, x, q, weight)


def silence(layers: tuple[Layer, ...], units: Int[Array, ""]) -> tuple[Layer, ...]:
    """The layers with only the first hidden units awake; a perceptron without hidden layers stays as it is."""
    if len(layers) == 1:
        return layers
    (weights, bias), (out, out_bias) = layers
    awake = jnp.arange(len(bias)) < units
    return (
        (jnp.where(awake[:, None], weights, 0.0), jnp.where(awake, bias, _SILENT)),
        (jnp.where(awake, out, 0.0), out_bias),
    )


def padded(learner: Perceptron, units: Int[Array, ""], learning_rate: Float[Array, ""]) -> PaddedPerceptron:
    """A perceptron with these units awake, at this learning rate; both may be traced."""
    return PaddedPerceptron(eqx.tree_at(lambda p: p.learning_rate, learner, learning_rate), units)
