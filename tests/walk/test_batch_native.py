"""Walkers by compiled active sets walk as each would alone, and as the batch in JAX does."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from walk.gaits import HEICUB, HRP2
from walk.nmpc_cases import ICUB, random_circles, random_command, random_state

from toddle.robots.gait import Gait
from toddle.signals import Circle, Velocity
from toddle.walk import gate
from toddle.walk.pattern import batch_gate, nmpc
from toddle.walk.pattern.active_set_kernels import INFEASIBLE, SOLVED, nearest
from toddle.walk.pattern.batch import start_batch, step_batch
from toddle.walk.pattern.batch_native import Gated, start_native, step_gated, step_native
from toddle.walk.pattern.batch_state import PADDING, STATUSES, padded
from toddle.walk.pattern.nmpc_problem import Nmpc
from toddle.walk.pattern.plan import Status
from toddle.walk.pattern.quadratic import least_distance
from toddle.walk.pattern.reduced import Reduced

WALKERS = 6


def commands(rng: np.random.Generator, iterations: int, walkers: int = WALKERS) -> np.ndarray:
    """A new command, or none, every few samples; some are far beyond what fits."""
    asked = np.array([random_command(rng, 1.5) for _ in range(iterations // 7 * walkers + walkers)])
    asked *= rng.random((len(asked), 1)) > 0.25
    return np.repeat(asked.reshape(-1, walkers, 3), 7, axis=0)[:iterations]


def field(rng: np.random.Generator, gait: Gait) -> list[np.ndarray]:
    """Circles around each walker's start, up to ten."""
    return [random_circles(Reduced(gait).start().at, rng, 10) + np.array([0.3, 0.0, 0.0]) for _ in range(WALKERS)]


def programmes(monkeypatch: pytest.MonkeyPatch, gait: Gait, kick: float, count: int) -> list[tuple]:
    """What the controller asks its solver at random moments, and the answers."""
    asked, rng, problem = [], np.random.default_rng(11), nmpc.nmpc(gait)

    def solver(*parts):
        asked.append((parts, least_distance(*parts)))
        return asked[-1][1]

    monkeypatch.setattr(nmpc, "least_distance", solver)
    for _ in range(count):
        state = random_state(gait, rng, kick)
        around = random_circles(state, rng, 8)
        last = nmpc.plan(problem, state, random_command(rng), around)
        nmpc.plan(problem, state, random_command(rng), around, last)
    return asked


@pytest.mark.parametrize(("gait", "kick"), [(ICUB, 0.0), (ICUB, 1.0), (HRP2, 0.3), (HEICUB, 1.0)])
def test_the_active_set_finds_what_daqp_finds(monkeypatch, gait, kick):
    asked = programmes(monkeypatch, gait, kick, 60)
    assert len(asked) > 100
    for (matrix, low, high, marks, slack, _), answer in asked:
        u = np.empty(matrix.shape[1])
        assert (nearest(matrix, low, high, marks, slack, u) == SOLVED) == (answer.status == Status.SOLVED)
        np.testing.assert_allclose(u, answer.u, atol=2e-6 * max(1.0, np.abs(answer.u).max()))


@given(st.integers(0, 10**6))
def test_dependent_rows_and_rows_that_contradict_each_other(seed):
    rng = np.random.default_rng(seed)
    matrix = rng.integers(-2, 3, (9, 3)).astype(float)  # more hard rows than unknowns, many of them the same
    inside = rng.normal(size=3) * rng.integers(0, 2)
    low = matrix @ inside - rng.random(9) * rng.integers(0, 2, 9)
    high, marks, slack = low + 2 * rng.random(9) * rng.integers(0, 2, 9), np.zeros(9, np.int32), np.ones(9)
    length = np.maximum(np.linalg.norm(matrix, axis=1), 1e-9)
    u = np.empty(3)
    found = nearest(matrix, low - 1e-6, high + 1e-6, marks, slack, u)
    if ((matrix @ inside <= high) & (matrix @ inside >= low)).all():
        assert found == SOLVED
    if found == SOLVED:
        value = matrix @ u
        assert (np.maximum(low - value, value - high) < 1e-5 * length).all()
        back = np.linalg.norm(u) - 1e-4
        assert back <= np.linalg.norm(inside) or not ((matrix @ inside <= high) & (matrix @ inside >= low)).all()
    twice = np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    apart = (np.array([1.0, -1e30]), np.array([1e30, 0.5]), marks[:2], slack[:2])
    assert nearest(twice, *apart, u) == INFEASIBLE


@pytest.mark.parametrize("gait", [ICUB, HRP2, HEICUB])
def test_walks_are_those_of_the_pattern_alone(gait):
    rng, pattern = np.random.default_rng(3), Reduced(gait)
    circles, asked = field(rng, gait), commands(rng, 84)
    walk, alone = start_native(pattern.problem, WALKERS), [pattern.start() for _ in range(WALKERS)]
    walked = 0.0
    for k, velocities in enumerate(asked):
        if k % 20 == 13:  # a push
            push = 0.1 * rng.normal(size=(WALKERS, 2))
            walk.at.com[:, :, 1] += push
            alone = [s._replace(at=s.at._replace(com=s.at.com.copy())) for s in alone]
            for state, speed in zip(alone, push, strict=True):
                state.at.com[:, 1] += speed
        walk = step_native(pattern.problem, walk, velocities, padded(circles, np.float64))
        for w in range(WALKERS):
            obstacles = [Circle(*row) for row in circles[w].tolist()]
            state, _ = pattern.step(alone[w], Velocity(*velocities[w].tolist()), obstacles)
            alone[w], at, plan = state, state.at, state.plan
            assert plan is not None
            assert (walk.at.side[w], walk.at.halt[w]) == (at.support.side, at.halt)
            assert STATUSES[walk.plan.status[w]] == plan.status
            size = max(1.0, float(np.abs(at.com).max()))
            np.testing.assert_allclose(walk.at.com[w], at.com, atol=2e-6 * size)
            np.testing.assert_allclose(walk.at.support[w], at.support[1:], atol=2e-6 * size)
            np.testing.assert_allclose(walk.plan.zmp[w], plan.zmp, atol=2e-6 * size)
            np.testing.assert_allclose(walk.plan.violation[w], plan.violation, atol=1e-5)
            times = (walk.at.phase[w], walk.at.remaining[w], walk.shift[w])
            np.testing.assert_allclose(times, (at.phase, at.remaining, state.shift), atol=1e-9)
            walked = max(walked, float(np.abs(at.com[:, 0]).max()))
    assert walked > 0.1


def test_single_precision_between_calls_and_the_batch_in_jax_walk_alike():
    rng, pattern = np.random.default_rng(8), Reduced(ICUB)
    asked = (0.5 * commands(rng, 28)).astype(np.float32)
    circles = padded([np.array([[1.5, 0.4, 0.2]])] * 3 + [np.zeros((0, 3))] * 3)

    def step(walk, velocities):
        walk = step_batch(pattern.problem, walk, velocities, jnp.asarray(circles))
        return walk, walk

    start = start_batch(pattern.problem, WALKERS)
    _, in_jax = jax.jit(lambda walk, rows: jax.lax.scan(step, walk, rows))(start, jnp.asarray(asked))
    double, single = (start_native(pattern.problem, WALKERS, dtype) for dtype in (np.float64, np.float32))
    for k, velocities in enumerate(asked):
        double = step_native(pattern.problem, double, velocities.astype(float), circles.astype(float))
        single = step_native(pattern.problem, single, velocities, circles)
        batch = jax.tree.map(lambda part, k=k: np.asarray(part[k]), in_jax)
        assert single.at.com.dtype == single.plan.jerks.dtype == single.shift.dtype == np.float32
        for other, most in ((single, 1e-5), (batch, 1e-3)):
            np.testing.assert_array_equal(other.at.side, double.at.side)
            np.testing.assert_array_equal(other.at.halt, double.at.halt)
            np.testing.assert_allclose(other.at.com[:, :, 0], double.at.com[:, :, 0], atol=most)
            np.testing.assert_allclose(other.at.support, double.at.support, atol=most)


def test_samples_under_one_command_and_threads_change_nothing():
    problem, rng = Reduced(ICUB).problem, np.random.default_rng(4)
    asked, circles = commands(rng, 8)[0], padded(field(rng, ICUB), np.float64)
    once = start_native(problem, WALKERS)
    for _ in range(12):
        once = step_native(problem, once, asked, circles)
    with ThreadPoolExecutor(3) as pool:

        def shared(part, walkers):
            list(pool.map(part, range(walkers), range(1, walkers + 1)))

        held = step_native(problem, start_native(problem, WALKERS), asked, circles, hold=12, shares=shared)
    jax.tree.map(lambda one, other: np.testing.assert_allclose(one, other, atol=1e-9), once, held)
    alone = step_native(problem, start_native(problem, WALKERS), asked, circles, hold=12)
    jax.tree.map(np.testing.assert_array_equal, alone, held)


def test_numbers_that_are_not_finite_stay_with_their_walker():
    problem = Reduced(ICUB).problem
    walk, asked = start_native(problem, 4), np.tile([0.2, 0.0, 0.1], (4, 1))
    good = step_native(problem, walk, asked, hold=6)
    walk.at.com[0, 0, 1] = np.nan
    asked[1, 0] = np.inf
    circles = np.full((4, 1, 3), PADDING)
    circles[2] = [np.nan, 0.0, 0.1]
    walk = step_native(problem, walk, asked, circles, hold=6)
    refused = [STATUSES[status] for status in walk.plan.status]
    assert refused == [Status.NOT_FINITE, Status.SOLVED, Status.NOT_FINITE, Status.SOLVED]
    assert walk.at.halt[1] == 0  # it stands
    assert all(np.isfinite(part).all() for part in jax.tree.leaves(walk.plan._replace(state=None)))
    np.testing.assert_array_equal(walk.at.com[3], good.at.com[3])


@lru_cache
def ready() -> Nmpc:
    return Reduced(ICUB).problem


numbers = st.floats(-1.0, 1.0, width=32) | st.sampled_from([np.nan, np.inf, 0.0])


@given(st.tuples(*[st.floats(-0.25, 0.25, width=32)] * 3), st.tuples(*[numbers] * 3))
def test_the_gate_is_the_gate(last, asked):
    wanted = gate.gate(Velocity(*last), Velocity(*asked), ICUB.fastest, ICUB.sample)
    array, before = np.array([asked], np.float32), np.array([last], np.float32)
    in_jax = batch_gate.gate(ICUB, jnp.asarray(before[0]), jnp.asarray(array[0]), ICUB.sample)
    np.testing.assert_allclose(in_jax, wanted, atol=1e-6)
    problem = ready()
    found = step_gated(problem, Gated(start_native(problem, 1), before.astype(float)), array.astype(float))
    np.testing.assert_allclose(found.allowed[0], wanted, atol=1e-12)
