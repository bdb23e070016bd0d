"""Dataset aggregation (Ross et al. 2011): an expert drives first, jolted; then the network does, and he teaches.

What to do in which order, as values: each stage drives through rooms of its own, adds them to those before, learns on.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Literal, NamedTuple

from toddle.failures import BadInput
from toddle.navigate.cloning.recording import RoomKey
from toddle.navigate.scenarios.rooms import Scenario

MIX: tuple[Scenario, ...] = (
    "straight", "obstacle", "search", "person", "decoys", "curve", "obstacle", "search", "person", "decoys",
)  # fmt: skip
"""Scenarios in turn: the hard ones twice as often."""


class Stage(NamedTuple):
    """Drives, then gradient steps.

    Attributes:
        driver: who drives.
        first: number of its first drive.
        drives: how many.
        passes: looks that are learned from after them.
    """

    driver: Literal["expert", "policy"]
    first: int
    drives: int
    passes: int


@dataclass(frozen=True)
class Course:
    """How much of what.

    Attributes:
        episodes: drives of the jolted expert.
        rounds: of the network's drives.
        each: drives of a round.
        passes: looks that are learned from in all.
        share: of the passes that the first stage has.
        dagger: whether the network drives; else the expert drives as often as both would, and all passes follow.
    """

    episodes: int = 192
    rounds: int = 6
    each: int = 72
    passes: int = 700_000
    share: float = 0.3
    dagger: bool = True

    def __post_init__(self) -> None:
        """Refuses what leaves nothing to learn from.

        Raises:
            BadInput: which number.
        """
        for name, least in (("episodes", 1), ("rounds", 0), ("each", 1), ("passes", 1)):
            if getattr(self, name) < least:
                raise BadInput(f"{getattr(self, name)} is too small", where=name, remedy=f"give {least} or more")

    @property
    def stages(self) -> tuple[Stage, ...]:
        """In their order."""
        if not (self.dagger and self.rounds):
            return (Stage("expert", 0, self.episodes + self.rounds * self.each, self.passes),)
        begin = round(self.share * self.passes)
        later = (self.passes - begin) // self.rounds
        rounds = (
            Stage("policy", self.episodes + number * self.each, self.each, later) for number in range(self.rounds)
        )
        return (Stage("expert", 0, self.episodes, begin), *rounds)


def rooms_of(stage: Stage, first: int = 0) -> tuple[RoomKey, ...]:
    """The rooms of a stage's drives: none of them is another drive's.

    Args:
        stage: which.
        first: number of the first room of each scenario.
    """
    taken = Counter(MIX[number % len(MIX)] for number in range(stage.first))
    found = []
    for number in range(stage.first, stage.first + stage.drives):
        scenario = MIX[number % len(MIX)]
        found.append(RoomKey(scenario, "train", "seen", first + taken[scenario]))
        taken[scenario] += 1
    return tuple(found)
