"""Perceptrons with online back-propagation (Mahboob 2015, sections 1.4.2 and 4.3).

Sigmoid units on hidden and output layers, biases, no momentum, one sample at a time. No hidden layer is the thesis's
single-layer perceptron. Training starts from a network over-fitted on the home posture, which makes the initial
weights immaterial (section 4.3).
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from toddle.reach.learn.learner import Learner

_HOME_ROUNDS = 2000  # enough to bring every size of the thesis to under a thousandth of the range at home

Layer = tuple[Float[Array, "out in"], Float[Array, " out"]]


class Perceptron(Learner):
    """A multi-layer perceptron, learning online.

    Attributes:
        learning_rate: alpha of equation 1.3 (the thesis's best: 0.717).
        hidden: units of each hidden layer; () is the single-layer perceptron.
    """

    learning_rate: Float[Array, ""]
    hidden: tuple[int, ...] = eqx.field(static=True, default=(10,))

    def init(
        self, key: jax.Array, home_x: Float[Array, " space"], home_q: Float[Array, " joints"]
    ) -> tuple[Layer, ...]:
        """Small random weights, then over-fitted on home."""
        sizes = (len(home_x), *self.hidden, len(home_q))
        keys = jax.random.split(key, len(sizes) - 1)
        layers = tuple(
            (jax.random.uniform(k, (n_out, n_in), minval=-1, maxval=1) / jnp.sqrt(n_in), jnp.zeros(n_out))
            for k, n_in, n_out in zip(keys, sizes[:-1], sizes[1:], strict=True)
        )
        rehearse = lambda _, state: self.update(state, home_x, home_q, jnp.float32(1.0))  # noqa: E731
        return jax.lax.fori_loop(0, _HOME_ROUNDS, rehearse, layers)

    def predict(self, state: tuple[Layer, ...], x: Float[Array, " space"]) -> Float[Array, " joints"]:
        """Joint values for a position, each in (0, 1)."""
        for weights, bias in state:
            x = jax.nn.sigmoid(weights @ x + bias)
        return x

    def update(
        self,
        state: tuple[Layer, ...],
        x: Float[Array, " space"],
        q: Float[Array, " joints"],
        weight: Float[Array, ""],
    ) -> tuple[Layer, ...]:
        """One step of gradient descent on |q - o|^2 / 2 (equations 1.2, 1.3, 1.6)."""
        activations = [x]
        for weights, bias in state:
            activations.append(jax.nn.sigmoid(weights @ activations[-1] + bias))
        output = activations[-1]
        delta = (q - output) * output * (1.0 - output)
        rate = self.learning_rate * weight
        updated: list[Layer] = []
        for (weights, bias), below in zip(reversed(state), reversed(activations[:-1]), strict=True):
            updated.append((weights + rate * jnp.outer(delta, below), bias + rate * delta))
            delta = (delta @ weights) * below * (1.0 - below)
        return tuple(reversed(updated))
