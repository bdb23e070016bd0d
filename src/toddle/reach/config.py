"""What defines a run of `toddle reach`: frozen, checked once, written into the run's folder."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from toddle.failures import BadInput, unknown_name

MOST_SAMPLES = 100_000_000


@dataclass(frozen=True)
class ReachConfig:
    """One run of the learning loop. None means "what suits the method and the robot".

    Attributes:
        method: how it explores (see `toddle.reach.methods.METHODS`); None: what suits the arm (`with_method`).
        learner: what learns from it: perceptron, local-linear or recall.
        samples: how many movements to learn from; 300,000, or 20,000 for a memory of movements.
        seed: of all randomness.
        hidden: hidden layers of the perceptron; () is the single-layer perceptron.
        learning_rate: step of the learner.
        perturbation: size of exploration: of each component in the unit box for goal-and-motor babbling, of the
            exploratory noise [rad] for goal babbling, of a step as a fraction of the range for continuous babbling.
        network: the perceptron with our refinements (inputs in [-1, 1], an output margin, answers from averaged
            weights), or plain, as the thesis's tables have it.
        reading: of the thesis's algorithm: the one that reproduces its tables, or its literal words.
        per_cycle: movements between two tests.
        test_points: size of the fixed test set; the document's, or 110.
        test_spacing: least distance between its points [m].
    """

    method: str | None = None
    learner: str | None = None
    samples: int | None = None
    seed: int = 0
    hidden: tuple[int, ...] | None = None
    learning_rate: float | None = None
    perturbation: float | None = None
    network: Literal["refined", "plain"] = "refined"
    reading: Literal["tables", "literal"] = "tables"
    per_cycle: int = 2000
    test_points: int | None = None
    test_spacing: float | None = None

    def __post_init__(self) -> None:
        """Refuse what can't be run.

        Raises:
            BadInput: a number out of its range.
        """
        _within("samples", 1 if self.samples is None else self.samples, 1, MOST_SAMPLES)
        _within("seed", self.seed, 0, 2**32 - 1)
        _within("per-cycle", self.per_cycle, 1, 1_000_000)
        _within("test-points", 110 if self.test_points is None else self.test_points, 1, 10_000)
        if not isinstance(self.hidden, tuple | None):
            raise BadInput(f"{self.hidden!r} is no tuple", where="--hidden", remedy="give a tuple, such as (10,)")
        for size in self.hidden or ():
            _within("hidden", size, 1, 4096)
        if len(self.hidden or ()) > 8:
            raise BadInput(f"{len(self.hidden or ())} layers", where="--hidden", remedy="give 8 or fewer")
        for name, known in (("network", ("refined", "plain")), ("reading", ("tables", "literal"))):
            if getattr(self, name) not in known:
                raise unknown_name(name, str(getattr(self, name)), known, where=_flag(name))
        for name in ("learning_rate", "perturbation", "test_spacing"):
            value = getattr(self, name)
            if value is not None and not (isinstance(value, float | int) and 0 < value <= 100):
                raise BadInput(
                    f"{value!r} is out of range", where=_flag(name), remedy="give a number above 0, at most 100"
                )


def _within(name: str, value: int, least: int, most: int) -> None:
    if not isinstance(value, int):
        raise BadInput(f"{value!r} is no whole number", where=_flag(name), remedy=f"give {least} to {most}")
    if not least <= value <= most:
        raise BadInput(f"{value} is out of range", where=_flag(name), remedy=f"give {least} to {most}")


def _flag(name: str) -> str:
    return "--" + name.replace("_", "-")
