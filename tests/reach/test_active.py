"""Random goals, and exploration by learning progress."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.reach.explore.active import (
    ActiveGoalExploration,
    ActiveMotorExploration,
    Choice,
    Interest,
    choose,
    grid,
    note,
    nothing_tried,
    region_of,
)
from toddle.reach.explore.explorer import Explorer, Home
from toddle.reach.explore.goal import GoalBabbling

HOME = Home(jnp.array([0.5, 0.4, 0.6, 0.2]), jnp.array([0.3, 0.7]))
EXPLORE = jnp.float32(0.2)


def run(explorer: Explorer, count: int, body, answer) -> tuple[np.ndarray, np.ndarray]:
    """The joint values and goals of so many movements."""
    noise = explorer.draw(jax.random.key(0), count, HOME)

    def step(state, drawn):
        state, proposal = explorer.propose(state, drawn, answer, HOME)
        state, _ = explorer.observe(state, proposal, body(proposal.q), HOME)
        return state, (proposal.q, proposal.goal)

    q, goals = jax.jit(lambda: jax.lax.scan(step, explorer.init(HOME), noise)[1])()
    return np.array(q), np.array(goals)


def drawn(count: int, axes: int) -> Choice:
    """Choices without motor noise."""
    numbers = jax.random.uniform(jax.random.key(5), (count, axes + 2))
    return Choice(numbers[:, 0], numbers[:, 1], numbers[:, 2:], jnp.zeros((count, 0)))


def test_interest_is_the_difference_of_the_means_of_a_window_s_halves() -> None:
    interest, errors = nothing_tried(2, 4), [0.9, 0.8, 0.5, 0.4, 0.1]
    for k, error in enumerate(errors):
        interest = jax.jit(note)(interest, jnp.int32(7), jnp.float32(error))
        assert float(interest.progress[7]) == pytest.approx([0, 0, 0, 0.4, 0.4][k], abs=1e-6)
    np.testing.assert_allclose(interest.errors[7], errors[1:])
    assert int(jnp.sum(interest.entries)) == 5
    assert float(jnp.sum(interest.progress)) == pytest.approx(0.4, abs=1e-6)


def test_regions_are_chosen_in_proportion_to_their_interest() -> None:
    _, parts = grid(2)
    progress = np.zeros(parts**2, np.float32)
    progress[3], progress[58] = 0.3, 0.1
    known = Interest(jnp.zeros((parts**2, 4)), jnp.full(parts**2, 4), jnp.array(progress))
    count = 20_000
    points = jax.jit(jax.vmap(partial(choose, known, explore=EXPLORE)))(drawn(count, 2))
    tried = np.bincount(np.array(jax.vmap(region_of)(points)), minlength=parts**2) / count
    everywhere = 0.2 / parts**2
    assert tried[3] == pytest.approx(0.8 * 0.75 + everywhere, abs=0.02)
    assert tried[58] == pytest.approx(0.8 * 0.25 + everywhere, abs=0.02)
    others = np.delete(tried, [3, 58])
    assert others.sum() == pytest.approx(0.2 * 98 / 100, abs=0.02)
    assert others.min() > 0
    in_region = np.array(points)[np.array(jax.vmap(region_of)(points)) == 3] * parts % 1
    np.testing.assert_allclose(np.histogram(in_region[:, 0], 4, (0, 1))[0] / len(in_region), 0.25, atol=0.02)


@given(st.sampled_from([1, 2, 3, 12]), st.floats(0, 1, width=32))
def test_with_nothing_tried_any_point_of_the_box_can_come(axes: int, number: float) -> None:
    place = jnp.linspace(0.0, 1.0, axes)
    choice = Choice(jnp.float32(number), jnp.float32(1.0), place, jnp.zeros(0))
    point = jax.jit(choose)(nothing_tried(axes, 4), choice, EXPLORE)
    assert bool(jnp.all((point >= 0) & (point <= 1)))
    cut, parts = grid(axes)
    assert int(region_of(point)) < parts**cut <= 125
    np.testing.assert_allclose(point[cut:], place[cut:])


def test_goals_go_to_where_competence_changes() -> None:
    """A body that gets better with practice where x0 < 0.2 and fails alike everywhere else."""
    explorer = ActiveGoalExploration(jnp.float32(0.0), EXPLORE)
    count = 6000
    noise = explorer.draw(jax.random.key(0), count, HOME)

    def step(carry, drawn):
        state, practice = carry
        state, proposal = explorer.propose(state, drawn, lambda x: HOME.q, HOME)
        better = (proposal.goal[0] < 0.2) & (practice < 3000)
        missed = jnp.where(better, 0.5 - practice.astype(jnp.float32) / 6000, 0.5)
        state, weight = explorer.observe(state, proposal, proposal.goal + jnp.stack([missed, 0.0 * missed]), HOME)
        return (state, practice + better.astype(jnp.int32)), (proposal.goal, weight)

    start = (explorer.init(HOME), jnp.int32(0))
    (_, practice), (goals, weights) = jax.jit(lambda: jax.lax.scan(step, start, noise))()
    share = np.mean(np.array(goals)[3000:, 0] < 0.2)
    assert np.all(np.array(weights) == 1.0)
    assert int(practice) > 1500  # one in five at random would be 1200
    assert share > 0.4


def test_postures_go_to_where_the_inverse_estimate_changes() -> None:
    """Answers are right but where the first joint is in its lowest fifth: there they get better and worse with time."""
    explorer, count = ActiveMotorExploration(EXPLORE), 4000
    home = Home(jnp.array([0.5, 0.5]), jnp.array([0.5, 0.5]))

    def step(carry, drawn):
        state, time = carry
        answer = lambda x: x + jnp.where(x[0] < 0.2, 0.3 + 0.3 * jnp.sin(time / 100), 0.0)  # noqa: E731
        state, proposal = explorer.propose(state, drawn, answer, home)
        state, weight = explorer.observe(state, proposal, proposal.q, home)
        return (state, time + 1.0), (proposal.q, weight)

    noise, start = explorer.draw(jax.random.key(0), count, home), (explorer.init(home), jnp.float32(0.0))
    _, (q, weights) = jax.jit(lambda: jax.lax.scan(step, start, noise))()
    assert np.mean(np.array(q)[2000:, 0] < 0.2) > 0.6  # at random: 0.2
    assert np.all(np.array(weights) == 1.0)


def test_random_goals_fill_the_box_and_are_answered_by_the_learner() -> None:
    answer = lambda x: jnp.concatenate([2 * x - 0.5, x])  # noqa: E731
    q, goals = run(GoalBabbling(jnp.float32(0.0)), 4000, lambda q: q[:2], answer)
    for axis in goals.T:
        assert np.histogram(axis, 10, (0, 1))[0].min() > 320
    expected = np.clip(np.concatenate([2 * goals - 0.5, goals], axis=1), 0, 1)
    np.testing.assert_allclose(q, expected, atol=1e-5)
    noisy, goals = run(GoalBabbling(jnp.float32(0.05)), 4000, lambda q: q[:2], lambda x: jnp.full(4, 0.5))
    np.testing.assert_allclose(np.std(noisy - 0.5, axis=0), 0.05, rtol=0.1)
