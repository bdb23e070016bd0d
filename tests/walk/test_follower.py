"""The document's walker: it follows the document's plan, in physics and without it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from toddle.failures import BadInput
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.robots.catalogue import HUMANOIDS
from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT, RIGHT, Humanoid
from toddle.robots.humanoids import load_humanoid
from toddle.signals import Circle, Reference, Senses, Velocity
from toddle.walk.follower import Follower, follower
from toddle.walk.follower_state import FollowerConfig, FollowerState
from toddle.walk.loop import Moment, walk
from toddle.walk.pattern.document import Document
from toddle.walk.pattern.trajectory import walk_pattern
from toddle.walk.state import Mode

STILL = Velocity(0.0, 0.0, 0.0)
CURVE = Velocity(0.15, 0.0, 0.2)


@pytest.fixture(scope="module")
def heicub() -> Humanoid:
    return load_humanoid("heicub")


@pytest.fixture(scope="module")
def gait() -> Gait:
    found = HUMANOIDS["heicub"].document_gait
    assert found is not None
    return found


@pytest.fixture(scope="module")
def senses(heicub: Humanoid) -> Senses:
    return HumanoidSimulation(heicub).reset()


def planned(
    walks: Follower, senses: Senses, command: Callable[[float], Velocity], ticks: int, circles: tuple[Circle, ...] = ()
) -> list[tuple[FollowerState, Reference]]:
    """Without physics: the senses stay as they are, so that what comes out is the plan."""
    state, seen = walks.start(), []
    for _ in range(ticks):
        state, action = walks.step(state, command(state.t), senses, circles)
        seen.append((state, action.reference))
    return seen


def walked(walks: Follower, velocity: Velocity, seconds: float) -> list[Moment]:
    return list(walk(walks, HumanoidSimulation(walks.humanoid), lambda t: velocity if t < seconds else None))


def zmp_error(moments: list[Moment]) -> float:
    return float(np.mean([np.linalg.norm(m.measured.zmp - m.reference.zmp) for m in moments]))


def test_it_walks_two_steps_and_stops_in_physics(heicub: Humanoid, gait: Gait) -> None:
    moments = walked(follower(heicub, gait), CURVE, 6.0)
    last = moments[-1]
    assert not any(moment.fell for moment in moments)
    assert {moment.support for moment in moments} == {-1, LEFT, RIGHT}
    assert last.t < 6.0 + 3.5 * gait.step_time
    assert zmp_error(moments) < 0.01
    np.testing.assert_allclose(last.measured.com[:2], last.measured.feet[:, :2].mean(axis=0), atol=0.01)
    assert last.measured.feet[:, 0].min() > 0.01


def test_without_servo_feed_forward_the_zmp_is_farther_off(heicub: Humanoid, gait: Gait) -> None:
    with_it, without = (
        zmp_error(walked(follower(heicub, gait, FollowerConfig(feed_forward=on)), CURVE, 3.0)) for on in (True, False)
    )
    assert with_it < 0.8 * without


def test_what_is_asked_of_the_body_is_the_document_s_trajectory(heicub: Humanoid, gait: Gait, senses: Senses) -> None:
    walks = follower(heicub, gait)
    steps = [(s, r) for s, r in planned(walks, senses, lambda t: CURVE, 1000) if s.mode == Mode.STEP]
    expected = walk_pattern(Document(walks.gait), walks.gait, lambda t: CURVE, len(steps) // 40)
    for row, (_, reference) in enumerate(steps[: len(expected.t)]):
        np.testing.assert_allclose(reference.com[:, :2], expected.com[row, :, :2], atol=1e-9)
        np.testing.assert_allclose(reference.feet, expected.feet[row, 0], atol=1e-9)
        np.testing.assert_allclose(reference.zmp, expected.zmp[row], atol=1e-9)
        assert reference.yaw[0] == pytest.approx(expected.com[row, 0, 3])


def test_the_plan_never_jumps_and_ends_at_rest(heicub: Humanoid, gait: Gait, senses: Senses) -> None:
    def twice(t: float) -> Velocity:
        return CURVE if t < 4 or 15 < t < 18 else STILL

    seen = planned(follower(heicub, gait), senses, twice, 2900)
    com = np.array([r.com for _, r in seen])
    feet = np.array([r.feet for _, r in seen])
    assert [s.mode for s, _ in seen].count(Mode.STAND) > 200
    assert seen[1480][0].mode == Mode.STAND
    assert seen[-1][0].mode == Mode.STAND
    np.testing.assert_allclose(np.diff(com[:, 0], axis=0), 0.005 * (com[1:, 1] + com[:-1, 1]), atol=1e-5)
    speed = np.abs(np.array([r.feet_velocity for _, r in seen]))
    assert (np.abs(np.diff(feet, axis=0)) - 0.01 * np.maximum(speed[1:], speed[:-1])).max() < 1e-4
    np.testing.assert_allclose(com[-1, 0, :2], feet[-1, :, :2].mean(axis=0), atol=1e-12)
    assert np.abs(com[-1, 1:]).max() == 0


def test_the_load_lies_on_feet_that_stand(heicub: Humanoid, gait: Gait, senses: Senses) -> None:
    for state, reference in planned(follower(heicub, gait), senses, lambda t: CURVE, 900):
        assert reference.load.sum() == pytest.approx(1)
        assert reference.load.min() >= 0
        if reference.feet[:, 2].max() > 1e-6:
            assert reference.load[int(reference.feet[:, 2].argmax())] == 0
            assert state.step.stance == int(reference.load.argmax())


def test_obstacles_are_seen_from_where_the_robot_is(heicub: Humanoid, gait: Gait, senses: Senses) -> None:
    x, y, _ = senses.place.tolist()
    moved = senses._replace(place=np.array([3.0 - y, 1.0 + x, np.pi / 2]))
    walks, ahead = follower(heicub, gait), Velocity(0.15, 0.0, 0.0)

    def ends(told: Senses, *circles: Circle) -> np.ndarray:
        return np.stack([s.anchors for s, _ in planned(walks, told, lambda t: ahead, 900, circles)])

    free = ends(senses)
    near = ends(senses, Circle(0.65, 0.1, 0.2))
    np.testing.assert_allclose(ends(moved, Circle(3.0 - 0.1, 1.0 + 0.65, 0.2)), near, atol=1e-6)
    assert near[-1, :, 0].max() < free[-1, :, 0].max() - 0.02
    lost = senses._replace(place=np.full(3, np.nan))
    np.testing.assert_array_equal(ends(lost, Circle(0.65, 0.1, 0.2)), free)


@pytest.mark.parametrize(
    "bad", [{"feedback": 1.5}, {"feedback": float("nan")}, {"shift_time": 0.0}, {"stop_time": -1.0}]
)
def test_options_out_of_range_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(BadInput, match="follower option"):
        replace(FollowerConfig(), **bad)


def test_samples_that_no_tick_meets_are_refused(heicub: Humanoid, gait: Gait) -> None:
    with pytest.raises(BadInput, match="whole number of ticks"):
        follower(heicub, replace(gait, sample=0.405, step_time=3.24))


def test_the_first_tick_already_commands_every_servo(heicub: Humanoid, gait: Gait) -> None:
    moments = walk(follower(heicub, gait), HumanoidSimulation(heicub), lambda t: STILL)
    first = next(islice(moments, 1))
    assert first.reference.com[0, 2] == pytest.approx(heicub.gait.com_height)
