"""The walking environment: Gymnasium's own checker, the walker by hand, seeds, the truth, and bad actions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from hypothesis import given
from hypothesis import strategies as st

from toddle.failures import BadInput, ToddleError
from toddle.outside.environment import WALK
from toddle.outside.environment.tracking import Place, mean_velocity, reward
from toddle.outside.environment.walk import WalkEnv
from toddle.outside.simulation.disturbances import Noise, WorldOptions
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.robots.humanoids import load_humanoid
from toddle.signals import STILL, Velocity
from toddle.walk.gate import gate
from toddle.walk.walker import walker

FASTEST = Velocity(0.3, 0.1, 0.3)
AHEAD = np.array([0.2, 0.0, 0.0], np.float32)


@pytest.fixture(scope="module")
def made() -> Iterator[WalkEnv]:
    """One for all tests: each of them resets it."""
    env = gymnasium.make(WALK).unwrapped
    assert isinstance(env, WalkEnv)
    yield env
    env.close()


def part(env: WalkEnv, seen: np.ndarray, name: str) -> np.ndarray:
    return seen[env.layout.parts[name]]


def steps(env: WalkEnv, action: np.ndarray, count: int) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
    """So many steps under one command, fewer if the episode ends; what the last one returned."""
    last = env.step(action)
    for _ in range(count - 1):
        assert env.observation_space.contains(last[0])
        if last[2] or last[3]:
            break
        last = env.step(action)
    return last


def draws_pictures(env: WalkEnv) -> bool:
    other = WalkEnv(render_mode="rgb_array", width=64, height=48)
    other.reset()
    try:
        return other.render() is not None
    except ToddleError:
        return False
    finally:
        other.close()


def test_gymnasiums_checker_has_nothing_to_say(made: WalkEnv) -> None:
    check_env(made, skip_render_check=not draws_pictures(made))


def test_stable_baselines_would_take_it(made: WalkEnv) -> None:
    for space in (made.observation_space, made.action_space):
        assert isinstance(space, gymnasium.spaces.Box)
        assert space.dtype == np.float32
        assert len(space.shape) == 1
        assert space.is_bounded()
    assert isinstance(made.action_space, gymnasium.spaces.Box)
    np.testing.assert_array_equal(made.action_space.high, np.array(made.humanoid.gait.fastest, np.float32))


def test_it_is_the_walker_by_hand(made: WalkEnv) -> None:
    """Ten ticks a step through the gate; neither looking at the truth nor rendering changes a bit of it."""
    made.reset(seed=0)
    robot = load_humanoid("heicub")
    controller, body = walker(robot), HumanoidSimulation(robot)
    state, senses, allowed = controller.start(), body.reset(), STILL
    commands = [AHEAD] * 12 + [np.array([0.1, 0.05, -0.2], np.float32)] * 6
    for number, ticks in enumerate([1] + [10] * len(commands)):
        asked = STILL if number == 0 else Velocity(*commands[number - 1].tolist())
        for _ in range(ticks):
            allowed = gate(allowed, asked, robot.gait.fastest, 0.01)
            state, action = controller.step(state, allowed, senses)
            senses = body.tick(action.servo)
        if number > 0:
            seen, _, _, _, info = made.step(commands[number - 1])
            np.testing.assert_array_equal(info["place"], body.truth().waist)
            np.testing.assert_array_equal(info["allowed"], np.array(allowed))
            np.testing.assert_array_equal(part(made, seen, "joints"), senses.joints.astype(np.float32))
            np.testing.assert_array_equal(part(made, seen, "gyro"), senses.gyro.astype(np.float32))
    assert state.t == pytest.approx(1.81)


def test_three_seconds_ahead_walk_and_are_rewarded(made: WalkEnv) -> None:
    made.reset(seed=0, options={"goal": AHEAD})
    seen, earned, fell, over, info = steps(made, AHEAD, 30)
    assert (fell, over, info["fell"]) == (False, False, False)
    assert info["t"] == pytest.approx(3.01)
    assert info["place"][0] > 0.2
    np.testing.assert_allclose(info["velocity"], AHEAD, atol=0.03)
    assert earned > 0.9
    np.testing.assert_array_equal(part(made, seen, "goal"), AHEAD)


def test_the_observation_is_what_the_body_does(made: WalkEnv) -> None:
    """Against MuJoCo's truth, which the observation does not know; both turn left on the way."""
    made.reset(seed=0)
    alone = 0
    for _ in range(25):
        seen, *_ = made.step(np.array([0.15, 0.0, 0.3], np.float32))
        truth = made.simulation.truth()
        cos, sin = math.cos(truth.waist[2]), math.sin(truth.waist[2])
        along = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
        np.testing.assert_allclose(part(made, seen, "com_velocity"), along @ truth.com_velocity, atol=0.06)
        np.testing.assert_allclose(part(made, seen, "up"), made.simulation.data.site("imu").xmat[6:9], atol=0.01)
        np.testing.assert_allclose(part(made, seen, "wrenches").reshape(2, 6)[:, 2], truth.load, atol=40.0)
        soles = part(made, seen, "soles").reshape(2, 4)
        np.testing.assert_allclose(soles[:, :3], (truth.soles[:, :3] - truth.com) @ along.T, atol=0.02)
        np.testing.assert_allclose(soles[:, 3], truth.soles[:, 3] - truth.waist[2], atol=0.03)
        left, right = part(made, seen, "support")
        assert (left, right) != (0.0, 0.0)
        if left != right:
            alone += 1
            side = 0 if left else 1
            assert truth.load[side] > 100.0
            dcm = truth.com[:2] + truth.com_velocity[:2] / made.humanoid.gait.omega - truth.soles[side, :2]
            np.testing.assert_allclose(part(made, seen, "dcm"), along[:2, :2] @ dcm, atol=0.03)
    assert alone > 5
    assert made.simulation.truth().waist[2] > 0.3


def test_a_seed_is_a_walk_bit_for_bit_and_another_seed_another() -> None:
    world = WorldOptions(noise=Noise(), mass_error=0.05)

    def walked(env: WalkEnv, seed: int) -> list[np.ndarray]:
        seen, _ = env.reset(seed=seed)
        return [seen, *(env.step(AHEAD)[0] for _ in range(8))]

    one, other = WalkEnv(world=world), WalkEnv(world=world)
    _ = walked(one, 3)
    first, again, different = walked(one, 7), walked(other, 7), walked(other, 8)
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(part(one, first[-1], "joints"), part(one, different[-1], "joints"))
    assert not np.array_equal(part(one, first[0], "goal"), part(one, different[0], "goal"))
    (following, _), (next_one, _) = one.reset(), one.reset()
    assert not np.array_equal(following, next_one)


def test_a_fall_ends_the_episode_and_costs(made: WalkEnv) -> None:
    made.reset(seed=0)
    made.simulation.push(60.0, 0.0)
    _, earned, fell, over, info = steps(made, np.zeros(3, np.float32), 40)
    assert (fell, over, info["fell"], earned) == (True, False, True, -1.0)
    with pytest.raises(ResetNeeded, match="reset"):
        made.step(AHEAD)
    _, info = made.reset()
    assert not info["fell"]


def test_the_time_runs_out() -> None:
    env = WalkEnv(seconds=0.4, step_seconds=0.2, goal=(0.1, 0.0, 0.0))
    with pytest.raises(ResetNeeded):
        env.step(AHEAD)
    _, info = env.reset()
    np.testing.assert_array_equal(info["goal"], [0.1, 0.0, 0.0])
    assert [env.step(AHEAD)[2:4] for _ in range(2)] == [(False, False), (False, True)]
    assert env.metadata["render_fps"] == 5
    with pytest.raises(ResetNeeded):
        env.step(AHEAD)
    env.close()
    env.close()


@pytest.mark.parametrize(
    "action",
    [[0.1, 0.0], [[0.1, 0.0, 0.0]], [math.nan, 0.0, 0.0], [0.0, math.inf, 0.0], ["a", 0, 0], None, 0.1, [[1], [2, 3]]],
)
@pytest.mark.usefixtures("unchecked")
def test_a_bad_action_is_refused_before_anything_moves(made: WalkEnv, action: Any) -> None:
    made.reset(seed=0)
    before = made.simulation.data.qpos.copy()
    with pytest.raises(BadInput, match=r"toddle/Walk-v0, action: .* is no velocity; give three finite numbers"):
        made.step(action)
    np.testing.assert_array_equal(made.simulation.data.qpos, before)
    made.step(AHEAD)


def test_an_action_out_of_range_is_capped(made: WalkEnv) -> None:
    made.reset(seed=0)
    *_, info = steps(made, np.array([9.0, 0.0, 0.0]), 12)
    assert info["allowed"][0] == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ({"robot": "heicup"}, "did you mean heicub"),
        ({"step_seconds": 0.015}, "step_seconds: 0.015 s is no multiple of 0.01 s"),
        ({"step_seconds": 0.0}, "no multiple"),
        ({"seconds": math.nan}, "nan s is no time"),
        ({"goal": (1.0, 0.0, 0.0)}, "goal: .* is too fast; at most 0.3, 0.1, 0.3"),
        ({"goal": "fast"}, "is no velocity"),
        ({"render_mode": "human"}, "no render mode named 'human'"),
    ],
)
@pytest.mark.usefixtures("unchecked")
def test_bad_arguments_are_refused_in_one_line(arguments: dict[str, Any], line: str) -> None:
    with pytest.raises(BadInput, match=line):
        WalkEnv(**arguments)


@pytest.mark.parametrize("options", [{"gaol": (0, 0, 0)}, {"goal": (math.nan, 0, 0)}, {"goal": (0, 0.2, 0)}])
def test_bad_options_are_refused(made: WalkEnv, options: dict[str, Any]) -> None:
    with pytest.raises(BadInput, match="toddle/Walk-v0"):
        made.reset(options=options)


def test_a_process_of_its_own_learns_of_it_by_its_id(made: WalkEnv) -> None:
    envs = gymnasium.make_vec(
        f"toddle.outside.environment:{WALK}",
        num_envs=1,
        vectorization_mode="async",
        vector_kwargs={"context": "spawn"},
        world=WorldOptions(friction=0.6),
    )
    try:
        first, _ = envs.reset(seed=1)
        seen, earned, fell, _, info = envs.step(np.zeros((1, 3), np.float32))
    finally:
        envs.close()
    assert seen.shape == first.shape == (1, made.layout.low.size)
    assert info["place"].shape == (1, 3)
    assert 0.0 < earned[0] < 1.0
    assert not fell[0]


SPEEDS = st.builds(Velocity, st.floats(-0.3, 0.3), st.floats(-0.1, 0.1), st.floats(-0.3, 0.3))


@given(SPEEDS, st.floats(-4.0, 4.0), st.floats(0.1, 2.0))
def test_the_mean_velocity_is_that_of_the_arc(velocity: Velocity, yaw: float, dt: float) -> None:
    """Integrated by small pieces; what a chord lacks of its arc is at most a twenty-fourth of the turn squared."""
    pieces = 2000
    yaws = yaw + velocity.omega * (np.arange(pieces) + 0.5) * dt / pieces
    dx = np.sum(velocity.vx * np.cos(yaws) - velocity.vy * np.sin(yaws)) * dt / pieces
    dy = np.sum(velocity.vx * np.sin(yaws) + velocity.vy * np.cos(yaws)) * dt / pieces
    end = Place(dt, 3.0 + dx, -1.0 + dy, math.remainder(yaw + velocity.omega * dt, 2 * math.pi))
    found = mean_velocity(Place(0.0, 3.0, -1.0, yaw), end)
    lost = (velocity.omega * dt) ** 2 / 24
    np.testing.assert_allclose(found, velocity, atol=1e-6 + lost * math.hypot(velocity.vx, velocity.vy))


@given(SPEEDS, SPEEDS)
def test_the_reward_is_greatest_at_the_goal_and_never_makes_a_fall_pay(velocity: Velocity, goal: Velocity) -> None:
    earned = reward(np.array(velocity), goal, FASTEST, fell=False)
    assert 0.0 < earned <= 1.0 == reward(np.array(goal), goal, FASTEST, fell=False)
    assert reward(np.array(velocity), goal, FASTEST, fell=True) == -1.0
    half = Velocity(goal.vx + 0.15, goal.vy, goal.omega)
    assert reward(np.array(half), goal, FASTEST, fell=False) == pytest.approx(math.exp(-1))
