"""What defines a run that learns the body: frozen, checked once, written into the run's folder."""

from __future__ import annotations

import math
from dataclasses import dataclass

from toddle.failures import BadInput

MOST_MOVEMENTS = 1_000_000
_MOST_NOISE = 1.0  # [m], [rad]


@dataclass(frozen=True)
class BodyConfig:
    """One run of learning the body. None means "what suits the body".

    Attributes:
        method: the structure that the body is taken to have (see `toddle.reach.structures.STRUCTURES`).
        movements: how many movements to learn from.
        seed: of all randomness.
        noise: standard deviation of the seen tip on each axis [m]; None: nobody knows it.
        angle_noise: the same of its orientation, about each axis [rad].
        look_noise: the same as ``noise``, when the answers are tested by looking [m].
        pose: whether the tip's orientation is seen and learned, too.
        test_points: unseen reachable targets to test on.
    """

    method: str | None = None
    movements: int | None = None
    seed: int = 0
    noise: float | None = 0.0
    angle_noise: float = 0.0
    look_noise: float = 0.0
    pose: bool = False
    test_points: int = 4096

    def __post_init__(self) -> None:
        """Refuse what can't be run.

        Raises:
            BadInput: a number out of its range.
        """
        _whole("samples", 1 if self.movements is None else self.movements, 1, MOST_MOVEMENTS)
        _whole("seed", self.seed, 0, 2**32 - 1)
        _whole("test-points", self.test_points, 1, 100_000)
        for name in ("noise", "angle_noise", "look_noise"):
            value = getattr(self, name) or 0.0
            if not (isinstance(value, float | int) and math.isfinite(value) and 0 <= value <= _MOST_NOISE):
                raise BadInput(
                    f"{value!r} is out of range", where="--" + name.replace("_", "-"), remedy="give 0 to 1 m or rad"
                )


def _whole(name: str, value: int, least: int, most: int) -> None:
    remedy = f"give {least} to {most}"
    if not isinstance(value, int):
        raise BadInput(f"{value!r} is no whole number", where=f"--{name}", remedy=remedy)
    if not least <= value <= most:
        raise BadInput(f"{value} is out of range", where=f"--{name}", remedy=remedy)
