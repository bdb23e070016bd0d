"""The training loop, for every network: one compiled gradient step at a time, from a value to the next.

order -> batch -> augment -> forward -> Adam -> ...
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from toddle.navigate.cloning import batches
from toddle.navigate.cloning.augment import Circumstances, Looks, augmented, drawn
from toddle.navigate.cloning.batches import Batch, Order
from toddle.navigate.cloning.config import CloningConfig
from toddle.navigate.cloning.episodes import Episode
from toddle.navigate.cloning.frames import Scale, frames, scale_of
from toddle.navigate.cloning.network import Network, network
from toddle.navigate.cloning.objective import Given, Losses, losses
from toddle.navigate.ppo.adam import Adam, at_rest, moved, shortened

_SAMPLE = 512  # looks that the scale is taken from
_FALLS = (0.7, 0.3), (0.88, 0.1)


class Learner(NamedTuple):
    """What changes with a gradient step.

    Attributes:
        network: what is learned.
        adam: its optimiser.
        memory: of each stream.
        key: of the augmentation.
    """

    network: Network
    adam: Adam
    memory: Float[Array, "streams 2 units"]
    key: PRNGKeyArray


class Training(NamedTuple):
    """A run between two gradient steps: all that it needs to go on bit for bit.

    Attributes:
        learner: what changes by gradients.
        scale: of the pictures.
        order: of the data.
    """

    learner: Learner
    scale: Scale
    order: Order


def blank(config: CloningConfig) -> Training:
    """A run of this configuration that has seen nothing: its shapes are those of any other."""
    net = network(config, jax.random.key(0))
    memory = jnp.zeros((config.streams, 2, config.units), jnp.float32)
    learner = Learner(net, at_rest(net), memory, jax.random.key(0, impl="rbg"))
    scale = Scale(jnp.zeros(4, jnp.float32), jnp.ones(4, jnp.float32))
    return Training(learner, scale, batches.windows_order(0))


def begin(config: CloningConfig, episodes: Sequence[Episode], seed: int) -> Training:
    """A run before its first step; the scale is that of these episodes."""
    of_network, of_learning = jax.random.split(jax.random.key(seed))
    net = network(config, of_network)
    memory = jnp.zeros((config.streams, 2, config.units), jnp.float32)
    noise = jax.random.key(int(jax.random.randint(of_learning, (), 0, 2**31 - 1)), impl="rbg")  # quick on CPUs
    learner = Learner(net, at_rest(net), memory, noise)
    return Training(learner, _scale(episodes, seed), _order(config, episodes, seed))


def with_episodes(training: Training, config: CloningConfig, episodes: Sequence[Episode], seed: int) -> Training:
    """The same run with other episodes, gone through from the start; weights, optimiser and scale stay."""
    forgotten = jnp.zeros_like(training.learner.memory)
    return training._replace(learner=training.learner._replace(memory=forgotten), order=_order(config, episodes, seed))


def step(
    training: Training, config: CloningConfig, episodes: Sequence[Episode], rate: float
) -> tuple[Training, Losses]:
    """One gradient step, with Adam at this rate."""
    batch, order = next_batch(training.order, config, episodes)
    key, own = jax.random.split(training.learner.key)
    under = drawn(config, *batch.fresh.shape, own)
    learner = training.learner._replace(key=key)
    learner, told = _stepped(config, learner, training.scale, batch, under, jnp.float32(rate))
    return Training(learner, training.scale, order), told


def rate_at(config: CloningConfig, done: int, updates: int) -> float:
    """Adam's rate after so many of all gradient steps."""
    factors = [factor for share, factor in _FALLS if done >= share * updates]
    return config.rate * (factors[-1] if factors and config.falls else 1.0)


def next_batch(order: Order, config: CloningConfig, episodes: Sequence[Episode]) -> tuple[Batch, Order]:
    """What comes next, and the order after it."""
    if config.network == "document":
        return batches.windows(order, episodes, config.streams, config.steps)
    return batches.streams(order, episodes, config.steps)


def validation(net: Network, scale: Scale, config: CloningConfig, episodes: Sequence[Episode]) -> Losses:
    """How wrong it is about episodes that it did not learn from, each from its start, all looks counting alike."""
    sums, count = np.zeros(len(Losses._fields)), 0
    for one in episodes:
        memory = jnp.zeros((1, 2, config.units), jnp.float32)
        for first in range(0, len(one.picture), config.steps):
            batch, here = _piece(one, first, config.steps)
            told, memory = _judged(config, net, scale, memory, batch)
            sums, count = sums + here * np.array(told), count + here
    return Losses(*(sums / max(count, 1)).tolist())


def _piece(one: Episode, first: int, steps: int) -> tuple[Batch, int]:
    """The looks from one on, filled up with its last; and how many they are."""
    here = min(steps, len(one.picture) - first)
    looks = np.minimum(np.arange(first, first + steps), len(one.picture) - 1)
    weight = (np.arange(steps) < here).astype(np.float32)
    fresh = np.arange(first, first + steps) == 0
    parts = (*(part[looks] for part in one[1:]), fresh, weight)
    return Batch(*(part[None] for part in parts)), here


def _scale(episodes: Sequence[Episode], seed: int) -> Scale:
    """Of some looks, evenly spread."""
    draw = np.random.default_rng([seed, 512])
    chosen = [episodes[number] for number in draw.integers(len(episodes), size=_SAMPLE).tolist()]
    at = [int(draw.integers(len(one.picture))) for one in chosen]
    pictures = np.stack([one.picture[look] for one, look in zip(chosen, at, strict=True)])
    depth = np.stack([one.depth[look] for one, look in zip(chosen, at, strict=True)]) / 1000.0
    return scale_of(pictures, depth)


def _order(config: CloningConfig, episodes: Sequence[Episode], seed: int) -> Order:
    document = config.network == "document"
    return batches.windows_order(seed) if document else batches.streams_order(episodes, config.streams, seed)


@partial(jax.jit, static_argnums=0)
def _stepped(
    config: CloningConfig,
    learner: Learner,
    scale: Scale,
    batch: Batch,
    under: Circumstances,
    rate: Float[Array, ""],
) -> tuple[Learner, Losses]:
    """One compiled step, augmentation and all."""
    given = _given(config, scale, batch, under)
    memory = jnp.zeros_like(learner.memory) if config.network == "document" else learner.memory

    def wrong(net: Network) -> tuple[Array, tuple[Losses, Array]]:
        told, remembered = losses(net, memory, given, config)
        return told.total, (told, remembered)

    (_, (told, remembered)), gradient = jax.value_and_grad(wrong, has_aux=True)(learner.network)
    gradient, _ = shortened(gradient, config.gradient_norm)
    net, adam = moved(learner.network, learner.adam, gradient, rate)
    return Learner(net, adam, remembered, learner.key), told


@partial(jax.jit, static_argnums=0)
def _judged(
    config: CloningConfig, net: Network, scale: Scale, memory: Float[Array, "streams 2 units"], batch: Batch
) -> tuple[Losses, Float[Array, "streams 2 units"]]:
    return losses(net, memory, _given(config, scale, batch, None), config)


def _given(config: CloningConfig, scale: Scale, batch: Batch, under: Circumstances | None) -> Given:
    """A batch as the network is shown it, under circumstances or as it is."""
    looks = Looks(_shares(batch.picture), _metres(batch.depth), jnp.asarray(batch.taught), jnp.asarray(batch.labels))
    if under is not None:
        looks = augmented(looks, config, under)
    seen = frames(looks.colours, looks.depth, scale)
    felt = felt_shares(jnp.asarray(batch.felt), config)
    return Given(seen, felt, looks.taught, looks.labels, jnp.asarray(batch.fresh), jnp.asarray(batch.weight))


def felt_shares(felt: Float[Array, "*rows 2"], config: CloningConfig) -> Float[Array, "*rows 2"]:
    """Velocities as shares of the greatest."""
    greatest = jnp.array([config.ahead[1], config.turning], jnp.float32)
    return felt / jnp.broadcast_to(greatest, felt.shape)


def _shares(picture: Any) -> Array:
    return jnp.asarray(picture).astype(jnp.float32) / 255.0


def _metres(depth: Any) -> Array:
    return jnp.asarray(depth).astype(jnp.float32) / 1000.0
