"""The control loop: when it ends, what it lets through, and that a robot need not be a simulation."""

from __future__ import annotations

import math

import numpy as np
import pytest

from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.robots.humanoids import load_humanoid
from toddle.signals import STILL, Circle, Senses, Velocity
from toddle.walk.gate import ACCELERATION
from toddle.walk.loop import Robot, walk
from toddle.walk.state import Action, WalkerState
from toddle.walk.walker import Walker, walker

AHEAD = Velocity(0.15, 0.0, 0.0)


class Statue:
    """A robot whose sensors always tell the same; it keeps what it was commanded."""

    def __init__(self, senses: Senses) -> None:
        self.senses: Senses = senses
        self.commanded: list[np.ndarray] = []

    def reset(self) -> Senses:
        self.commanded.clear()
        return self.senses

    def tick(self, servo: np.ndarray) -> Senses:
        self.commanded.append(servo)
        return self.senses


class Listening:
    """A walker that notes what it is given."""

    def __init__(self, inner: Walker) -> None:
        self.inner, self.gait, self.given = inner, inner.gait, list[tuple[Velocity, tuple[Circle, ...]]]()

    def start(self) -> WalkerState:
        return self.inner.start()

    def step(
        self, state: WalkerState, velocity: Velocity, senses: Senses, circles: tuple[Circle, ...] = ()
    ) -> tuple[WalkerState, Action]:
        self.given.append((velocity, circles))
        return self.inner.step(state, velocity, senses, circles)

    def area(self, state: WalkerState) -> list[tuple[float, float]]:
        return self.inner.area(state)


@pytest.fixture(scope="module")
def walks() -> Walker:
    return walker(load_humanoid("heicub"))


@pytest.fixture(scope="module")
def statue(walks: Walker) -> Statue:
    return Statue(HumanoidSimulation(walks.humanoid).reset())


def test_seconds_cut_at_once(walks: Walker, statue: Statue) -> None:
    seen = list(walk(walks, statue, lambda t: AHEAD, 0.75))
    assert len(seen) == len(statue.commanded) == 75
    assert seen[-1].t == pytest.approx(0.75)
    np.testing.assert_allclose(np.diff([moment.t for moment in seen]), 0.01)


def test_a_robot_that_stands_ends_with_its_commands_and_half_a_second_of_rest(walks: Walker, statue: Statue) -> None:
    assert len(list(walk(walks, statue, lambda t: None))) == 50
    assert len(list(walk(walks, statue, lambda t: STILL if t < 0.295 else None))) == 50
    assert len(list(walk(walks, statue, lambda t: STILL if t < 0.795 else None))) == 80


def test_one_that_walks_comes_to_stand_first(walks: Walker) -> None:
    simulation = HumanoidSimulation(walks.humanoid)
    seen = list(walk(walks, simulation, lambda t: AHEAD if t < 2 else None))
    last = seen[-1]
    assert 2.5 < last.t < 2 + 5 * walks.gait.step_time
    assert all(moment.asked == STILL for moment in seen if moment.t > 2.02)
    assert last.allowed == STILL
    assert last.support == -1
    assert last.measured.feet[0, 0] == pytest.approx(last.measured.feet[1, 0], abs=0.02)
    assert last.measured.margin > 0


def test_a_stop_does_not_take_for_ever(walks: Walker, statue: Statue) -> None:
    # its feet never land where they should, since they never move
    seen = list(walk(walks, statue, lambda t: AHEAD if t < 1 else None))
    assert seen[-1].t <= 1 + 8.0 + 0.02


def test_the_commands_pass_the_gate(walks: Walker, statue: Statue) -> None:
    listening, circles = Listening(walks), (Circle(5.0, 0.0, 0.2),)
    seen = list(walk(listening, statue, lambda t: AHEAD, 0.2, circles))
    given = np.array([velocity for velocity, _ in listening.given])
    np.testing.assert_allclose(np.diff(given[:, 0], prepend=0.0), ACCELERATION * 0.01)
    assert all(told == circles for _, told in listening.given)
    assert [moment.allowed for moment in seen] == [velocity for velocity, _ in listening.given]
    assert next(
        iter(walk(walks, statue, lambda t: Velocity(9.0, 0.0, 0.0), limited=False))
    ).allowed.vx == pytest.approx(walks.gait.fastest.vx)


def test_a_robot_that_lies_ends_it(walks: Walker, statue: Statue) -> None:
    over = Statue(statue.senses._replace(orientation=np.array([math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0])))
    seen = list(walk(walks, over, lambda t: STILL, 1.0))
    assert len(seen) == 1
    assert seen[0].fell


def test_velocity_is_told_from_the_third_landing_on(walks: Walker) -> None:
    seen = list(walk(walks, HumanoidSimulation(walks.humanoid), lambda t: AHEAD, 2.6))
    known = [math.isfinite(moment.measured.velocity.vx) for moment in seen]
    first = known.index(True)
    assert 1.9 < seen[first].t < 2.4
    assert not any(known[:first])
    assert all(known[first:])
    assert isinstance(HumanoidSimulation(walks.humanoid), Robot)
