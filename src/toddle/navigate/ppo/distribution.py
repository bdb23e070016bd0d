"""What a policy gives: a distribution over actions, to draw from, and to ask how likely an action was.

Continuous actions are Gaussian (Huber 2019, equation 4.3, for the entropy); discrete ones categorical. What is kept of
a drawn action is the number before it was clipped or squashed: the ratio of two policies' probabilities (2.129) is the
same before and after, since the Jacobian of the squashing cancels.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, PRNGKeyArray

Bound = Literal["clip", "tanh", "mean"]
"""How a continuous action is kept in its range; see `toddle.navigate.ppo.config.PpoConfig`."""


class Gaussian(NamedTuple):
    """Independent normal distributions.

    Attributes:
        mean: of each number.
        log_deviation: logarithm of its standard deviation.
    """

    mean: Float[Array, "*batch size"]
    log_deviation: Float[Array, "*batch size"]

    def sample(self, key: PRNGKeyArray) -> Float[Array, "*batch size"]:
        """Draw."""
        return self.mean + jnp.exp(self.log_deviation) * jax.random.normal(key, self.mean.shape)

    def mode(self) -> Float[Array, "*batch size"]:
        """The likeliest."""
        return self.mean

    def log_prob(self, action: Float[Array, "*batch size"]) -> Float[Array, "*batch"]:
        """Logarithm of the density."""
        away = (action - self.mean) * jnp.exp(-self.log_deviation)
        return -(0.5 * away**2 + self.log_deviation + 0.5 * math.log(2 * math.pi)).sum(axis=-1)

    def entropy(self) -> Float[Array, "*batch"]:
        """Differential entropy [nats] (4.3), summed over the numbers."""
        return (0.5 + 0.5 * math.log(2 * math.pi) + self.log_deviation).sum(axis=-1)


class Categorical(NamedTuple):
    """One of several.

    Attributes:
        logits: logarithms of the probabilities, up to a constant.
    """

    logits: Float[Array, "*batch count"]

    def sample(self, key: PRNGKeyArray) -> Int[Array, "*batch"]:
        """Draw."""
        return jax.random.categorical(key, self.logits).astype(jnp.int32)

    def mode(self) -> Int[Array, "*batch"]:
        """The likeliest."""
        return jnp.argmax(self.logits, axis=-1).astype(jnp.int32)

    def log_prob(self, action: Int[Array, "*batch"]) -> Float[Array, "*batch"]:
        """Logarithm of the probability."""
        return jnp.take_along_axis(jax.nn.log_softmax(self.logits), action[..., None], axis=-1)[..., 0]

    def entropy(self) -> Float[Array, "*batch"]:
        """Entropy [nats]."""
        log = jax.nn.log_softmax(self.logits)
        return -(jnp.exp(log) * log).sum(axis=-1)


Distribution = Gaussian | Categorical


def bounded(action: Array, bound: Bound) -> Array:
    """A drawn action as the task gets it: whole numbers as they are."""
    if not jnp.issubdtype(action.dtype, jnp.floating) or bound == "mean":
        return action
    return jnp.tanh(action) if bound == "tanh" else jnp.clip(action, -1.0, 1.0)


def entropy_of(given: Distribution, action: Array, bound: Bound) -> Float[Array, "*batch"]:
    """Entropy of what the task gets: where it is squashed, by the one sample that there is, as there is no formula.

    The sample moves with the distribution, so that the gradient too is that of the squashed entropy.
    """
    if not (isinstance(given, Gaussian) and bound == "tanh"):
        return given.entropy()
    deviation = jnp.exp(given.log_deviation)
    drawn = given.mean + deviation * jax.lax.stop_gradient((action - given.mean) / deviation)
    # log(1 - tanh(u)^2), in a form that stays finite
    shrunk = 2 * (math.log(2) - drawn - jax.nn.softplus(-2 * drawn))
    return given.entropy() + shrunk.sum(axis=-1)
