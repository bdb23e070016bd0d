"""What is made small: how wrong the command is, and what else the network tells."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from toddle.navigate.cloning import commands
from toddle.navigate.cloning.config import CloningConfig
from toddle.navigate.cloning.heads import heads_loss
from toddle.navigate.cloning.network import Network, unrolled, velocity


class Losses(NamedTuple):
    """Means over the looks that count.

    Attributes:
        total: what is made small.
        command: entropy of the levels [nats], the document's: squares of shares of the greatest velocities.
        heads: see `heads`.
        ahead: mean error of the velocity ahead [m/s].
        turning: of the turning one [rad/s].
    """

    total: Float[Array, ""]
    command: Float[Array, ""]
    heads: Float[Array, ""]
    ahead: Float[Array, ""]
    turning: Float[Array, ""]


class Given(NamedTuple):
    """What a network is shown, and what is right.

    Attributes:
        frames: see `frames`.
        felt: shares of the greatest velocities.
        taught: velocity ahead [m/s], turning [rad/s].
        labels: see `labels`.
        fresh: an episode begins with it.
        weight: how much it counts.
    """

    frames: Float[Array, "streams steps 60 80 5"]
    felt: Float[Array, "streams steps 2"]
    taught: Float[Array, "streams steps 2"]
    labels: Float[Array, "streams steps labels"]
    fresh: Bool[Array, "streams steps"]
    weight: Float[Array, "streams steps"]


def losses(
    net: Network, memory: Float[Array, "streams 2 units"], given: Given, config: CloningConfig
) -> tuple[Losses, Float[Array, "streams 2 units"]]:
    """How wrong it is, and what it remembers in the end."""
    streams, steps = given.fresh.shape
    flat = given.frames.reshape(streams * steps, *given.frames.shape[2:])
    features = net.features(flat, given.felt.reshape(streams * steps, -1)).reshape(streams, steps, -1)
    fresh = given.fresh if config.memory else jnp.ones_like(given.fresh)
    remembered, memory = unrolled(net, features, fresh, memory)
    said, told = net.answer(remembered)
    command = command_loss(said, given.taught, config)
    heads = heads_loss(told, given.labels)
    off = jnp.abs(velocity(config, said) - given.taught)
    parts = (command, heads, off[..., 0], off[..., 1])
    command, heads, ahead, turning = ((part * given.weight).sum() / given.weight.sum() for part in parts)
    total = command + (config.heads_weight * heads if config.heads else 0.0)
    return Losses(total, command, heads, ahead, turning), memory


def command_loss(
    said: Float[Array, "*rows said"], taught: Float[Array, "*rows 2"], config: CloningConfig
) -> Float[Array, "*rows"]:
    """How wrong what it says is about each look."""
    if config.network == "document":
        return ((velocity(config, said) - taught) ** 2 / _greatest(config, taught.shape) ** 2).mean(axis=-1)
    ahead, turning = commands.levels(config)
    found = zip(jnp.split(said, [len(ahead)], axis=-1), (ahead, turning), (0, 1), strict=True)
    return sum(
        (
            -(commands.shares(taught[..., part], steps) * jax.nn.log_softmax(logits)).sum(axis=-1)
            for logits, steps, part in found
        ),
        start=jnp.zeros(taught.shape[:-1], jnp.float32),
    )


def _greatest(config: CloningConfig, shape: tuple[int, ...]) -> Float[Array, "*rows 2"]:
    return jnp.broadcast_to(jnp.array([config.ahead[1], config.turning], jnp.float32), shape)
