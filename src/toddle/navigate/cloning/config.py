"""The numbers of learning to steer by watching, and which parts are left out to see what they are worth."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from toddle.failures import BadInput, unknown_name

KINDS = ("light", "document")


@dataclass(frozen=True)
class CloningConfig:
    """How to learn; the defaults are the light network's.

    Attributes:
        network: light: strided convolutions and a memory over the whole episode; document: the U-Net with an LSTM of
            Huber 2019, figure 4.15.
        depth: whether the network sees how far things are.
        memory: whether it remembers anything from one look to the next.
        heads: whether it also learns to tell where the target and obstacles are.
        ahead: least and greatest velocity ahead [m/s].
        turning: greatest turning velocity [rad/s].
        channels: of the convolutions.
        hidden: units between the convolutions and the memory.
        units: of the memory.
        levels: into how many velocities ahead, and turning ones, commands are divided.
        streams: episodes that are gone through side by side; the document's batch.
        steps: looks of each between two gradient steps; the document's sequence.
        passes: looks that are learned from in all.
        rate: of Adam; it falls to 0.3 of it after 70 % of the passes, to 0.1 after 88 %.
        falls: whether it does.
        gradient_norm: greatest norm of a gradient; longer ones are shortened.
        heads_weight: of the loss of what else it learns to tell.
        shift: greatest shift of a picture across [pixels].
        light: by what share a stream's brightness and each of its colours may change.
        noise: greatest of a pixel's noise, of 1.
        dropped: how often a stream's depth is missing altogether, and each block of it.
    """

    network: Literal["light", "document"] = "light"
    depth: bool = True
    memory: bool = True
    heads: bool = True
    ahead: tuple[float, float] = (-0.12, 0.3)
    turning: float = 0.3
    channels: tuple[int, ...] = (32, 48, 64)
    hidden: int = 96
    units: int = 96
    levels: tuple[int, int] = (8, 11)
    streams: int = 8
    steps: int = 32
    passes: int = 700_000
    rate: float = 1e-3
    falls: bool = True
    gradient_norm: float = 1.0
    heads_weight: float = 0.5
    shift: int = 2
    light: float = 0.15
    noise: float = 0.03
    dropped: float = 0.05

    def __post_init__(self) -> None:
        """Refuses what nothing can learn by.

        Raises:
            BadInput: which number.
        """
        if self.network not in KINDS:
            raise unknown_name("network", self.network, KINDS, where="network")
        counts = {"hidden": self.hidden, "units": self.units, "streams": self.streams, "steps": self.steps}
        counts |= {"passes": self.passes, "levels": min(self.levels) - 1, "channels": min(self.channels, default=0)}
        for name, value in counts.items():
            if value < 1:
                raise BadInput(f"{getattr(self, name)} is too small", where=name, remedy="give more")
        shares = {name: getattr(self, name) for name in ("heads_weight", "light", "noise", "dropped", "shift")}
        wrong = [name for name, value in shares.items() if not (math.isfinite(value) and value >= 0)]
        wrong += [name for name in ("rate", "turning", "gradient_norm") if not 0 < getattr(self, name) < math.inf]
        if wrong or not self.ahead[0] < self.ahead[1]:
            name = (wrong or ["ahead"])[0]
            raise BadInput(f"{getattr(self, name)} is out of range", where=name, remedy="see what it means")

    @property
    def updates(self) -> int:
        """Gradient steps in all."""
        return max(1, self.passes // (self.streams * self.steps))


def document() -> CloningConfig:
    """The document's: batches of 32 sequences of 5, Adam at 1e-3, mean squared error; no more than that.

    Its 100 epochs over 120,000 looks are 12 million sequences; ``passes`` counts their looks.
    """
    return replace(
        CloningConfig(),
        network="document", heads=False, channels=(64, 128, 128), hidden=64, units=10, streams=32, steps=5,
        passes=60_000_000, falls=False, gradient_norm=1e6, shift=0, light=0.0, noise=0.0, dropped=0.0,
    )  # fmt: skip
