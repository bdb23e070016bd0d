"""Gymnasium environments: what is collected from each kind of vector environment, resuming, spaces, refusals."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, cast

import gymnasium
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.envs.registration import register, registry
from gymnasium.error import DependencyNotInstalled
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from hypothesis import given
from hypothesis import strategies as st

from toddle.failures import BadInput
from toddle.navigate.policy import policy_of
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.presets import PRESETS, preset
from toddle.navigate.task import Continuous, Discrete
from toddle.navigate.tasks.point import PointState, PointTask
from toddle.outside.navigation.gym_point import POINT, PointEnv
from toddle.outside.navigation.gym_task import GymSpaces, opened
from toddle.outside.navigation.gym_training import GymTraining
from toddle.outside.navigation.gym_trial import gym_episodes

SMALL = PpoConfig(actors=3, horizon=16, minibatch=16, epochs=2, hidden=(4,), steps=480)
MODES = list(AutoresetMode)


class Counting(gymnasium.Env[np.ndarray, Any]):
    """Shows episode and step; episode e lasts e + 2 steps; even ones terminate, odd ones are cut off."""

    def __init__(self) -> None:
        self.observation_space = spaces.Box(0, 1000, (2, 1), np.float64)
        self.action_space = spaces.Discrete(2, start=5)
        self.episode, self.at = -1, 0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray, dict]:
        super().reset(seed=seed)
        self.episode, self.at = (0 if seed is not None else self.episode + 1), 0
        return self._seen(), {}

    def step(self, action: int) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        assert self.action_space.contains(action)
        self.at += 1
        over = self.at == self.episode + 2
        return self._seen(), float(self.at), over and self.episode % 2 == 0, over and self.episode % 2 == 1, {}

    def _seen(self) -> np.ndarray:
        return np.array([[self.episode], [self.at]], np.float64)


class Matching(gymnasium.Env[Any, Any]):
    """One step: the action that was shown earns 1."""

    def __init__(self) -> None:
        self.observation_space, self.action_space = spaces.Discrete(2, start=3), spaces.Discrete(2, start=-1)
        self.shown = 0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[int, dict[str, Any]]:
        super().reset(seed=seed)
        self.shown = int(self.np_random.integers(2))
        return self.shown + 3, {}

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        return self.shown + 3, float(action + 1 == self.shown), True, False, {}


class Shaped(gymnasium.Env[Any, Any]):
    """Spaces as asked for."""

    def __init__(self, observation: spaces.Space, action: spaces.Space) -> None:
        self.observation_space, self.action_space = observation, action


def _missing() -> gymnasium.Env:
    raise DependencyNotInstalled("Box2D is not installed, run `pip install x`\nand more")


def _fails() -> gymnasium.Env:
    raise RuntimeError("no licence\nfound")


BOX = spaces.Box(-1, 1, (2,), np.float32)
USELESS = {
    "Dict": (lambda: Shaped(spaces.Dict(a=BOX), BOX), "Dict observations"),
    "Tuple": (lambda: Shaped(spaces.Tuple([BOX]), BOX), "Tuple observations"),
    "Nothing": (lambda: Shaped(spaces.Box(0, 1, (0,)), BOX), "Box observations"),
    "Multi": (lambda: Shaped(BOX, spaces.MultiDiscrete([2, 2])), "MultiDiscrete actions"),
    "Endless": (lambda: Shaped(BOX, spaces.Box(-np.inf, 1, (2,))), "without bounds"),
    "Whole": (lambda: Shaped(BOX, spaces.Box(0, 9, (2,), np.int32)), "int32"),
    "Missing": (_missing, "Box2D is not installed"),
    "Fails": (_fails, "RuntimeError: no licence"),
}


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    """The environments of these tests, for as long as they last."""
    before = set(registry)
    for mode in MODES:
        register(f"Counting{mode.value}-v0", cast(Any, Counting), vector_entry_point=_vector(mode))
    register("Silent-v0", vector_entry_point=cast(Any, _silent))
    register("Matching-v0", cast(Any, Matching))
    for name, (entry, _) in USELESS.items():
        register(f"{name}-v0", entry)
    yield
    for name in set(registry) - before:
        del registry[name]


def _vector(mode: AutoresetMode) -> Any:
    return lambda num_envs: SyncVectorEnv([Counting] * num_envs, autoreset_mode=mode)


def _silent(num_envs: int) -> SyncVectorEnv:
    env = SyncVectorEnv([Counting] * num_envs)
    del env.metadata["autoreset_mode"]
    return env


def _expected(steps: int) -> list[tuple[float, ...]]:
    """Of `Counting`, by hand: episode, step before and after, reward, terminated, truncated, length, total."""
    rows, episode = [], 0
    while len(rows) < steps:
        last = episode + 2
        for at in range(last):
            over = at + 1 == last
            end = (float(over and episode % 2 == 0), float(over and episode % 2 == 1))
            rows.append((episode, at, at + 1, at + 1, *end, at + 1, (at + 1) * (at + 2) / 2))
        episode += 1
    return rows[:steps]


@pytest.mark.parametrize("mode", MODES)
def test_rows_are_the_steps_that_were_made_however_copies_begin_anew(mode: AutoresetMode) -> None:
    learner = GymTraining(f"Counting{mode.value}-v0", SMALL)
    training = learner.init(jax.random.key(0))
    actors, rows = learner.collect(training)
    for copy in range(SMALL.actors):
        got = np.column_stack([
            rows.seen[:, copy], rows.after[:, copy, 1], rows.reward[:, copy], rows.terminated[:, copy],
            rows.truncated[:, copy], rows.length[:, copy], rows.total[:, copy],
        ])  # fmt: skip
        np.testing.assert_array_equal(got, _expected(SMALL.horizon))
        np.testing.assert_array_equal(rows.after[:, copy, 0], rows.seen[:, copy, 0])
        np.testing.assert_array_equal(rows.started[:, copy], rows.seen[:, copy, 1] == 0)
    assert rows.seen.dtype == rows.reward.dtype == np.float32
    # 16 steps of episodes of 2, 3, 4, 5 and 6 steps end in the third of the fifth
    np.testing.assert_array_equal(np.asarray(actors.observation), [[4.0, 2.0]] * SMALL.actors)
    discounted = [0.0]
    for reward, over in zip(rows.reward[:, 0], (rows.terminated | rows.truncated)[:, 0], strict=True):
        assert rows.discounted[len(discounted) - 1, 0] == pytest.approx(discounted[-1] * SMALL.gamma + reward)
        discounted.append(0.0 if over else discounted[-1] * SMALL.gamma + reward)


def test_a_copy_that_waits_holds_up_no_other() -> None:
    from toddle.outside.navigation.gym_copies import Copies

    copies = Copies("CountingNextStep-v0", 2)
    copies.begin(0)
    found = [copies.step(np.zeros(2, np.int32)) for _ in range(3)]
    assert [step.real.all() for step in found] == [True, True, False]
    assert not found[2].real.any()
    np.testing.assert_array_equal(found[2].following, [[1.0, 0.0]] * 2)


def test_what_is_remembered_is_what_the_networks_remember() -> None:
    config = PpoConfig(actors=2, horizon=12, minibatch=12, memory=3, sequence=4, hidden=(4,))
    learner = GymTraining("CountingSameStep-v0", config)
    training = learner.init(jax.random.key(1))
    rows = learner.collect(training)[1]
    memory = jnp.zeros((2, 2, 3), jnp.float32)
    for step in range(config.horizon):
        if rows.started[step, 0]:
            memory = jnp.zeros((2, 2, 3), jnp.float32)
        np.testing.assert_allclose(rows.memory[step, 0], memory, atol=1e-6)
        seen = training.observations.normalised(jnp.asarray(rows.seen[step, 0]))
        given, _, memory = training.network(seen, memory)
        assert rows.log_prob[step, 0] == pytest.approx(
            float(given.log_prob(jnp.asarray(rows.action[step, 0]))), abs=1e-5
        )


def test_a_run_taken_up_again_goes_on_bit_for_bit() -> None:
    through = GymTraining("Pendulum-v1", SMALL, anew_every=2)
    training = through.init(jax.random.key(3))
    for _ in range(2):
        training, _ = through.advance(training)
    saved = training
    for _ in range(3):
        training, _ = through.advance(training)
    again, resumed = GymTraining("Pendulum-v1", SMALL, anew_every=2), saved
    for _ in range(3):
        resumed, _ = again.advance(resumed)
    jax.tree.map(np.testing.assert_array_equal, _plain(resumed), _plain(training))
    assert not np.array_equal(training.network.actor.weights[0], saved.network.actor.weights[0])


def _plain(training: Any) -> Any:
    return training._replace(key=jax.random.key_data(training.key))


def test_it_learns_what_is_shown() -> None:
    config = PpoConfig(
        actors=8, horizon=32, minibatch=64, epochs=4, hidden=(8,), learning_rate=0.01, steps=10_000, gamma=0.5
    )
    learner = GymTraining("Matching-v0", config)
    training, report = learner.advance(learner.init(jax.random.key(0)))
    assert 0.3 < float(report.return_) < 0.7
    for _ in range(20):
        training, report = learner.advance(training)
    assert float(report.return_) > 0.95
    assert float(report.length) == 1.0
    assert int(report.episodes) == config.batch
    policy = policy_of(training, config, learner.copies.spaces.actions)
    assert gym_episodes("Matching-v0", policy, 7, 20).total.tolist() == [1.0] * 20
    with pytest.raises(BadInput, match=r"Pendulum-v1: the policy sees 2 numbers, the environment shows 3"):
        gym_episodes("Pendulum-v1", policy, 7, 2)


@pytest.mark.parametrize("mode", MODES)
def test_an_episode_is_counted_once(mode: AutoresetMode) -> None:
    learner = GymTraining(f"Counting{mode.value}-v0", SMALL)
    policy = policy_of(learner.init(jax.random.key(0)), SMALL, learner.copies.spaces.actions)
    for noisy in (False, True):
        found = gym_episodes(f"Counting{mode.value}-v0", policy, 5, 4, noisy=noisy)
        assert found.total.tolist() == [3.0] * 4
        assert found.length.tolist() == [2] * 4
        assert not found.truncated.any()


@given(st.lists(st.floats(-3, 3, width=32), min_size=2, max_size=2))
def test_actions_reach_their_bounds_and_no_further(drawn: list[float]) -> None:
    low, high = np.array([[-2.0], [1.0]], np.float32), np.array([[2.0], [4.0]], np.float32)
    asked = GymSpaces("a", BOX, spaces.Box(low, high)).asked(np.array([drawn], np.float32))
    assert asked.shape == (1, 2, 1)
    expected = [min(max(2 * drawn[0], -2.0), 2.0), min(max(2.5 + 1.5 * drawn[1], 1.0), 4.0)]
    np.testing.assert_allclose(asked[0, :, 0], expected, atol=1e-5)


def test_spaces_are_flat_numbers() -> None:
    picture = spaces.Box(0, 255, (2, 3), np.uint8)
    flat = GymSpaces("a", picture, spaces.Discrete(4, start=2))
    assert (flat.observations, flat.actions) == (6, Discrete(4))
    assert flat.seen(np.arange(12, dtype=np.uint8).reshape(2, 2, 3)).tolist() == [[*range(6)], [*range(6, 12)]]
    assert flat.asked(np.array([0, 3], np.int32)).tolist() == [2, 5]
    shown = GymSpaces("a", spaces.Discrete(3, start=-1), BOX)
    assert (shown.observations, shown.actions) == (3, Continuous(2))
    assert shown.seen(np.array([-1, 1])).tolist() == [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]


@pytest.mark.parametrize("name", USELESS)
def test_what_is_of_no_use_is_refused_in_one_line(name: str) -> None:
    with pytest.raises(BadInput, match=USELESS[name][1]) as refused:
        opened(f"{name}-v0", 2)
    assert refused.value.line.startswith(f"{name}-v0: ")
    assert "\n" not in refused.value.line


@pytest.mark.filterwarnings("ignore:.*missing AutoresetMode")
@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("Pendulun-v1", "no environment named 'Pendulun-v1'; did you mean Pendulum-v1"),
        ("Pendulum", "did you mean Pendulum-v1"),
        ("Pendulum-v9", "did you mean Pendulum-v1"),
        ("no_such_module:A-v0", "no module named no_such_module"),
        ("", "no environment"),
        ("json:a:c", "json:a"),
        ("json:Pendulun-v1", "did you mean Pendulum-v1"),
        ("Silent-v0", "begins anew"),
    ],
)
def test_a_name_that_is_none_is_refused(name: str, expected: str) -> None:
    with pytest.raises(BadInput, match=expected) as refused:
        opened(name, 2)
    assert "\n" not in refused.value.line


@given(st.integers(0, 10_000), st.lists(st.tuples(*[st.floats(-2, 2, width=32)] * 2), max_size=40))
def test_the_point_is_the_point(seed: int, actions: list[tuple[float, float]]) -> None:
    env = PointEnv(longest=30)
    seen, _ = env.reset(seed=seed)
    state = PointState(jnp.asarray(seen[:2]), jnp.asarray(seen[2:]), jnp.zeros((), jnp.int32))
    for action in actions:
        mine = env.step(np.array(action, np.float32))
        state, step = _STEP(state, jnp.array(action, jnp.float32))
        np.testing.assert_allclose(mine[0], step.observation, atol=1e-5)
        assert mine[1] == pytest.approx(float(step.reward), abs=1e-5)
        assert mine[2:4] == (bool(step.terminated), bool(step.truncated))
        assert mine[4]["outcome"] == int(step.outcome)
        if mine[2] or mine[3]:
            break


_STEP = jax.jit(lambda state, action: PointTask(longest=30).step(state, action, jax.random.key(0)))


def test_the_point_is_an_environment_and_its_goals_are_everywhere() -> None:
    check_env(gymnasium.make(POINT).unwrapped, skip_render_check=True)
    env = PointEnv()
    goals = {tuple(env.reset(seed=seed)[0][2:].tolist()) for seed in range(2000)}
    assert goals == {(float(x), float(y)) for x in range(-5, 6) for y in range(-5, 6)}


def test_presets_fit_what_they_are_named_for() -> None:
    assert preset("Acrobot-v1") == PpoConfig()
    for name in PRESETS.keys() & registry.keys():
        opened(name, 1)[0].close()
        assert preset(name) is PRESETS[name]
