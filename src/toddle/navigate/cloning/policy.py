"""What learning leaves: from a look to a velocity and what is remembered. A value: saved, loaded, exported.

The scale of the pictures is a part of it. Its memory is that of the light network's cell; the document's looks at the
last few features anew each time, as it learned to.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float, UInt8

from toddle.navigate.cloning.config import CloningConfig
from toddle.navigate.cloning.frames import Scale, frames
from toddle.navigate.cloning.network import FEATURES, Network, unrolled, velocity
from toddle.navigate.cloning.training import felt_shares


@dataclass(frozen=True, eq=False)
class Cloned:
    """A network that steers.

    Attributes:
        network: what was learned.
        scale: of the pictures that it learned from.
        config: how it was learned.
        source: what from, for who loads it: plain values.
        figures: how well it did.
    """

    network: Network
    scale: Scale
    config: CloningConfig
    source: Mapping[str, Any] = field(default_factory=dict)
    figures: Mapping[str, Any] = field(default_factory=dict)

    def start(self) -> Float[Array, "rows numbers"]:
        """The memory at the start of an episode: a cell's output and itself, or no features yet."""
        if self.config.network == "document":
            return jnp.zeros((self.config.steps, FEATURES + 1), jnp.float32)
        return jnp.zeros((2, self.config.units), jnp.float32)

    def __call__(
        self,
        picture: UInt8[Array, "60 80 3"],
        depth: Float[Array, "60 80"],
        felt: Float[Array, "2"],
        memory: Float[Array, "rows numbers"],
    ) -> tuple[Float[Array, "2"], Float[Array, "rows numbers"]]:
        """The velocity ahead [m/s] and turning [rad/s], and the memory after it. Runs under ``jit`` and ``vmap``.

        Args:
            picture: red, green, blue.
            depth: [m]; 0 where it is not known.
            felt: velocity ahead and turning that the robot walks at.
            memory: from the last look.
        """
        colours = picture.astype(jnp.float32) / 255.0
        seen = frames(colours[None], depth[None], self.scale)
        features = self.network.features(seen, felt_shares(felt, self.config)[None])[0]
        if self.config.network == "document":
            return self._from_window(features, memory)
        known = memory if self.config.memory else jnp.zeros_like(memory)
        known = self.network.remember(features, known)
        return velocity(self.config, self.network.answer(known[0]).said), known

    def _from_window(
        self, features: Float[Array, " features"], memory: Float[Array, "rows numbers"]
    ) -> tuple[Float[Array, "2"], Float[Array, "rows numbers"]]:
        """Of the last features; a row's last number tells whether it holds any."""
        window = jnp.concatenate([memory[1:], jnp.append(features, 1.0)[None]])
        fresh = window[:, -1] < 1.0 if self.config.memory else jnp.ones(len(window), bool)
        before = jnp.concatenate([jnp.ones(1, bool), fresh[:-1]])  # what comes after nothing remembers nothing
        empty = jnp.zeros((1, 2, self.config.units), jnp.float32)
        remembered, _ = unrolled(self.network, window[None, :, :-1], (fresh | before)[None], empty)
        return velocity(self.config, self.network.answer(remembered[0, -1]).said), window
