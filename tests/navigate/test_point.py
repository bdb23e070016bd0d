"""The point that walks to a goal: rewards add up to the way gained, and each end is what it says."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from toddle.navigate.task import Continuous, Outcome, Step, Task
from toddle.navigate.tasks.point import PRIZE, PointState, PointTask

KEY = jax.random.key(0)
STEP = jax.jit(PointTask.step, static_argnums=0)


def at(goal: tuple[float, float], agent: tuple[float, float] = (0.0, 0.0), steps: int = 0) -> PointState:
    return PointState(jnp.array(agent, jnp.float32), jnp.array(goal, jnp.float32), jnp.int32(steps))


def go(task: PointTask, state: PointState, x: float, y: float) -> tuple[PointState, Step]:
    return STEP(task, state, jnp.array([x, y], jnp.float32), KEY)


def test_it_is_a_task():
    assert isinstance(PointTask(), Task)
    assert PointTask().actions == Continuous(2)


def test_goals_are_whole_numbers_of_the_whole_square():
    state, seen = jax.vmap(PointTask().start)(jax.random.split(KEY, 3000))
    goals = {tuple(goal) for goal in np.asarray(state.goal).tolist()}
    assert goals == {(float(x), float(y)) for x in range(-5, 6) for y in range(-5, 6)}
    np.testing.assert_array_equal(state.agent, 0)
    np.testing.assert_array_equal(seen, np.concatenate([state.agent, state.goal], axis=1))


def test_rewards_of_an_episode_are_the_way_gained_and_the_prize():
    task, (state, step) = PointTask(), go(PointTask(), at((3.0, 4.0)), 0.6, 0.8)
    total, steps = float(step.reward), 1
    while int(step.outcome) == Outcome.GOES_ON:
        state, step = go(task, state, 0.6, 0.8)
        total, steps = total + float(step.reward), steps + 1
    # strides of 0.1 along the way of 5: nearer than 0.6 after 45
    assert (steps, int(step.outcome)) == (45, Outcome.WON)
    assert bool(step.terminated)
    assert not bool(step.truncated)
    assert total == pytest.approx(4.5 + PRIZE, abs=1e-4)


def test_too_far_is_lost():
    _, step = go(PointTask(), at((5.0, 0.0), (-4.95, 0.0)), -1.0, 0.0)
    assert int(step.outcome) == Outcome.LOST
    assert bool(step.terminated)
    assert float(step.reward) == pytest.approx(-0.1 - PRIZE, abs=1e-4)


def test_late_is_cut_off_and_not_the_end():
    _, step = go(PointTask(longest=7), at((5.0, 0.0), steps=6), 1.0, 0.0)
    assert (int(step.outcome), bool(step.truncated), bool(step.terminated)) == (Outcome.LATE, True, False)
    _, won = go(PointTask(longest=7), at((0.5, 0.0), steps=6), 1.0, 0.0)
    assert (int(won.outcome), bool(won.truncated), bool(won.terminated)) == (Outcome.WON, False, True)
    _, endless = go(PointTask(), at((5.0, 0.0), steps=10**6), 1.0, 0.0)
    assert int(endless.outcome) == Outcome.GOES_ON
