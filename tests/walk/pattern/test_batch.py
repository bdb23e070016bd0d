"""Many walkers at once give each the plan that it would have had alone."""

from __future__ import annotations

from functools import lru_cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from walk.gaits import HEICUB, HRP2
from walk.nmpc_cases import ICUB, random_circles, random_command, random_state

from toddle.outside.batch_solver import cores
from toddle.signals import Circle, Velocity
from toddle.walk.pattern import batch_command as command
from toddle.walk.pattern.batch import plan_batch, start_batch, step_batch
from toddle.walk.pattern.batch_daqp import plan_each
from toddle.walk.pattern.batch_state import STATUSES, BatchPlan, padded, single, stacked
from toddle.walk.pattern.feasible import cap, fits, widening
from toddle.walk.pattern.nmpc import nmpc
from toddle.walk.pattern.plan import Status
from toddle.walk.pattern.reduced import Reduced

WALKERS = 64
MOST = 3


@lru_cache
def cases(kick: float):
    """States, commands, circles; and the plans of the walkers alone, the first and the one after it."""
    rng, problem = np.random.default_rng(7), nmpc(ICUB)
    states = stacked([random_state(ICUB, rng, kick) for _ in range(WALKERS)], np.float64)
    before, now = (np.array([random_command(rng, 0.7) for _ in range(WALKERS)]) for _ in range(2))
    circles = padded([random_circles(single(states, i), rng, MOST) for i in range(WALKERS)], np.float64)
    first = plan_each(problem, states, before, circles)
    second = plan_each(problem, states, now, circles, first)
    return problem, states, (before, now), circles, (first, second)


def cast(dtype, *parts):
    return jax.tree.map(lambda x: jnp.asarray(x, dtype if np.asarray(x).dtype.kind == "f" else None), parts)


def apart(one: BatchPlan, other: BatchPlan) -> np.ndarray:
    """The greatest difference of a footstep of each walker [m]."""
    return np.abs(np.asarray(one.feet, float) - other.feet)[..., :2].max(axis=(1, 2))


@pytest.mark.parametrize(("dtype", "kick", "most"), [(np.float64, 0.3, 2e-4), (np.float32, 0.0, 1e-3)])
def test_the_footsteps_are_those_of_the_walkers_alone(dtype, kick, most):
    problem, states, commands, circles, (first, second) = cases(kick)
    with jax.enable_x64(dtype == np.float64):
        states, commands, circles, last = cast(dtype, states, commands, circles, first)
        fresh = last._replace(known=jnp.zeros(WALKERS, bool))
        cold, warm = (
            plan_batch(problem, states, velocity, circles, before)
            for velocity, before in zip(commands, (fresh, last), strict=True)
        )
        assert apart(cold, first).max() < most
        assert apart(warm, second).max() < most
        for found, wanted in ((cold, first), (warm, second)):
            np.testing.assert_array_equal(found.status, wanted.status)
            np.testing.assert_allclose(found.feet[..., 2], wanted.feet[..., 2], atol=1e-3)
            np.testing.assert_allclose(found.displacement, wanted.displacement, atol=2 * most)
            np.testing.assert_allclose(found.zmp, wanted.zmp, atol=2 * most)
            np.testing.assert_allclose(found.violation, wanted.violation, atol=1e-4)
            np.testing.assert_allclose(found.overlap, wanted.overlap, atol=2 * most)
    pinned = (first.state.remaining <= problem.freeze) & (first.state.halt != 0)
    assert pinned.any()


def test_the_first_jerk_is_that_of_the_walkers_alone():
    problem, states, (before, _), circles, (first, _) = cases(0.3)
    with jax.enable_x64(True):
        found = plan_batch(problem, *cast(np.float64, states, before, circles, first._replace(known=~first.known)))
    np.testing.assert_allclose(found.jerks[..., 0], first.jerks[..., 0], atol=0.1)  # 0.02 mm in a sample


def test_numbers_that_are_not_finite_stay_with_their_walker():
    problem, states, (before, _), circles, (first, _) = cases(0.0)
    states, before, circles, fresh = cast(
        np.float32, states, before, circles, first._replace(known=np.zeros(WALKERS, bool))
    )
    bad = states._replace(com=states.com.at[0, 0, 1].set(jnp.nan), phase=states.phase.at[1].set(jnp.inf))
    found = plan_batch(problem, bad, before.at[2, 0].set(jnp.nan), circles.at[3, 0, 0].set(jnp.nan), fresh)
    assert all(np.isfinite(part).all() for part in jax.tree.leaves(found))
    refused = [STATUSES[int(status)] for status in found.status[:4]]
    halts = np.asarray(states.halt)[2] != -1
    assert refused[:2] == [Status.NOT_FINITE] * 2
    assert refused[2] == (Status.SOLVED if halts else Status.NOT_FINITE)
    assert (np.asarray(found.status)[4:] == 0).all()
    assert apart(found, first)[4:].max() < 1e-3


@pytest.mark.parametrize("gait", [ICUB, HRP2, HEICUB])
def test_commands_are_widened_and_capped_as_for_one(gait):
    rng = np.random.default_rng(2)
    asked = [random_command(rng, 3.0) for _ in range(60)]
    with jax.enable_x64(True):
        wide, fit = jax.vmap(lambda v: command.widening(gait, v))(jnp.array(asked))
        slow = jax.vmap(lambda v: command.cap(gait, v))(jnp.array(asked))
    np.testing.assert_array_equal(fit, [fits(v, gait) for v in asked])
    np.testing.assert_allclose(wide, [widening(v, gait) or 0.0 for v in asked], atol=1e-9)
    np.testing.assert_allclose(slow, np.array([cap(v, gait) for v in asked]), atol=1e-6)


def test_walks_close_over_themselves_as_one_does():
    walkers, iterations = 4, 24
    asked = np.array([[0.2, 0.0, 0.0], [0.0, 0.05, 0.2], [0.9, 0.4, 0.9], [0.1, -0.05, -0.3]])
    commands = np.where(np.arange(iterations)[:, None, None] < 14, asked, 0.0)
    field = [[Circle(0.5, 0.1, 0.1)], [], [], [Circle(0.4, -0.3, 0.1)]]
    circles = padded([np.array(some).reshape(-1, 3) for some in field])
    pattern = Reduced(ICUB)

    def step(walk, velocity):
        walk = step_batch(pattern.problem, walk, velocity, circles)
        return walk, (walk.at, walk.plan.status)

    start = start_batch(pattern.problem, walkers)
    _, (states, statuses) = jax.jit(lambda walk, rows: jax.lax.scan(step, walk, rows))(
        start, jnp.asarray(commands, jnp.float32)
    )
    assert (np.asarray(statuses) == 0).all()
    for w in range(walkers):
        state = pattern.start()
        for k in range(iterations):
            state, _ = pattern.step(state, Velocity(*commands[k, w].tolist()), field[w])
            got = single(jax.tree.map(lambda part, k=k: part[k], states), w)
            np.testing.assert_allclose(got.com[:, 0], state.at.com[:, 0], atol=1e-3)
            np.testing.assert_allclose(got.support[1:], state.at.support[1:], atol=1e-3)
            assert (got.support.side, got.halt) == (state.at.support.side, state.at.halt)
            np.testing.assert_allclose(got.phase, state.at.phase, atol=1e-4)


def test_cores_share_the_walkers_and_keep_their_order():
    problem, states, (before, now), circles, (first, second) = cases(0.0)
    with cores(problem, 2) as pool:
        found = pool.plan(states, before, circles)
        after = pool.plan(states, now, circles, first)
    np.testing.assert_array_equal(found.feet, first.feet)
    np.testing.assert_array_equal(after.feet, second.feet)
    np.testing.assert_array_equal(found.state.com, states.com)
