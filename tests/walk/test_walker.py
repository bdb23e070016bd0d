"""The walker in physics: it walks, stops, is pushed, goes by; and what a tick is not allowed to do."""

from __future__ import annotations

import copy
import math
from dataclasses import fields, replace

import numpy as np
import pytest

from toddle.failures import BadInput
from toddle.outside.simulation.disturbances import WorldOptions
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.robots.humanoid import Humanoid
from toddle.robots.humanoids import load_humanoid
from toddle.signals import STILL, Circle, Velocity
from toddle.walk.config import WalkConfig
from toddle.walk.loop import CommandSource, Moment, walk
from toddle.walk.pattern.plan import Status
from toddle.walk.state import Mode
from toddle.walk.walker import Walker, walker

AHEAD = Velocity(0.15, 0.0, 0.0)
SWITCHES = [field.name for field in fields(WalkConfig) if field.type == "bool"]


@pytest.fixture(scope="module")
def heicub() -> Humanoid:
    return load_humanoid("heicub")


@pytest.fixture(scope="module")
def walks(heicub: Humanoid) -> Walker:
    return walker(heicub)


@pytest.fixture(scope="module")
def world(heicub: Humanoid) -> HumanoidSimulation:
    """One for all tests: each walk resets it."""
    return HumanoidSimulation(heicub)


def moments(
    walks: Walker,
    world: HumanoidSimulation,
    commands: CommandSource,
    seconds: float,
    push: tuple[float, float, float] | None = None,
    circles: tuple[Circle, ...] = (),
) -> list[Moment]:
    seen = []
    for moment in walk(walks, world, commands, seconds, circles):
        if push is not None and not seen:
            world.push(*push)
        seen.append(moment)
    return seen


@pytest.fixture(scope="module")
def walked(walks: Walker, world: HumanoidSimulation) -> tuple[list[Moment], np.ndarray]:
    """6 s ahead, and the stop; the truth of waist and soles at each tick."""
    seen, truth = [], []
    for moment in walk(walks, world, lambda t: AHEAD if t < 6 else STILL, 10.0):
        told = world.truth()
        seen.append(moment)
        truth.append([*told.waist, *told.soles.ravel(), told.fallen])
    return seen, np.array(truth)


def test_it_walks_as_fast_as_it_is_told(walked: tuple[list[Moment], np.ndarray]) -> None:
    seen, truth = walked
    assert len(seen) == 1000
    assert not any(moment.fell for moment in seen)
    assert not truth[:, -1].any()
    # whole steps of 0.6 s, once the gate has let the speed through
    covered = truth[560, 0] - truth[320, 0]
    assert covered / 2.4 == pytest.approx(AHEAD.vx, rel=0.1)
    assert np.abs(truth[560, 1:3]).max() < 0.1
    assert {moment.support for moment in seen[100:600]} == {-1, 0, 1}


def test_it_stops_with_its_feet_side_by_side_and_stays(walked: tuple[list[Moment], np.ndarray], walks: Walker) -> None:
    _, truth = walked
    last, before = truth[-1], truth[-100]
    np.testing.assert_allclose(last[3:11], before[3:11], atol=5e-4)
    np.testing.assert_allclose(last[:3], before[:3], atol=6e-3)  # the body still settles
    left, right = last[3:7], last[7:11]
    cos, sin = math.cos(last[2]), math.sin(last[2])
    dx, dy = left[0] - right[0], left[1] - right[1]
    assert cos * dx + sin * dy == pytest.approx(0, abs=0.02)
    assert -sin * dx + cos * dy == pytest.approx(walks.gait.foot_distance, abs=0.02)
    assert left[3] == pytest.approx(right[3], abs=0.05)


def test_what_the_senses_tell_is_the_truth(walked: tuple[list[Moment], np.ndarray]) -> None:
    seen, truth = walked
    told = np.array([moment.measured.feet.mean(axis=0)[[0, 1]] for moment in seen])
    true = (truth[:, 3:5] + truth[:, 7:9]) / 2
    assert np.abs(told - true).max() < 0.03  # a metre of dead reckoning
    velocity = np.array([moment.measured.velocity for moment in seen[320:560]])
    assert velocity[:, 0].mean() == pytest.approx(AHEAD.vx, rel=0.1)


@pytest.mark.parametrize(("standing", "direction"), [(False, 0.5 * math.pi), (False, math.pi), (True, 0.0)])
def test_a_push_is_survived(walks: Walker, world: HumanoidSimulation, standing: bool, direction: float) -> None:
    command = STILL if standing else AHEAD
    seen = moments(walks, world, lambda t: command if t < 3.5 else STILL, 6.0, push=(4.0, direction, 2.0))
    assert len(seen) == 600
    assert not world.truth().fallen
    assert abs(world.truth().v).max() < 0.1


def test_a_command_that_is_no_number_asks_to_stand(walks: Walker, world: HumanoidSimulation) -> None:
    bad = Velocity(math.nan, 0.1, math.inf)
    seen = moments(walks, world, lambda t: bad, 1.0)
    assert all(moment.allowed == STILL and moment.support == -1 for moment in seen)
    state, senses = walks.start(), world.reset()
    for _ in range(100):  # and without the gate
        state, action = walks.step(state, bad, senses)
        senses = world.tick(action.servo)
    assert not world.truth().fallen


def test_a_computer_that_is_always_late_brings_it_to_stand(heicub: Humanoid, world: HumanoidSimulation) -> None:
    late = walker(heicub, WalkConfig(deadline_ms=0.0))
    seen = moments(late, world, lambda t: AHEAD, 6.0)
    plans = [moment.plan for moment in seen if moment.plan is not None]
    assert len(plans) >= 5
    assert all(plan.status == Status.LATE for plan in plans)
    assert not world.truth().fallen
    assert all(moment.support == -1 for moment in seen[-100:])
    assert np.abs(world.truth().v).max() < 0.05


@pytest.mark.parametrize("name", SWITCHES)
def test_each_term_can_be_switched_off(heicub: Humanoid, world: HumanoidSimulation, name: str) -> None:
    # not for long: without follow_measured it falls after 2 s
    seen = moments(walker(heicub, replace(WalkConfig(), **{name: False})), world, lambda t: AHEAD, 1.7)
    assert not seen[-1].fell
    assert {moment.support for moment in seen} == {-1, 0, 1}


def test_the_switches_are_all_there_are() -> None:
    assert len(SWITCHES) == 7


def test_a_tick_is_a_function_of_its_arguments(walks: Walker, world: HumanoidSimulation) -> None:
    state, senses = walks.start(), world.reset()
    circles, landed = (Circle(0.6, 0.1, 0.1),), 0
    for tick in range(180):
        kept, felt = copy.deepcopy((state, senses))
        after, action = walks.step(state, AHEAD, senses, circles)
        assert same((state, senses), (kept, felt))
        if tick % 10 == 0:
            again, other = walks.step(kept, AHEAD, felt, circles)
            np.testing.assert_array_equal(action.servo, other.servo)
            assert same(after, again, timed=True)
        landed += len(after.landings) > len(state.landings)
        state, senses = after, world.tick(action.servo)
    assert landed >= 2


def test_a_foot_that_feels_no_floor_carries_after_a_while(walks: Walker, world: HumanoidSimulation) -> None:
    state, senses = walks.start(), world.reset()
    ends = []
    for _ in range(150):
        wrenches = senses.wrenches.copy()
        if state.mode == Mode.STEP:
            wrenches[1 - state.step.stance] = 0.0
        after, _ = walks.step(state, AHEAD, senses._replace(wrenches=wrenches))
        if len(after.landings) > len(state.landings):
            ends.append(state.step.phase - state.step.end)
        state = after
    assert len(ends) >= 1
    assert all(walks.config.late - 0.03 < over <= walks.config.late + 0.01 for over in ends)


def test_the_last_step_ends_with_the_weight_between_the_feet(walks: Walker, world: HumanoidSimulation) -> None:
    state, senses, finals = walks.start(), world.reset(), []
    for tick in range(450):
        before = state
        state, action = walks.step(state, AHEAD if tick < 150 else STILL, senses)
        senses = world.tick(action.servo)
        if before.mode == Mode.STEP and state.landings is not before.landings:
            finals.append(before.step.final)
    assert state.mode == Mode.STAND
    assert finals[-1]
    assert not any(finals[:2])


def same(one: object, other: object, *, timed: bool = False) -> bool:
    """Bit for bit, except how long things took where they are timed."""
    if isinstance(one, np.ndarray):
        return np.array_equal(one, np.asarray(other), equal_nan=True)
    if isinstance(one, tuple):
        assert isinstance(other, tuple)
        names = getattr(one, "_fields", range(len(one)))
        kept = [number for number, name in enumerate(names) if not (timed and name == "milliseconds")]
        return len(one) == len(other) and all(same(one[number], other[number], timed=timed) for number in kept)
    return one == other


def test_a_tall_cylinder_straight_ahead_is_not_touched(heicub: Humanoid, walks: Walker) -> None:
    circles = (Circle(0.8, 0.0, 0.15),)
    simulation = HumanoidSimulation(heicub, WorldOptions(circles=circles))
    seen = moments(walks, simulation, lambda t: Velocity(0.2, 0.0, 0.0), 10.0, circles=circles)
    assert len(seen) == 1000
    assert not simulation.touched.any()
    assert not simulation.truth().fallen
    assert simulation.truth().waist[0] > 0.2  # it came near


def test_it_starts_standing_between_its_soles(walks: Walker) -> None:
    state = walks.start()
    assert state.mode == Mode.STAND
    assert state.anchors[:, 1].tolist() == [walks.gait.foot_distance / 2, -walks.gait.foot_distance / 2]
    corners = walks.area(state)
    assert max(y for _, y in corners) == pytest.approx((walks.gait.foot_distance + walks.gait.foot_width) / 2)
    assert max(y for _, y in walks.area(state, 0.5)) == pytest.approx(
        walks.gait.foot_distance / 2 + walks.gait.foot_width / 4
    )


@pytest.mark.parametrize("bad", [{"late": -0.1}, {"zmp_gain": math.nan}, {"deadline_ms": -1.0}])
def test_options_below_zero_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(BadInput, match="walk option"):
        replace(WalkConfig(), **bad)
