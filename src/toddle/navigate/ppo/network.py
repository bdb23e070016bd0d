"""The networks: an actor and a critic that share nothing (Huber 2019, sections 4.3.1 and 4.3.2).

Each is a stack of layers, with a recurrent one (LSTM, Hochreiter and Schmidhuber 1997) behind them where memory is
asked for. All functions take one observation; map them over a batch.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.distribution import Bound, Categorical, Distribution, Gaussian
from toddle.navigate.task import Actions, Continuous


class Layers(eqx.Module):
    """Layers, a memory if there is one, and a linear answer.

    Attributes:
        weights: of the hidden layers and of the answer.
        biases: likewise.
        cell: the recurrent layer, or None.
        activation: of the hidden layers.
    """

    weights: tuple[Float[Array, "_ _"], ...]
    biases: tuple[Float[Array, " _"], ...]
    cell: eqx.nn.LSTMCell | None
    activation: Literal["tanh", "relu"] = eqx.field(static=True)

    def __call__(
        self, x: Float[Array, " inputs"], memory: Float[Array, "2 units"]
    ) -> tuple[Float[Array, " outputs"], Float[Array, "2 units"]]:
        """The answer and the new memory: its output and its cell."""
        squash = jnp.tanh if self.activation == "tanh" else jax.nn.relu
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            x = squash(x @ weight + bias)
        if self.cell is not None:
            memory = jnp.stack(self.cell(x, (memory[0], memory[1])))
            x = memory[0]
        return x @ self.weights[-1] + self.biases[-1], memory


class ActorCritic(eqx.Module):
    """What is learned.

    Attributes:
        actor: from an observation to the mean of an action, or to logits.
        critic: to the value: the discounted sum of rewards to come.
        log_deviation: of continuous actions, whatever the observation; empty for discrete ones.
        bound: how continuous actions are kept in range.
        discrete: whether actions are whole numbers.
    """

    actor: Layers
    critic: Layers
    log_deviation: Float[Array, " size"]
    bound: Bound = eqx.field(static=True)
    discrete: bool = eqx.field(static=True)

    def __call__(
        self, observation: Float[Array, " numbers"], memory: Float[Array, "2 2 units"]
    ) -> tuple[Distribution, Float[Array, ""], Float[Array, "2 2 units"]]:
        """The policy (2.127), the value, and the new memories of actor and critic."""
        given, of_actor = self.policy(observation, memory[0])
        value, of_critic = self.critic(observation, memory[1])
        return given, value[0], jnp.stack([of_actor, of_critic])

    def policy(
        self, observation: Float[Array, " numbers"], memory: Float[Array, "2 units"]
    ) -> tuple[Distribution, Float[Array, "2 units"]]:
        """The policy alone."""
        answer, memory = self.actor(observation, memory)
        if self.discrete:
            return Categorical(answer), memory
        mean = jnp.tanh(answer) if self.bound == "mean" else answer
        return Gaussian(mean, self.log_deviation), memory


def actor_critic(config: PpoConfig, observations: int, actions: Actions, key: PRNGKeyArray) -> ActorCritic:
    """Untrained networks: orthogonal weights, the actor's answer near zero (Engstrom et al. 2020)."""
    of_actor, of_critic = jax.random.split(key)
    discrete = not isinstance(actions, Continuous)
    answers = actions.size if isinstance(actions, Continuous) else actions.count
    deviations = jnp.full(0 if discrete else answers, math.log(config.deviation), jnp.float32)
    actor = _layers(config, observations, answers, 0.01, of_actor)
    critic = _layers(config, observations, 1, 1.0, of_critic)
    return ActorCritic(actor, critic, deviations, config.bound, discrete)


def forgotten(config: PpoConfig) -> Float[Array, "2 2 units"]:
    """What is known at the start of an episode: of actor and critic, output and cell; of no units without memory."""
    return jnp.zeros((2, 2, config.memory), jnp.float32)


def _layers(config: PpoConfig, inputs: int, outputs: int, gain: float, key: PRNGKeyArray) -> Layers:
    keys = jax.random.split(key, len(config.hidden) + 2)
    sizes = [inputs, *config.hidden]
    shapes = [*pairwise(sizes), (config.memory or sizes[-1], outputs)]
    gains = [math.sqrt(2)] * len(config.hidden) + [gain]
    weights = tuple(
        jax.nn.initializers.orthogonal(scale)(one, shape, jnp.float32)
        for scale, one, shape in zip(gains, keys[:-1], shapes, strict=True)
    )
    biases = tuple(jnp.zeros(shape[1], jnp.float32) for shape in shapes)
    cell = eqx.nn.LSTMCell(sizes[-1], config.memory, key=keys[-1]) if config.memory else None
    return Layers(weights, biases, cell, config.activation)
