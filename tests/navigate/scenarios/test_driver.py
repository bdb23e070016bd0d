"""The driver by script reaches every goal with the robot without legs."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from toddle.navigate.scenarios.driver import drive
from toddle.navigate.task import Outcome
from toddle.navigate.tasks.unicycle import unicycle
from toddle.navigate.tasks.walker import WalkerTask


def test_all_goals_are_reached() -> None:
    task = WalkerTask(unicycle())

    def driven(key: jax.Array) -> tuple[jax.Array, jax.Array]:
        def once(now: tuple, _: None) -> tuple[tuple, tuple[jax.Array, jax.Array]]:
            state, goal = now
            state, step = task.step(state, drive(goal), key)
            return (state, step.observation), (step.outcome, step.terminated | step.truncated)

        outcome, ended = jax.lax.scan(once, task.start(key), None, 600)[1]
        first = jnp.argmax(ended)
        return outcome[first], first

    outcome, steps = jax.jit(jax.vmap(driven))(jax.random.split(jax.random.key(0), 500))
    assert (np.asarray(outcome) == Outcome.WON).all()
    assert int(steps.max()) < 300


@pytest.mark.parametrize(
    ("goal", "ahead", "turn"), [((2.0, 0.0), 1.0, 0.0), ((0.0, 1.0), 0.0, 1.0), ((-1.0, -0.1), 0.0, -1.0)]
)
def test_it_walks_where_it_faces_and_turns_to_the_nearer_side(
    goal: tuple[float, float], ahead: float, turn: float
) -> None:
    np.testing.assert_allclose(drive(jnp.array(goal)), [ahead, turn], atol=1e-6)


def test_it_slows_down_before_the_goal() -> None:
    assert drive(jnp.array([0.2, 0.0]))[0] < drive(jnp.array([0.5, 0.0]))[0]
