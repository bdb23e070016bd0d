"""Perceptrons with online back-propagation (Mahboob 2015, sections 1.4.2 and 4.3).

Sigmoid units on hidden and output layers, biases, no momentum, one sample at a time. No hidden layer is the thesis's
single-layer perceptron. Training starts from a network over-fitted on the home posture, which makes the initial
weights immaterial (section 4.3).

`refined` goes beyond the thesis, which does not tell its scaling, in three things: inputs in [-1, 1]; an output margin,
since most visited postures have a joint at its limit, which a sigmoid reaches only at infinity; and answers from
averaged weights, since the last few lines explored pull the present ones their way (the thesis's "cycles of biased
exploration", section 4.4.2).
"""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from toddle.reach.learn.learner import Learner

_HOME_ROUNDS = 2000  # enough to bring every size of the thesis to under a thousandth of the range at home


class Layer(NamedTuple):
    """One layer's weights and biases."""

    weights: Float[Array, "out in"]
    bias: Float[Array, " out"]


class Layers(NamedTuple):
    """What a perceptron has learned: its present weights, and their running mean where one is kept."""

    now: tuple[Layer, ...]
    mean: tuple[Layer, ...] | None


class Perceptron(Learner):
    """A multi-layer perceptron, learning online.

    Attributes:
        learning_rate: alpha of equation 1.3 (the thesis's best: 0.717).
        hidden: units of each hidden layer; () is the single-layer perceptron.
        symmetric: inputs are scaled to [-1, 1]; else they are in [0, 1].
        margin: the output that stands for a joint's lower limit; its upper one is 1 - margin. 0 is the plain network.
        average: answers come from weights averaged over about so many movements; 0: from the present ones.
    """

    learning_rate: Float[Array, ""]
    hidden: tuple[int, ...] = eqx.field(static=True, default=(10,))
    symmetric: bool = eqx.field(static=True, default=False)
    margin: float = eqx.field(static=True, default=0.0)
    average: int = eqx.field(static=True, default=0)

    def init(self, key: jax.Array, home_x: Float[Array, " space"], home_q: Float[Array, " joints"]) -> Layers:
        """Small random weights, then over-fitted on home."""
        sizes = (len(home_x), *self.hidden, len(home_q))
        keys = jax.random.split(key, len(sizes) - 1)
        now = tuple(
            Layer(jax.random.uniform(k, (n_out, n_in), minval=-1, maxval=1) / jnp.sqrt(n_in), jnp.zeros(n_out))
            for k, n_in, n_out in zip(keys, sizes[:-1], sizes[1:], strict=True)
        )
        rehearse = lambda _, layers: self._descend(layers, home_x, home_q, jnp.float32(1.0))  # noqa: E731
        now = jax.lax.fori_loop(0, _HOME_ROUNDS, rehearse, now)
        return Layers(now, now if self.average else None)

    def predict(self, state: Layers, x: Float[Array, " space"]) -> Float[Array, " joints"]:
        """Joint values for a position, from the present weights."""
        return self._evaluate(state.now, x)

    def answer(self, state: Layers, x: Float[Array, " space"]) -> Float[Array, " joints"]:
        """Joint values for a position, from the averaged weights where they are kept."""
        return self._evaluate(state.now if state.mean is None else state.mean, x)

    def update(
        self,
        state: Layers,
        x: Float[Array, " space"],
        q: Float[Array, " joints"],
        weight: Float[Array, ""],
    ) -> Layers:
        """One step of gradient descent on |q - o|^2 / 2 (equations 1.2, 1.3, 1.6)."""
        now = self._descend(state.now, x, q, weight)
        if state.mean is None:
            return Layers(now, None)
        return Layers(now, jax.tree.map(lambda mean, new: mean + (new - mean) / self.average, state.mean, now))

    def _scaled(self, x: Float[Array, " space"]) -> Float[Array, " space"]:
        return 2.0 * x - 1.0 if self.symmetric else x

    def _evaluate(self, layers: tuple[Layer, ...], x: Float[Array, " space"]) -> Float[Array, " joints"]:
        x = self._scaled(x)
        for weights, bias in layers:
            x = jax.nn.sigmoid(weights @ x + bias)
        return (x - self.margin) / (1.0 - 2.0 * self.margin)

    def _descend(
        self,
        layers: tuple[Layer, ...],
        x: Float[Array, " space"],
        q: Float[Array, " joints"],
        weight: Float[Array, ""],
    ) -> tuple[Layer, ...]:
        activations = [self._scaled(x)]
        for weights, bias in layers:
            activations.append(jax.nn.sigmoid(weights @ activations[-1] + bias))
        output = activations[-1]
        wanted = self.margin + (1.0 - 2.0 * self.margin) * q
        delta = (wanted - output) * output * (1.0 - output)
        rate = self.learning_rate * weight
        updated: list[Layer] = []
        for (weights, bias), below in zip(reversed(layers), reversed(activations[:-1]), strict=True):
            updated.append(Layer(weights + rate * jnp.outer(delta, below), bias + rate * delta))
            delta = (delta @ weights) * below * (1.0 - below)
        return tuple(reversed(updated))


def refined(learning_rate: Float[Array, ""], hidden: tuple[int, ...]) -> Perceptron:
    """A perceptron with our three refinements; the values are those that did best on NICU, judged on fresh seeds."""
    return Perceptron(learning_rate, hidden, symmetric=True, margin=0.25, average=2000)
