"""The document's pattern against its exact trajectories, and what it does without an answer."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import count

import numpy as np
import pytest
from walk.gaits import HEICUB, HRP2, columns

from toddle.failures import BadInput
from toddle.robots.gait import Gait
from toddle.signals import Circle, Velocity
from toddle.walk.pattern.document import Document, DocumentState
from toddle.walk.pattern.plan import Interval, Status
from toddle.walk.pattern.time_stepping import zero_moment_point
from toddle.walk.pattern.trajectory import walk_pattern

SEVEN = replace(HRP2, preview=14, step_time=0.7)


@pytest.mark.parametrize(("name", "command"), [("straight", (0.1, 0.0, 0.0)), ("turn", (0.1, 0.0, 0.1))])
def test_the_exact_trajectory_is_met(name: str, command: tuple[float, float, float]) -> None:
    exact = columns(f"exact_{name}.csv.gz")
    walked = walk_pattern(Document(HRP2), HRP2, lambda t: Velocity(*command), 100).columns()
    assert len(walked["t"]) == 2200
    still = {column: walked[column][:200] for column in exact}
    for column, values in exact.items():
        assert np.all(still[column] == still[column][0])
        np.testing.assert_allclose(walked[column][200:], values, atol=1e-6, err_msg=column)


def steady(velocity: Velocity) -> Callable[[float], Velocity]:
    return lambda t: velocity


def stop_and_go(t: float) -> Velocity:
    return Velocity(0.15 * (int(t / 3) % 2), 0.0, 0.1 * (int(t / 4) % 2))


@pytest.mark.parametrize("gait", [HRP2, HEICUB, SEVEN], ids=["hrp2", "heicub", "seven"])
@pytest.mark.parametrize(
    "command",
    [
        steady(Velocity(0.0, 0.0, 0.0)),
        steady(Velocity(-0.1, 0.0, 0.0)),
        steady(Velocity(0.0, 0.1, 0.0)),
        steady(Velocity(0.0, 0.0, 0.1)),
        steady(Velocity(0.1, -0.05, -0.2)),
        stop_and_go,
    ],
    ids=["stop", "back", "left", "turn", "curve", "go"],
)
def test_every_command_has_a_solution(gait: Gait, command: Callable[[float], Velocity]) -> None:
    walked = walk_pattern(Document(gait), gait, command, 120)
    assert {interval.status for interval in walked.intervals} == {Status.SOLVED}
    apart = np.hypot(*(walked.feet[:, 0, 0, :2] - walked.feet[:, 0, 1, :2]).T)
    reach = np.hypot(*np.array(gait.hull).T).max()
    assert apart.max() < reach + 1e-6


def test_left_and_right_are_mirror_images_after_a_step() -> None:
    """Walking starts on the left sole, so the two differ by when they begin, not by how they turn."""
    left = walk_pattern(Document(HRP2), HRP2, steady(Velocity(0.1, 0.0, 0.1)), 160).com[-1, 0, 3]
    right = walk_pattern(Document(HRP2), HRP2, steady(Velocity(0.1, 0.0, -0.1)), 160).com[-1, 0, 3]
    assert left == pytest.approx(-right, abs=0.09)
    assert left > 0.5


def test_an_obstacle_turns_the_footsteps_away() -> None:
    circle = Circle(1.6, 1.0, 1.0)
    free = walk_pattern(Document(HRP2), HRP2, steady(Velocity(0.2, 0.0, 0.0)), 100)
    kept = walk_pattern(Document(HRP2), HRP2, steady(Velocity(0.2, 0.0, 0.0)), 100, [circle])
    twice = walk_pattern(Document(HRP2), HRP2, steady(Velocity(0.2, 0.0, 0.0)), 100, [circle, circle])
    assert kept.com[-1, 0, 1] < free.com[-1, 0, 1] - 0.05
    np.testing.assert_allclose(twice.com, kept.com, atol=1e-5)


def walked(pattern: Document, ticks: int) -> Iterator[tuple[DocumentState, Interval]]:
    state = pattern.start()
    for _ in range(ticks):
        state, interval = pattern.step(state, Velocity(0.1, 0.0, 0.05))
        yield state, interval


def test_a_late_iteration_follows_the_last_plan() -> None:
    times = iter(range(0, 1000, 1))
    punctual = Document(HRP2, deadline=2000.0, clock=lambda: float(next(times)))
    *_, (state, interval) = walked(punctual, 11)
    assert interval.status is Status.SOLVED
    late, interval = replace(punctual, deadline=500.0).step(state, Velocity(-0.3, 0.0, 0.0))
    assert interval.status is Status.LATE
    assert interval.milliseconds == 1000.0
    np.testing.assert_array_equal(interval.jerk, state.plan.jerks[:, 1])
    np.testing.assert_array_equal(late.plan.footsteps, state.plan.footsteps)


def test_a_late_iteration_at_a_new_step_moves_the_footsteps_up() -> None:
    pattern = Document(HRP2)
    *_, (state, _) = walked(pattern, 16)
    assert state.left == 8
    after, interval = replace(pattern, deadline=0.0).step(state, Velocity(0.1, 0.0, 0.0))
    assert interval.landing is not None
    np.testing.assert_array_equal(after.plan.footsteps[0], state.plan.footsteps[1])
    assert [interval.landing.x, interval.landing.y] == after.plan.footsteps[0].tolist()
    assert after.plan.footsteps[1, 1] - after.plan.footsteps[0, 1] == pytest.approx(0.2, abs=0.01)


def test_every_second_iteration_late_still_walks() -> None:
    ticks = count()
    pattern = Document(HRP2, deadline=50.0, clock=lambda: (0.0, 0.0, 0.0, 0.1)[next(ticks) % 4])
    trajectory = walk_pattern(pattern, HRP2, steady(Velocity(0.05, 0.0, 0.0)), 100)
    assert [interval.status for interval in trajectory.intervals[:4]] == [Status.SOLVED, Status.LATE] * 2
    assert np.abs(trajectory.com[:, 0, 1]).max() < 0.2


def test_late_from_the_first_iteration_stands() -> None:
    trajectory = walk_pattern(Document(HRP2, deadline=0.0), HRP2, steady(Velocity(0.1, 0.0, 0.0)), 20)
    np.testing.assert_allclose(trajectory.feet[:, 0, :, :2], trajectory.feet[:1, 0, :, :2].repeat(600, 0), atol=1e-12)


def test_no_answer_is_told_and_never_used() -> None:
    pattern = Document(HRP2)
    *_, (state, _) = walked(pattern, 5)
    twisted = state._replace(yaw=np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]))
    _, interval = pattern.step(twisted, Velocity(0.1, 0.0, 0.0))
    assert interval.status is Status.INFEASIBLE
    np.testing.assert_array_equal(interval.jerk, state.plan.jerks[:, 1])
    for velocity in (Velocity(np.nan, 0.0, 0.0), Velocity(0.0, 0.0, np.inf)):
        _, interval = pattern.step(state, velocity)
        assert interval.status is Status.NOT_FINITE
        np.testing.assert_array_equal(interval.jerk, state.plan.jerks[:, 1])


@pytest.mark.parametrize(("change", "key"), [({"step_time": 0.75}, "step_time"), ({"hull": ()}, "hull")])
def test_a_gait_that_it_cannot_walk_is_refused(change: dict[str, object], key: str) -> None:
    with pytest.raises(BadInput, match=key):
        Document(replace(HRP2, **change))  # type: ignore[arg-type]


@pytest.mark.parametrize("gait", [HRP2, HEICUB], ids=["hrp2", "heicub"])
def test_whatever_comes_an_answer_keeps_its_constraints_or_is_none(gait: Gait) -> None:
    """Commands beyond reach, kicks, twisted soles, circles underfoot; judged by the ZMP and hull, not by the solver."""
    rng, pattern, told = np.random.default_rng(11), Document(gait), set()
    half = np.array([gait.foot_length, gait.foot_width]) / 2 - gait.margin
    for _ in range(12):
        circles = [
            Circle(rng.uniform(-2, 2), rng.uniform(-2, 2), rng.uniform(0.05, 0.4)) for _ in range(rng.integers(0, 4))
        ]
        state = pattern.start()
        for _ in range(30):
            kick = rng.normal(size=(2, 1)) * [0.0, 0.2 * (rng.random() < 0.05), 0.0]
            twist = rng.normal(size=(2, 3)) * (rng.random() < 0.03) * [0.02, 0.1, 0.0]
            state = state._replace(com=state.com + kick, yaw=state.yaw + twist)
            vx, vy, omega = rng.uniform(-1, 1, 3) * [0.4, 0.2, 0.5]
            command = Velocity(vx, vy, omega)
            before, (state, interval) = state, pattern.step(state, command, circles)
            told.add(interval.status)
            assert np.isfinite(state.com).all()
            if interval.status is Status.SOLVED and before.left > 1:
                c, s = np.cos(before.support.yaw), np.sin(before.support.yaw)
                offset = zero_moment_point(state.com, gait.com_height) - [before.support.x, before.support.y]
                assert np.all(np.abs([[c, s], [-s, c]] @ offset) < half + 1e-5)
            if abs(state.com).max() > 100:
                break
    assert told == {Status.SOLVED, Status.INFEASIBLE}
