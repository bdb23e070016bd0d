"""What TensorBoard shows of a run: the parts of its reports as scalars over the steps made."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from tensorboardX import SummaryWriter

from toddle.navigate.task import Outcome

TAGS = {
    "reward": "step/reward",
    "return_": "episode/return",
    "length": "episode/length",
    "policy_loss": "loss/policy",
    "value_loss": "loss/value",
    "entropy": "policy/entropy",
    "kl": "policy/kl",
    "clipped": "policy/clipped",
    "deviation": "policy/deviation",
    "explained": "critic/explained",
    "rate": "learning/rate",
    "gradient": "learning/gradient",
}


class Board:
    """Event files in one folder, and nowhere else.

    Use it in a ``with`` block: what was told last is written when it ends.
    """

    def __init__(self, folder: Path, purge_from: int | None = None) -> None:
        """Opens a new event file.

        Args:
            folder: where.
            purge_from: a resumed run begins after so many steps: later ones of earlier files are hidden.
        """
        self._writer = SummaryWriter(str(folder), purge_step=purge_from)

    def __enter__(self) -> Board:
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.close()

    def tell(self, rows: Mapping[str, np.ndarray], steps_per_second: float) -> None:
        """Updates that were made.

        Args:
            rows: parts of `toddle.navigate.ppo.training.Report` by name, a row an update.
            steps_per_second: at which they came.
        """
        for row, steps in enumerate(rows["steps"].tolist()):
            if steps:  # else nothing was made
                for tag, value in _scalars(rows, row).items():
                    self._writer.add_scalar(tag, value, steps)
                self._writer.add_scalar("speed/steps_per_second", steps_per_second, steps)

    def scalars(self, values: Mapping[str, float], steps: int) -> None:
        """Numbers by their tags, after so many steps; what isn't finite can't be drawn."""
        for tag, value in values.items():
            if math.isfinite(value):
                self._writer.add_scalar(tag, value, steps)


def _scalars(rows: Mapping[str, np.ndarray], row: int) -> dict[str, float]:
    """Of one update; what isn't finite can't be drawn."""
    found = {tag: float(rows[name][row]) for name, tag in TAGS.items()}
    if episodes := int(rows["episodes"][row]):
        counts = rows["outcomes"][row].tolist()
        found |= {f"episode/{one.name.lower()}": counts[one] / episodes for one in tuple(Outcome)[1:]}
    return {tag: value for tag, value in found.items() if math.isfinite(value)}
