"""Explorers against plain-Python transcriptions of their algorithms."""

from __future__ import annotations

from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from toddle.reach.explore.explorer import Explorer, Home, Proposal
from toddle.reach.explore.goal_and_motor import GoalAndMotorBabbling
from toddle.reach.explore.motor import ContinuousMotorBabbling, MotorBabbling

HOME = Home(jnp.array([0.5, 0.4, 0.6]), jnp.array([0.3, 0.7]))
SLOPES = np.array([[1.3, -0.4], [0.3, 1.2], [-0.9, 0.8]])


def answer(x: jax.Array) -> jax.Array:
    """Some inverse estimate, rough enough to saturate now and then."""
    return HOME.q + jnp.asarray(SLOPES, jnp.float32) @ (x - HOME.x)


def body(q: jax.Array) -> jax.Array:
    """Some forward kinematics in the unit box."""
    return 0.5 + 0.5 * jnp.stack([jnp.cos(5 * q[0] + q[2]), jnp.sin(4 * q[1] - q[2])])


def run(explorer: Explorer, count: int, seed: int = 0) -> tuple[Proposal, jax.Array, jax.Array]:
    """Proposals, positions and weights of so many movements."""
    noise = explorer.draw(jax.random.key(seed), count, HOME)

    def step(state, drawn):
        state, proposal = explorer.propose(state, drawn, answer, HOME)
        x = body(proposal.q)
        state, weight = explorer.observe(state, proposal, x, HOME)
        return state, (proposal, x, weight)

    return jax.lax.scan(step, explorer.init(HOME), noise)[1]


@pytest.mark.parametrize(
    ("size", "ends", "draws", "restart", "stall"),
    [(0.3, "any", "signs", "last", 0.1), (0.7, "any", "uniform", "home", 0.1), (0.3, "all", "signs", "last", 0.0)],
)
def test_goal_and_motor_babbling_is_algorithm_1(
    size: float,
    ends: Literal["any", "all"],
    draws: Literal["signs", "uniform"],
    restart: Literal["last", "home"],
    stall: float,
) -> None:
    """Mahboob 2015, algorithm 1 and equations 4.7 to 4.9, with the readings of what it leaves open."""
    explorer = GoalAndMotorBabbling(jnp.float32(size), ends, draws, restart, stall)
    count = 400
    drawn = explorer.draw(jax.random.key(0), count, HOME)
    goal_noise, motor_noise = np.array(drawn.goal, float), np.array(drawn.motor, float)
    proposals, seen, weights = run(explorer, count)

    reached, lines, new_line = np.array(HOME.x, float), 0, True
    goal_step = motor_step = np.zeros(0)
    for t in range(count):
        if new_line:
            goal_step, motor_step = size * goal_noise[t], size * motor_noise[t]
            reached = np.array(HOME.x, float) if restart == "home" else reached
            lines += 1
        goal = reached + goal_step
        motors = np.array(HOME.q, float) + SLOPES @ (goal - np.array(HOME.x, float)) + motor_step
        commanded = np.minimum(np.maximum(motors, 0), 1)
        np.testing.assert_allclose(proposals.goal[t], goal, atol=1e-4)
        np.testing.assert_allclose(proposals.q[t], commanded, atol=1e-4)
        saturated = [bool(m <= 0 or m >= 1) for m in motors]
        x = np.array(seen[t], float)
        new_line = any(saturated) if ends == "any" else all(saturated)
        new_line = new_line or bool(np.linalg.norm(x - reached) < stall * np.linalg.norm(goal_step))
        reached = x
    assert (lines > 20) if ends == "any" else (lines < 5), lines
    assert np.all(np.array(weights) == 1.0)


def test_the_perturbation_of_signs_has_one_size_and_both_directions() -> None:
    noise = GoalAndMotorBabbling(jnp.float32(0.1)).draw(jax.random.key(1), 1000, HOME)
    for drawn in (noise.goal, noise.motor):
        assert set(np.unique(drawn)) == {-1.0, 1.0}
        np.testing.assert_allclose(np.mean(drawn, axis=0), 0.0, atol=0.15)


def test_motor_babbling_draws_postures_uniformly() -> None:
    q = np.array(run(MotorBabbling(), 4000)[0].q)
    for joint in q.T:
        counts, _ = np.histogram(joint, bins=10, range=(0, 1))
        assert counts.sum() == 4000
        assert counts.min() > 300
    np.testing.assert_allclose(np.corrcoef(q.T), np.eye(3), atol=0.06)


def test_continuous_babbling_is_a_reflected_walk() -> None:
    explorer = ContinuousMotorBabbling(jnp.float32(0.2))
    noise = np.array(explorer.draw(jax.random.key(3), 500, HOME), float)
    found = np.array(run(explorer, 500, seed=3)[0].q)
    q, reflected = np.array(HOME.q, float), 0
    for t in range(500):
        for joint in range(3):
            value = q[joint] + 0.2 * noise[t, joint]
            if value < 0:
                value, reflected = -value, reflected + 1
            elif value > 1:
                value, reflected = 2 - value, reflected + 1
            q[joint] = value
        np.testing.assert_allclose(found[t], q, atol=1e-3)
    assert reflected > 20
    assert np.abs(np.diff(found, axis=0)).max() <= 0.2 + 1e-6


@pytest.mark.parametrize(
    "explorer", [GoalAndMotorBabbling(jnp.float32(0.5)), MotorBabbling(), ContinuousMotorBabbling(jnp.float32(1.0))]
)
def test_nothing_beyond_the_joint_limits_is_proposed(explorer: Explorer) -> None:
    q = np.array(run(explorer, 500)[0].q)
    assert q.min() >= 0.0
    assert q.max() <= 1.0


def test_chunks_go_on_where_the_last_one_ended() -> None:
    """State is all that is carried over: one scan of 60 movements is two of 30 with the same noise."""
    explorer = GoalAndMotorBabbling(jnp.float32(0.233))
    noise = explorer.draw(jax.random.key(5), 60, HOME)

    def step(state, drawn):
        state, proposal = explorer.propose(state, drawn, answer, HOME)
        state, _ = explorer.observe(state, proposal, body(proposal.q), HOME)
        return state, proposal.q

    whole = jax.lax.scan(step, explorer.init(HOME), noise)[1]
    first, rest = jax.tree.map(lambda leaf: leaf[:30], noise), jax.tree.map(lambda leaf: leaf[30:], noise)
    state, one = jax.lax.scan(step, explorer.init(HOME), first)
    two = jax.lax.scan(step, state, rest)[1]
    np.testing.assert_array_equal(whole, np.concatenate([one, two]))
