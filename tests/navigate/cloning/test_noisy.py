"""Jolts of a driver: as large as they may be, as often as is told, and the driver itself knows nothing of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from toddle.navigate.cloning.noisy import Noisy
from toddle.navigate.driver import Driver, Situation
from toddle.navigate.sight import PERIOD
from toddle.signals import Velocity


@dataclass(frozen=True)
class Counts:
    """Walks ever faster; gives up after so many decisions."""

    until: int = 1_000_000
    period: float = PERIOD

    def start(self) -> int:
        return 0

    def decide(self, memory: int, situation: Situation) -> tuple[Velocity | None, int]:
        assert situation.t == memory * PERIOD
        return (Velocity(1e-3 * memory, 0.0, -1e-3) if memory < self.until else None), memory + 1


def added(noisy: Noisy, count: int) -> np.ndarray:
    """What is added to each of so many commands."""
    memory, found = noisy.start(), []
    for number in range(count):
        situation = Situation(number * PERIOD, np.zeros(3), (1.0, 0.0), Velocity(0.0, 0.0, 0.0))
        velocity, memory = noisy.decide(memory, situation)
        assert velocity is not None
        found.append([velocity.vx - 1e-3 * number, velocity.vy, velocity.omega + 1e-3])
    return np.array(found)


@given(seed=st.integers(0, 2**40), size=st.floats(0.1, 3.0))
def test_jolts_are_never_larger_than_told(seed: int, size: float) -> None:
    found = added(Noisy(Counts(), size, seed), 200)
    assert (np.abs(found) <= size * np.array([0.12, 0.0, 0.25]) + 1e-9).all()
    assert np.array_equal(found, added(Noisy(Counts(), size, seed), 200))


def test_jolts_last_and_rest_as_long_as_told() -> None:
    found = added(Noisy(Counts(), 1.0, 5), 20_000)
    jolted = (np.abs(found) > 1e-12).any(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], jolted, [False]]).astype(int)))
    lengths = PERIOD * (edges[1::2] - edges[::2])
    assert 0.18 < jolted.mean() < 0.26  # 1.1 s of jolt after 4 s of rest, each rounded to looks
    assert lengths.min() > 0.3
    assert 0.9 < lengths.mean() < 1.3


def test_who_gives_up_gives_up() -> None:
    noisy = Noisy(Counts(until=0), 1.0, 0)
    assert isinstance(noisy, Driver)
    velocity, _ = noisy.decide(noisy.start(), Situation(0.0, np.zeros(3), (1.0, 0.0), Velocity(0.0, 0.0, 0.0)))
    assert velocity is None
