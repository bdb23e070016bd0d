"""The network that steers: eyes, a memory (LSTM, Hochreiter and Schmidhuber 1997), and linear answers.

The light one also feels what velocity it walks at, answers with levels of velocity (`commands`), and tells what it
knows (`heads`). The document's sees alone, and answers with tanh of both velocities.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from toddle.navigate.cloning import commands
from toddle.navigate.cloning.config import CloningConfig
from toddle.navigate.cloning.frames import PARTS
from toddle.navigate.cloning.labels import LABELS
from toddle.navigate.cloning.light import LightEyes, light_eyes
from toddle.navigate.cloning.unet import UNetEyes, unet_eyes

FELT = 2
"""Numbers of a felt velocity: ahead and turning, as shares of the greatest."""

FEATURES = 32
"""Of the document's eyes."""

_COLOURS_AND_DEPTH = 4


class Answer(NamedTuple):
    """What a network says to looks.

    Attributes:
        said: logits of the levels ahead, then of those turning; the document's: tanh of both.
        told: as `labels` has them; probabilities as logits.
    """

    said: Float[Array, "*rows said"]
    told: Float[Array, "*rows labels"]


class Network(eqx.Module):
    """What is learned.

    Attributes:
        eyes: from pictures to features.
        cell: the memory.
        steer: from the memory to what it says.
        tell: from the memory to what it tells.
        bias: of both.
        kind: light or document.
        depth: whether it sees how far things are.
    """

    eyes: LightEyes | UNetEyes
    cell: eqx.nn.LSTMCell
    steer: Float[Array, "units said"]
    tell: Float[Array, "units labels"]
    bias: tuple[Float[Array, " said"], Float[Array, " labels"]]
    kind: Literal["light", "document"] = eqx.field(static=True)
    depth: bool = eqx.field(static=True)

    def features(
        self, frames: Float[Array, "looks 60 80 5"], felt: Float[Array, "looks 2"]
    ) -> Float[Array, "looks features"]:
        """Of looks, without memory."""
        if not self.depth:
            frames = frames.at[..., 3:].set(0.0)
        if self.kind == "document":
            return self.eyes(frames[..., :_COLOURS_AND_DEPTH])
        return jnp.concatenate([self.eyes(frames), felt], axis=-1)

    def remember(self, features: Float[Array, " features"], memory: Float[Array, "2 units"]) -> Float[Array, "2 units"]:
        """The memory after a look: its output and its cell."""
        return jnp.stack(self.cell(features, (memory[0], memory[1])))

    def answer(self, remembered: Float[Array, "*rows units"]) -> Answer:
        """What it says and tells by what it remembers."""
        said, told = (
            remembered @ weight + jnp.broadcast_to(bias, (*remembered.shape[:-1], len(bias)))
            for weight, bias in zip((self.steer, self.tell), self.bias, strict=True)
        )
        return Answer(jnp.tanh(said) if self.kind == "document" else said, told)


def network(config: CloningConfig, key: PRNGKeyArray) -> Network:
    """An untrained one; its answers are near zero."""
    of_eyes, of_cell, of_steer, of_tell = jax.random.split(key, 4)
    if config.network == "document":
        eyes, features = unet_eyes(_COLOURS_AND_DEPTH, config.channels, config.hidden, FEATURES, of_eyes), FEATURES
        said = 2
    else:
        eyes, features = light_eyes(PARTS, config.channels, config.hidden, of_eyes), config.hidden + FELT
        said = sum(config.levels)
    cell = eqx.nn.LSTMCell(features, config.units, key=of_cell)
    small = jax.nn.initializers.orthogonal(0.1)
    steer, tell = (small(one, (config.units, n), jnp.float32) for one, n in ((of_steer, said), (of_tell, LABELS)))
    bias = jnp.zeros(said, jnp.float32), jnp.zeros(LABELS, jnp.float32)
    return Network(eyes, cell, steer, tell, bias, config.network, config.depth)


def unrolled(
    net: Network,
    features: Float[Array, "streams steps features"],
    fresh: Bool[Array, "streams steps"],
    memory: Float[Array, "streams 2 units"],
) -> tuple[Float[Array, "streams steps units"], Float[Array, "streams 2 units"]]:
    """What is remembered at each look, and in the end.

    Args:
        net: the network.
        features: of each look.
        fresh: an episode begins there: nothing of what was before is remembered.
        memory: at the start.
    """

    def look(state: Array, now: tuple[Array, Array]) -> tuple[Array, Array]:
        seen, anew = now
        state = jnp.where(jnp.broadcast_to(anew[:, None, None], state.shape), 0.0, state)
        state = jax.vmap(net.remember)(seen, state)
        return state, state[:, 0]

    memory, outputs = lax.scan(look, memory, (features.swapaxes(0, 1), fresh.T))
    return outputs.swapaxes(0, 1), memory


def velocity(config: CloningConfig, said: Float[Array, "*rows said"]) -> Float[Array, "*rows 2"]:
    """What it says as velocities ahead [m/s] and turning [rad/s]."""
    if config.network == "document":
        greatest = jnp.array([config.ahead[1], config.turning], jnp.float32)
        return said * jnp.broadcast_to(greatest, said.shape)
    ahead, turning = commands.levels(config)
    count = len(ahead)
    return jnp.stack([commands.mean(said[..., :count], ahead), commands.likeliest(said[..., count:], turning)], axis=-1)
