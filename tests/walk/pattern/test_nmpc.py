"""One iteration against the same problem written from simulated motions, finite differences and a second solver."""

from __future__ import annotations

import numpy as np
import pytest
import quadprog
from walk import nmpc_oracle as oracle
from walk.gaits import HRP2
from walk.nmpc_cases import ICUB, random_circles, random_command, random_state

from toddle.signals import Velocity
from toddle.walk.pattern import nmpc as module
from toddle.walk.pattern.nmpc import STILL, Plan, PlanState, document_weights, nmpc, plan
from toddle.walk.pattern.nmpc_kernels import SLACK_BODY, SLACK_FEET, SLACK_ZMP, assemble, unfold
from toddle.walk.pattern.obstacles import NONE, near
from toddle.walk.pattern.plan import Status
from toddle.walk.pattern.quadratic import Answer

SLACKS = {"zmp": SLACK_ZMP, "capture": SLACK_ZMP, "foot": SLACK_FEET, "body": SLACK_BODY}


class Programme:
    """An iteration's least-distance problem, seen in the unknowns (jerks, feet along x; along y; yaws)."""

    def __init__(self, problem: module.Nmpc, state: PlanState, velocity: Velocity, circles: np.ndarray, last: Plan):
        place = np.array([state.support.x, state.support.y, 0.0])
        com = state.com.copy()
        com[:, 0] -= place[:2]
        yaws = module.turned(problem, state.support.yaw, velocity)
        moment, drawn = module._moment(state, velocity), module.drawn_to(problem, state, velocity)
        near_by = near(circles, state.support.x, state.support.y, 10.0)
        self.parts = assemble(
            problem.tables, problem.numbers, moment, com, drawn, yaws, last.feet - place, last.jerks, near_by, False
        )
        self.problem = self.parts[:5]
        self.matrix, self.low, self.high, _, self.slack, y, lower, inverse, shares, self.hard, self.soft = self.parts
        n = self.matrix.shape[1]

        def point(u: np.ndarray) -> np.ndarray:
            jerks, feet, *_ = unfold(
                u, problem.tables, problem.numbers, moment, self.matrix, self.low, self.high, y, lower, inverse,
                shares, yaws, self.hard, self.soft, place,
            )  # fmt: skip
            return np.concatenate([jerks[0], feet[:, 0], jerks[1], feet[:, 1], feet[:, 2]])

        self.origin = point(np.zeros(n))
        self.map = np.stack([point(row) - self.origin for row in np.eye(n)], axis=1)


def case(gait, seed, weights=None, most=3):
    """A random iteration whose last plan is a real one."""
    rng = np.random.default_rng(seed)
    problem, state = nmpc(gait, weights), random_state(gait, rng, kick=0.3)
    velocity = random_command(rng, 0.7) if state.halt == module.NEVER else STILL
    circles = random_circles(state, rng, most)
    return problem, state, velocity, circles, plan(problem, state, velocity, circles)


def at_command(problem, state, velocity, last):
    """The point of linearisation: the last plan, with the yaws of the command."""
    feet = last.feet.copy()
    feet[:, 2] = module.turned(problem, state.support.yaw, velocity)[1:]
    return last._replace(feet=feet)


@pytest.mark.parametrize("gait", [ICUB, HRP2])
@pytest.mark.parametrize("seed", range(4))
def test_the_cost_is_that_of_simulated_motions(gait, seed):
    problem, state, velocity, circles, last = case(gait, seed)
    programme = Programme(problem, state, velocity, circles, last)
    rng = np.random.default_rng(seed)
    lowest = oracle.cost(problem, state, velocity, programme.origin)
    for _ in range(5):
        u = rng.normal(size=programme.matrix.shape[1])
        risen = oracle.cost(problem, state, velocity, programme.origin + programme.map @ u) - lowest
        assert risen == pytest.approx(u @ u / 2, rel=1e-6, abs=1e-9 * abs(lowest))


@pytest.mark.parametrize("gait", [ICUB, HRP2])
@pytest.mark.parametrize("seed", range(6))
def test_the_rows_are_the_constraints_and_their_derivatives(gait, seed):
    problem, state, velocity, circles, last = case(gait, seed)
    last = at_command(problem, state, velocity, last)
    programme = Programme(problem, state, velocity, circles, last)
    here = oracle.packed(last)
    u = np.linalg.solve(programme.map, here - programme.origin)

    def values(x: np.ndarray) -> np.ndarray:
        return np.array([row.value for row in oracle.rows(problem, state, velocity, circles, here, x)])

    rows = oracle.rows(problem, state, velocity, circles, here, here)
    wanted = [(row.low - row.value, row.high - row.value) for row in rows]
    kept = kept_rows(programme, rows)
    got_low, got_high = programme.low - programme.matrix @ u, programme.high - programme.matrix @ u
    np.testing.assert_allclose(np.maximum(got_low[kept], -1e9), np.maximum([w[0] for w in wanted], -1e9), atol=2e-7)
    np.testing.assert_allclose(np.minimum(got_high[kept], 1e9), np.minimum([w[1] for w in wanted], 1e9), atol=2e-7)
    slopes = programme.matrix[kept] @ np.linalg.inv(programme.map)
    for i in range(len(here)):
        step = np.zeros(len(here))
        step[i] = 1e-6 if i >= 2 * (problem.gait.preview + problem.gait.steps) else 1e-4
        slope = (values(here + step) - values(here - step)) / (2 * step[i])
        np.testing.assert_allclose(slopes[:, i], slope, atol=2e-6)


def kept_rows(programme, rows):
    """Where the oracle's rows stand among the programme's: the two capture rows come between."""
    capture = sum(row.kind in ("hull", "turn", "zmp") for row in rows)
    index = np.arange(len(rows) + 2)
    assert len(index) == len(programme.matrix)
    return np.delete(index, [capture, capture + 1])


@pytest.mark.parametrize("seed", range(25))
def test_a_second_solver_finds_the_same_plan(seed):
    problem, state, velocity, circles, last = case(ICUB, seed)
    programme = Programme(problem, state, velocity, circles, last)
    found = plan(problem, state, velocity, circles, last)
    assert found.status == Status.SOLVED
    n, m = programme.matrix.shape[1], len(programme.matrix)
    soft = m - programme.hard
    hessian = np.diag(np.concatenate([np.ones(n), 1 / programme.slack[programme.hard :]]))
    slack = np.vstack([np.zeros((programme.hard, soft)), np.eye(soft)])
    above = np.hstack([programme.matrix, slack])[programme.low > -1e29]
    below = np.hstack([-programme.matrix, slack])[programme.high < 1e29]
    bounds = np.concatenate([programme.low[programme.low > -1e29], -programme.high[programme.high < 1e29]])
    scale = np.concatenate([np.ones(n), np.sqrt(programme.slack[programme.hard :])])
    rows = np.vstack([above, below]) * scale
    u = quadprog.solve_qp(hessian * scale * scale[:, None], np.zeros(n + soft), rows.T, bounds)[0][:n]
    if state.remaining > problem.freeze or state.halt == 0:
        wanted = programme.origin + programme.map @ u
        np.testing.assert_allclose(oracle.packed(found)[-9:], wanted[-9:], atol=1e-6)
        np.testing.assert_allclose(found.feet[:, 0], wanted[16:19], atol=1e-6)
        np.testing.assert_allclose(found.jerk, wanted[[0, 19]], atol=1e-3)


@pytest.mark.parametrize("seed", range(60))
def test_an_answer_keeps_its_hard_constraints_or_is_the_shifted_last_plan(seed):
    rng = np.random.default_rng(seed)
    problem, state = nmpc(ICUB), random_state(ICUB, rng, kick=float(rng.choice([0.0, 1.0, 10.0])))
    velocity, circles = random_command(rng, 2.0), random_circles(state, rng, 8)
    first = plan(problem, state, velocity, circles)
    other = random_command(rng, 2.0)
    second = plan(problem, state, other, circles, first)
    for found, asked in ((first, velocity), (second, other)):
        asked = asked if state.halt == module.NEVER else STILL
        assert np.isfinite([*found.jerk, *found.feet.ravel(), *found.zmp.ravel(), found.milliseconds]).all()
        if found.status == Status.SOLVED:
            x = oracle.packed(found)
            for row in oracle.rows(problem, state, asked, NONE, x, x):
                if row.kind in ("hull", "turn") and state.remaining > problem.freeze:
                    assert row.low - 2e-3 <= row.value <= row.high + 2e-3


def test_document_weights_leave_the_feet_to_the_objective():
    problem = nmpc(HRP2, document_weights(HRP2))
    rng = np.random.default_rng(3)
    found = plan(problem, random_state(HRP2, rng), Velocity(0.1, 0.0, 0.0))
    assert found.status == Status.SOLVED
    assert np.isfinite(found.feet).all()


def standing_walk():
    problem, rng = nmpc(ICUB), np.random.default_rng(5)
    state = random_state(ICUB, rng)._replace(phase=0.2, remaining=0.4, halt=module.NEVER)
    velocity = Velocity(0.2, 0.0, 0.1)
    return problem, state, velocity, plan(problem, state, velocity)


def test_a_late_answer_is_the_last_plan_shifted():
    problem, state, velocity, last = standing_walk()
    later = state._replace(phase=0.3, remaining=0.3)
    found = plan(problem, later, velocity, last=last, deadline_ms=1e-3)
    assert found.status == Status.LATE
    np.testing.assert_array_equal(found.jerks[:, :-1], last.jerks[:, 1:])
    np.testing.assert_array_equal(found.jerk, last.jerks[:, 1])
    np.testing.assert_array_equal(found.feet, last.feet)


def test_after_a_landing_the_shifted_plan_has_one_more_foot_by_the_command():
    problem, state, velocity, last = standing_walk()
    landed = module.Footstep(1 - state.support.side, *last.feet[0])
    later = state._replace(support=landed, lifted=state.support, phase=0.0, remaining=0.6)
    found = plan(problem, later, velocity, last=last, deadline_ms=1e-3)
    assert found.status == Status.LATE
    np.testing.assert_array_equal(found.feet[:-1], last.feet[1:])
    np.testing.assert_array_equal(found.jerks[:, 0], last.jerks[:, 4])
    np.testing.assert_allclose(found.feet[-1], module.nominal(problem, later, velocity).feet[-1], atol=0.05)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_not_finite_never_come_through(bad):
    problem, state, velocity, last = standing_walk()
    com = state.com.copy()
    com[1, 1] = bad
    for broken, speed, known in [
        (state._replace(com=com), velocity, last),
        (state._replace(com=com), velocity, None),
        (state._replace(phase=bad), velocity, last),
        (state._replace(support=state.support._replace(x=bad)), velocity, None),
        (state, Velocity(bad, 0.0, 0.0), last),
        (state, Velocity(bad, 0.0, 0.0), None),
    ]:
        found = plan(problem, broken, speed, NONE, known)
        assert found.status == Status.NOT_FINITE
        assert np.isfinite([*found.jerk, *found.feet.ravel(), *found.zmp.ravel()]).all()


@pytest.mark.parametrize("status", [Status.INFEASIBLE, Status.LATE, Status.NOT_FINITE])
def test_what_the_solver_refuses_is_not_used(status, monkeypatch):
    problem, state, velocity, last = standing_walk()
    monkeypatch.setattr(module, "least_distance", lambda *_: Answer(np.full(41, np.nan), status, 0))
    found = plan(problem, state, velocity, last=last)
    assert found.status == status
    np.testing.assert_array_equal(found.feet, last.feet)


def test_a_point_that_breaks_a_hard_row_is_not_used(monkeypatch):
    problem, state, velocity, last = standing_walk()
    monkeypatch.setattr(module, "least_distance", lambda *_: Answer(np.full(41, 30.0), Status.SOLVED, 0))
    assert plan(problem, state, velocity, last=last).status == Status.INFEASIBLE


def test_a_landing_that_comes_too_soon_stays_where_it_was():
    problem, state, _, _ = standing_walk()
    state = state._replace(phase=0.56, remaining=0.04)
    last = plan(problem, state, Velocity(0.1, 0.0, 0.0))
    found = plan(problem, state, Velocity(0.3, 0.1, -0.3), last=last)
    np.testing.assert_allclose(found.feet[0], last.feet[0], atol=1e-8)
    assert np.abs(found.feet[1] - last.feet[1]).max() > 0.02


def test_far_from_the_plan_s_origin_nothing_changes():
    problem, state, velocity, last = standing_walk()
    far = np.array([3e4, -2e4])
    com = state.com.copy()
    com[:, 0] += far
    moved = state._replace(
        com=com,
        support=state.support._replace(x=state.support.x + far[0], y=state.support.y + far[1]),
        lifted=state.lifted._replace(x=state.lifted.x + far[0], y=state.lifted.y + far[1]),
        origin=(state.origin[0] + far[0], state.origin[1] + far[1]),
    )
    found = plan(problem, moved, velocity)
    np.testing.assert_allclose(found.jerk, last.jerk, atol=1e-6)
    np.testing.assert_allclose(found.feet[:, :2] - far, last.feet[:, :2], atol=1e-8)
