"""The walker's task as a learner uses it; what it tells is recomputed in NumPy from where everything is."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.failures import BadInput
from toddle.navigate.scenarios.layouts import Layout
from toddle.navigate.task import Continuous, Outcome, Step, Task
from toddle.navigate.tasks.people import RADIUS, People
from toddle.navigate.tasks.rewards import DOCUMENT, Rewards
from toddle.navigate.tasks.unicycle import unicycle
from toddle.navigate.tasks.walker import Course, WalkerTask
from toddle.navigate.walks import Walks

WALKS = unicycle()
KEY = jax.random.key(0)
TASKS = {
    "document": WalkerTask(WALKS, far=3.2, seconds=15.0, rewards=DOCUMENT),
    "circles": WalkerTask(WALKS, circles=5, observe="full", seconds=15.0, far=3.2, rewards=DOCUMENT),
    "people": WalkerTask(
        WALKS, circles=3, people=4, observe="full", sideways=True, hold=4, told=True, far=3.5, rewards=DOCUMENT
    ),
}


def random_course(task: WalkerTask, key: jax.Array, steps: int) -> tuple[Course, Course, Step]:
    """One actor with random actions that change now and then, begun anew after each end: before, after, told."""

    def once(course: Course, key: jax.Array) -> tuple[Course, tuple[Course, Course, Step]]:
        act, move, anew = jax.random.split(key, 3)
        action = jnp.array([0.6, *[0.0] * (task.actions.size - 1)]) + jax.random.normal(act, (task.actions.size,))
        after, step = task.step(course, action, move)
        ended = step.terminated | step.truncated
        now = jax.tree.map(lambda new, old: jnp.where(ended, new, old), task.start(anew)[0], after)
        return now, (course, after, step)

    first, keys = jax.random.split(key)
    return jax.lax.scan(once, task.start(first)[0], jax.random.split(keys, steps))[1]


@pytest.fixture(scope="module", params=TASKS)
def played(request: pytest.FixtureRequest) -> tuple[WalkerTask, Course, Course, Step]:
    task = TASKS[request.param]
    play = jax.jit(jax.vmap(lambda key: random_course(task, key, 200)))
    before, after, step = play(jax.random.split(KEY, 64))
    return (task, *jax.tree.map(np.asarray, (before, after, step)))


def distance(course: Course) -> np.ndarray:
    return np.linalg.norm(np.asarray(course.goal) - np.asarray(course.place)[..., :2], axis=-1)


def gap(course: Course, body: float) -> np.ndarray:
    """Between the robot's edge and the nearest of circles and people [m]."""
    people = np.concatenate([course.people.place, np.full((*course.people.speed.shape, 1), RADIUS)], axis=-1)
    circles = np.concatenate([course.circles, people], axis=-2)
    away = np.linalg.norm(circles[..., :2] - course.place[..., None, :2], axis=-1) - circles[..., 2] - body
    return np.where(circles[..., 2] >= 0, away, np.inf).min(axis=-1, initial=np.inf)


def test_everything_stays_finite_and_has_its_shape(played: tuple[WalkerTask, Course, Course, Step]) -> None:
    task, _, _, step = played
    assert isinstance(task, Task)
    assert step.observation.shape == (64, 200, task.observations)
    assert step.observation.dtype == np.float32
    assert np.isfinite(step.observation).all()
    assert np.isfinite(step.reward).all()


def test_outcomes_are_what_geometry_says(played: tuple[WalkerTask, Course, Course, Step]) -> None:
    task, _, after, step = played
    far, near, late = distance(after), gap(after, task.body), after.steps * task.dt >= task.seconds - 1e-6
    expected = np.select(
        [near < 0, far <= task.near, far > task.far, late],
        [Outcome.COLLIDED, Outcome.WON, Outcome.LOST, Outcome.LATE],
        Outcome.GOES_ON,
    )
    close = np.min(np.abs([near, far - task.near, far - task.far]), axis=0) < 1e-5
    np.testing.assert_array_equal(step.outcome[~close], expected[~close])
    seen = set(np.unique(expected))
    assert len(seen) >= 3
    np.testing.assert_array_equal(step.truncated, step.outcome == Outcome.LATE)
    np.testing.assert_array_equal(step.terminated, np.isin(step.outcome, [1, 2, 3, 4]))


def test_the_goal_is_seen_in_the_robots_frame(played: tuple[WalkerTask, Course, Course, Step]) -> None:
    _, _, after, step = played
    way = (after.goal - after.place[..., :2]) @ np.array([1, 1j])
    seen = way * np.exp(-1j * after.place[..., 2])
    np.testing.assert_allclose(step.observation[..., :2], np.stack([seen.real, seen.imag], -1), atol=2e-5)


def test_the_reward_is_the_documents_sum(played: tuple[WalkerTask, Course, Course, Step]) -> None:
    task, before, after, step = played

    def frontal(course: Course) -> np.ndarray:
        way = course.goal - course.place[..., :2]
        return (np.cos(course.place[..., 2]) * way[..., 0] + np.sin(course.place[..., 2]) * way[..., 1]) / distance(
            course
        )

    terms = 6e3 * (distance(before) - distance(after)) + 2e3 * (frontal(after) - frontal(before))
    terms += -1e-1 * after.steps * task.dt + 100 * (step.outcome == Outcome.WON)
    failed = np.isin(step.outcome, [Outcome.LOST, Outcome.COLLIDED, Outcome.FELL])
    np.testing.assert_allclose(600 * step.reward, terms + 600 * task.rewards.failed * failed, atol=0.05)


def test_the_goal_terms_of_an_episode_add_up_to_the_distance_gained() -> None:
    rewards = Rewards(goal=1.0, frontal=0.0, late=0.0, won=0.0, failed=0.0)
    task = WalkerTask(WALKS, goal=(3.0, 3.0), far=30.0, rewards=rewards)
    before, after, step = jax.jit(lambda key: random_course(task, key, 300))(KEY)
    assert not bool((step.terminated | step.truncated).any())
    gained = distance(jax.tree.map(np.asarray, before))[0] - distance(jax.tree.map(np.asarray, after))[-1]
    np.testing.assert_allclose(step.reward.sum(), gained, atol=1e-4)


@given(turn=st.floats(-3.0, 3.0), x=st.floats(-5.0, 5.0), y=st.floats(-5.0, 5.0), seed=st.integers(0, 99))
def test_who_turns_and_shifts_the_world_sees_the_same(turn: float, x: float, y: float, seed: int) -> None:
    task = dataclasses.replace(TASKS["people"], people=2)
    course, _ = task.start(jax.random.key(seed))
    ahead = course.people.place + jnp.array([[3.0, 0.0]])  # nobody arrives in this step
    course = course._replace(people=course.people._replace(towards=ahead))
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])

    def moved(points: Any) -> jax.Array:
        return jnp.asarray(np.asarray(points) @ rotation.T + np.array([x, y]), jnp.float32)

    place = jnp.append(moved(course.place[:2]), course.place[2] + turn)
    other = course._replace(
        walker=course.walker._replace(place=place),
        place=place,
        goal=moved(course.goal),
        circles=jnp.column_stack([moved(course.circles[:, :2]), course.circles[:, 2]]),
        people=People(moved(course.people.place), moved(ahead), course.people.speed),
    )
    step = STEP(course, jnp.array([0.5, -0.2, 0.9]), KEY)
    again = STEP(other, jnp.array([0.5, -0.2, 0.9]), KEY)
    np.testing.assert_allclose(again.reward, step.reward, atol=1e-3)
    changes = 5 + 24
    sharp = np.abs(again.observation - step.observation)[:changes] > 1e-3
    assert sharp.sum() <= 1  # a ray that grazes a rim may be seen or not
    assert again.outcome == step.outcome


STEP = jax.jit(lambda *given: dataclasses.replace(TASKS["people"], people=2).step(*given)[1])


@pytest.mark.parametrize(
    ("place", "outcome"),
    [
        ((0.801, 0.0, 0.0), Outcome.WON),
        ((0.799, 0.0, 0.0), Outcome.GOES_ON),
        ((1.0, 0.199, 2.0), Outcome.WON),
        ((-1.999, 0.0, 0.0), Outcome.GOES_ON),
        ((-2.001, 0.0, 0.0), Outcome.LOST),
        ((1.0, -0.451, 0.0), Outcome.COLLIDED),
        ((1.0, -0.449, 0.0), Outcome.GOES_ON),
        ((math.nan, 0.0, 0.0), Outcome.FELL),
    ],
)
def test_how_an_episode_ends(place: tuple[float, float, float], outcome: Outcome) -> None:
    step = ended_at(jnp.array(place))
    assert step.outcome == outcome
    assert bool(step.terminated) == (outcome != Outcome.GOES_ON)
    assert np.isfinite(step.reward)
    assert np.isfinite(step.observation).all()


@jax.jit
def ended_at(place: jax.Array) -> Step:
    """A step of a walker that stays at a place; the goal is at (1, 0), one circle beside it, another is none."""
    task = WalkerTask(frozen(), goal=(1.0, 1.0), far=3.0, circles=2)
    where = Layout(jnp.array([1.0, 0.0]), jnp.array([[1.0, -0.75, 0.1], [1.0, 0.0, -1.0]]))
    course, _ = task.begin(where, KEY)
    return task.step(course._replace(walker=place), jnp.zeros(2), KEY)[1]


def frozen(**changed: Any) -> Walks:
    """A walker whose state is its place, and who stays there."""
    stays = Walks("frozen", (0.3, 0.1, 0.3), -0.12, 0.1, **PARTS)  # type: ignore[arg-type]
    return dataclasses.replace(stays, **changed)


PARTS = {
    "start": lambda: jnp.zeros(3),
    "advance": lambda state, asked, circles: state,
    "place": lambda state: state,
    "velocity": lambda state: jnp.zeros(3),
    "fallen": lambda state: jnp.zeros((), bool),
}


def test_a_walker_that_breaks_down_has_fallen_and_pays_for_it() -> None:
    task = WalkerTask(frozen(fallen=lambda state: jnp.ones((), bool)))
    step = task.step(task.start(KEY)[0], jnp.zeros(2), KEY)[1]
    assert step.outcome == Outcome.FELL
    assert step.reward < -9


def test_the_time_limit_cuts_off_and_does_not_terminate() -> None:
    task = WalkerTask(frozen(), seconds=0.5)
    state, outcomes = task.start(KEY)[0], []
    for _ in range(5):
        state, step = task.step(state, jnp.zeros(2), KEY)
        outcomes.append((int(step.outcome), bool(step.truncated), bool(step.terminated)))
    assert outcomes == [(0, False, False)] * 4 + [(5, True, False)]


@pytest.mark.parametrize("sideways", [False, True])
def test_actions_are_shares_of_the_fastest_and_backwards_of_the_slowest(sideways: bool) -> None:
    task = WalkerTask(WALKS, sideways=sideways)
    assert task.actions == Continuous(2 + sideways)
    aside = [0.5] if sideways else []
    expected = 0.05 if sideways else 0.0
    np.testing.assert_allclose(task.velocity(jnp.array([1.0, *aside, -1.0])), [0.3, expected, -0.3], rtol=1e-6)
    np.testing.assert_allclose(task.velocity(jnp.array([-0.5, *aside, 7.0])), [-0.06, expected, 0.3], rtol=1e-6)


def test_an_action_held_is_the_same_action_again() -> None:
    once, thrice = WalkerTask(WALKS), WalkerTask(WALKS, hold=3)
    state, held, action = once.start(KEY)[0], thrice.start(KEY)[0], jnp.array([0.8, 0.5])
    for _ in range(3):
        state = once.step(state, action, KEY)[0]
    held = thrice.step(held, action, KEY)[0]
    np.testing.assert_allclose(held.place, state.place, rtol=1e-6)
    assert thrice.dt == pytest.approx(0.3)


@pytest.mark.parametrize("told", [False, True])
def test_the_pattern_is_told_of_circles_and_people_if_it_is_to_be(told: bool) -> None:
    def advance(state: jax.Array, asked: jax.Array, circles: jax.Array) -> jax.Array:
        return state + jnp.array([float(len(circles)), 0.0, 0.0])

    task = WalkerTask(frozen(advance=advance), circles=5, people=2, told=told)
    course, _ = task.step(task.start(KEY)[0], jnp.zeros(2), KEY)
    assert course.place[0] == (7.0 if told else 0.0)


@pytest.mark.parametrize(
    ("options", "rays", "observations"),
    [
        ({}, 0, 2),
        ({"circles": 5}, 0, 2),
        ({"observe": "full"}, 0, 5),
        ({"observe": "full", "circles": 5}, 24, 29),
        ({"observe": "full", "people": 1}, 24, 53),
        ({"observe": "full", "circles": 1, "rays": 10}, 10, 15),
    ],
)
def test_how_many_numbers_are_observed(options: dict[str, Any], rays: int, observations: int) -> None:
    task = WalkerTask(WALKS, **options)
    assert (task.scan_rays, task.observations) == (rays, observations)
    assert task.start(KEY)[1].shape == (observations,)


def test_the_full_observation_is_goal_velocity_scan_and_change() -> None:
    task = WalkerTask(WALKS, observe="full", circles=1, people=1, rays=4, goal=(1.0, 1.0))
    where = Layout(jnp.array([0.0, 1.0]), jnp.array([[1.2, 0.0, 0.2]]))
    course, observation = task.begin(where, KEY)
    away = People(jnp.array([[-1.25, 0.0]]), jnp.array([[5.0, 0.0]]), jnp.array([0.4]))
    course = course._replace(people=away, seen=jnp.array([0.5, 1.0, 0.5, 1.0]))
    np.testing.assert_allclose(observation[:5], [0.0, 1.0, 0.0, 0.0, 0.0], atol=1e-6)
    step = task.step(course, jnp.zeros(2), KEY)[1]
    expected = [0.0, 1.0, 0.0, 0.0, 0.0, 0.5, 1.0, 0.48, 1.0, 0.0, 0.0, -0.2, 0.0]
    np.testing.assert_allclose(step.observation, expected, atol=1e-5)


@pytest.mark.parametrize(
    ("wrong", "where"),
    [
        ({"near": 0.6}, "goal"),
        ({"far": 2.0}, "goal"),
        ({"seconds": 0.0}, "seconds"),
        ({"reach": math.nan}, "reach"),
        ({"circles": -1}, "circles"),
        ({"rays": -1}, "rays"),
        ({"hold": 0}, "hold"),
    ],
)
def test_options_that_make_no_task_are_refused(wrong: dict[str, Any], where: str) -> None:
    with pytest.raises(BadInput, match=f"walker task, {where}"):
        WalkerTask(WALKS, **wrong)


@pytest.mark.usefixtures("unchecked")
def test_an_unknown_observation_is_refused() -> None:
    with pytest.raises(BadInput, match="document or full"):
        WalkerTask(WALKS, observe="everything")  # type: ignore[arg-type]
