"""The document's quadratic programmes against other derivations: simulation, geometry, finite differences, quadprog."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import quadprog
from scipy.linalg import null_space
from walk.gaits import HEICUB, HRP2

from toddle.robots.gait import Gait
from toddle.signals import Circle, Velocity
from toddle.walk.pattern import document
from toddle.walk.pattern.document import Document
from toddle.walk.pattern.document_problem import Programme, flying, model, positions, solve, yaw_jerks, yaws
from toddle.walk.pattern.document_rows import hull_by_yaw, hull_rows, obstacle_rows, zmp_by_yaw, zmp_rows
from toddle.walk.pattern.time_stepping import advance, zero_moment_point

RNG = np.random.default_rng(3)
CIRCLES = (Circle(1.6, 1.0, 1.0), Circle(-3.0, 0.5, 0.2))
THREE = replace(HRP2, preview=15, steps=3, step_time=0.5, foot_ahead=0.03)


def by_quadprog(programme: Programme) -> np.ndarray:
    bounds = len(programme.upper) - len(programme.rows)
    rows = np.concatenate([np.eye(len(programme.gradient))[:bounds], programme.rows])
    equal = slice(len(rows) - programme.equality, None)
    low, high = np.isfinite(programme.lower), np.isfinite(programme.upper)
    low[equal] = high[equal] = False
    normals = np.concatenate([rows[equal], rows[low], -rows[high]])
    least = np.concatenate([programme.upper[equal], programme.lower[low], -programme.upper[high]])
    return quadprog.solve_qp(programme.hessian, -programme.gradient, normals.T, least, programme.equality)[0]


@pytest.mark.parametrize(
    ("gait", "command", "circles"),
    [
        (HRP2, Velocity(0.2, 0.0, 0.0), CIRCLES),
        (HRP2, Velocity(0.1, 0.05, 0.2), ()),
        (HEICUB, Velocity(0.02, 0.0, 0.02), ()),
    ],
    ids=["obstacles", "curve", "heicub"],
)
def test_another_solver_agrees_on_every_state_visited(
    gait: Gait, command: Velocity, circles: tuple[Circle, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[tuple[Programme, np.ndarray | None]] = []

    def watched(programme: Programme) -> np.ndarray | None:
        seen.append((programme, solve(programme)))
        return seen[-1][1]

    monkeypatch.setattr(document, "solve", watched)
    pattern = Document(gait)
    state = pattern.start()
    for _ in range(60):
        state, _ = pattern.step(state, command, circles)
    assert len(seen) == 120
    for programme, answer in seen:
        assert answer is not None
        np.testing.assert_allclose(answer, by_quadprog(programme), atol=2e-6, rtol=1e-6)


def visited(gait: Gait, ticks: int) -> tuple[document.DocumentState, np.ndarray]:
    pattern = Document(gait)
    state = pattern.start()
    for _ in range(ticks):
        state, _ = pattern.step(state, Velocity(0.1, 0.0, 0.1))
    return state, np.concatenate([[state.support.yaw], state.turned])


def posed(gait: Gait, state: document.DocumentState, soles: np.ndarray) -> Programme:
    foot = np.array([state.support.x, state.support.y])
    velocity, footsteps = np.array([0.1, 0.02]), state.plan.footsteps
    return positions(model(gait), state.left, state.com, velocity, foot, state.support.side, soles, footsteps, CIRCLES)


def simulated(gait: Gait, state: document.DocumentState, unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Velocity and ZMP less sole, sample by sample."""
    per_step = round(gait.step_time / gait.sample)
    axes = unknowns.reshape(2, -1)
    soles = np.vstack([[state.support.x, state.support.y], axes[:, gait.preview :].T])
    com, velocities, offsets = state.com, [], []
    for i, jerk in enumerate(axes[:, : gait.preview].T):
        com = advance(com, jerk, gait.sample)
        velocities.append(com[:, 1])
        standing = soles[(i + per_step - state.left) // per_step]
        offsets.append(zero_moment_point(com, gait.com_height) - standing)
    return np.array(velocities), np.array(offsets)


@pytest.mark.parametrize("gait", [HRP2, HEICUB, THREE], ids=["hrp2", "heicub", "three"])
@pytest.mark.parametrize("ticks", [0, 3, 8])
def test_the_objective_is_what_a_simulation_costs(gait: Gait, ticks: int) -> None:
    state, soles = visited(gait, ticks)
    programme, (alpha, beta, gamma) = posed(gait, state, soles), gait.objective
    stay = model(gait).stay[state.left - 1]
    assert np.all(stay <= 1e-4 * beta)
    before = np.concatenate([np.zeros((gait.preview, 2)), state.plan.footsteps]).T.ravel()

    def cost(unknowns: np.ndarray) -> float:
        velocity, offset = simulated(gait, state, unknowns)
        jerks = unknowns.reshape(2, -1)[:, : gait.preview]
        held = np.sum(np.tile(stay, 2) * (unknowns - before) ** 2)
        aim = np.sum((velocity - [0.1, 0.02]) ** 2)
        return (alpha * aim + beta * np.sum(offset**2) + gamma * np.sum(jerks**2) + held) / 2

    def posed_cost(unknowns: np.ndarray) -> float:
        return float(unknowns @ programme.hessian @ unknowns / 2 + programme.gradient @ unknowns)

    a, b = RNG.normal(size=(2, len(programme.gradient)))
    assert posed_cost(a) - posed_cost(b) == pytest.approx(cost(a) - cost(b), rel=1e-9)


@pytest.mark.parametrize("gait", [HRP2, HEICUB, THREE], ids=["hrp2", "heicub", "three"])
@pytest.mark.parametrize("ticks", [0, 4, 6])
def test_a_feasible_plan_lies_in_boxes_and_hulls(gait: Gait, ticks: int) -> None:
    state, soles = visited(gait, ticks)
    programme = posed(gait, state, soles)._replace(equality=0)
    unknowns = solve(programme)
    assert unknowns is not None
    _, offsets = simulated(gait, state, unknowns)
    per_step = round(gait.step_time / gait.sample)
    for i, offset in enumerate(offsets):
        along, across = turned(offset, -soles[(i + per_step - state.left) // per_step])
        assert abs(along - gait.foot_ahead) < gait.foot_length / 2 - gait.margin[0] + 1e-7
        assert abs(across) < gait.foot_width / 2 - gait.margin[1] + 1e-7
    steps = unknowns.reshape(2, -1)[:, gait.preview :].T
    came_from = np.array([state.support.x, state.support.y])
    for j, step in enumerate(steps):
        stride = turned(step - came_from, -soles[j])
        lands = (state.support.side + 1 + j) % 2
        frozen = j == 0 and state.left < 3
        assert frozen or inside(stride * [1, 1 if lands == 0 else -1], np.array(gait.hull))
        came_from = step


def turned(vector: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


def inside(point: np.ndarray, hull: np.ndarray) -> bool:
    """Clockwise corners: the point is to the right of every edge."""
    along, away = np.roll(hull, -1, axis=0) - hull, point - hull
    return bool(np.all(along[:, 0] * away[:, 1] - along[:, 1] * away[:, 0] < 1e-7))


def test_the_next_footstep_is_frozen_in_the_last_two_samples() -> None:
    pattern = Document(HRP2)
    state, landings = pattern.start(), []
    for tick in range(24):
        fast = Velocity(0.3 * np.sin(tick), 0.0, 0.0)
        state, interval = pattern.step(state, fast)
        assert interval.landing is not None
        landings.append([interval.landing.x, interval.landing.y])
    strides = np.abs(np.diff(np.array(landings).reshape(3, 8, 2), axis=1)).max(axis=2)
    assert np.all(strides[:, 5:] < 1e-9)
    assert np.all(strides[1:, :5].max(axis=1) > 1e-4)


@pytest.mark.parametrize(("left", "side", "omega"), [(8, 0, 0.1), (3, 1, -0.2), (1, 0, 0.3)])
def test_the_yaws_are_the_optimum_in_all_2n_jerks(left: int, side: int, omega: float) -> None:
    """2.44 and 2.73 to 2.78 as printed, with the standing sole's rate held at zero by the equalities' null space."""
    m = model(HRP2)
    state = np.array([[0.02, 0.0, 0.05], [0.05, 0.0, -0.1]])
    programme = yaws(m, left, side, state, omega)
    rates = solve(programme)
    assert rates is not None
    found = yaw_jerks(m, left, side, state, rates)
    air = (flying(m, left, side) == np.arange(2)[:, None]).astype(float)
    p_v, p_p = m.matrices.velocity_jerk, m.matrices.position_jerk
    rate_drift, angle_drift = state @ m.matrices.velocity_state.T, state @ m.matrices.position_state.T
    full = np.kron(np.eye(2), p_v)
    stands = (air.ravel() == 0)[:, None] * full
    rows = stands[air.ravel() == 0]
    free = null_space(rows)
    particular = np.linalg.lstsq(rows, -rate_drift.ravel()[air.ravel() == 0], rcond=None)[0]
    chosen = air.ravel()[:, None] * full
    hessian, aim = chosen.T @ chosen, air.ravel() * (rate_drift.ravel() - omega)
    gradient = free.T @ (chosen.T @ aim + hessian @ particular)
    apart = np.concatenate([np.hstack([-p_p, p_p]), np.hstack([-p_v, p_v])])
    drift = np.concatenate([angle_drift[1] - angle_drift[0], rate_drift[1] - rate_drift[0]]) + apart @ particular
    widest = np.repeat([HRP2.longest_turn, HRP2.fastest_turn], 16)
    normals, least = np.vstack([apart, -apart]) @ free, np.concatenate([-widest - drift, drift - widest])
    scale = 1.0 / np.sqrt(np.diag(free.T @ hessian @ free))
    quadratic = scale[:, None] * (free.T @ hessian @ free) * scale
    answer = quadprog.solve_qp(quadratic, -scale * gradient, (normals * scale).T, least, 0)[0] * scale
    expected = (particular + free @ answer).reshape(2, 16)
    np.testing.assert_allclose(found @ p_v.T, expected @ p_v.T, atol=1e-7)


def test_the_derivatives_by_the_yaws_are_finite_differences() -> None:
    m, yaw, step = model(THREE), np.array([0.1, -0.3, 0.2, 0.5]), 1e-6
    samples, steps = THREE.preview, THREE.steps
    foot, unknowns = np.array([0.3, -0.1]), RNG.normal(size=2 * (samples + steps))
    drift, preview = RNG.normal(size=(samples, 2)), m.previews[2]
    footsteps = unknowns.reshape(2, -1)[:, samples:].T

    def values(angles: np.ndarray) -> np.ndarray:
        zmp = zmp_rows(preview, drift, angles, m.box)
        hull = hull_rows(samples, foot, angles, m.normals[1], m.offsets[1])
        return np.concatenate([rows.matrix @ unknowns - rows.upper for rows in (zmp, hull)])

    by_hand = np.concatenate(
        [zmp_by_yaw(preview, drift, yaw, unknowns), hull_by_yaw(foot, yaw, m.normals[1], footsteps)]
    )
    numeric = np.stack([(values(yaw + d) - values(yaw - d)) / (2 * step) for d in step * np.eye(4)], axis=1)
    np.testing.assert_allclose(by_hand, numeric, atol=1e-8)
    assert np.all(np.abs(by_hand).max(axis=0)[:3] > 0.1)


def test_the_obstacle_rows_are_tangents_of_the_summed_distance() -> None:
    samples, steps = 4, 3
    footsteps, other = RNG.normal(size=(2, steps, 2))
    rows = obstacle_rows(samples, footsteps, CIRCLES, 0.2)

    def clearance(feet: np.ndarray, circle: Circle) -> float:
        centre = np.array([circle.x, circle.y])
        return np.sum(feet**2) - 2 * np.sum(feet @ centre) - (circle.radius + 0.4) ** 2 + centre @ centre

    def unknowns(feet: np.ndarray) -> np.ndarray:
        return np.hstack([RNG.normal(size=(2, samples)), feet.T]).ravel()

    for i, circle in enumerate(CIRCLES):
        there = rows.matrix[i] @ unknowns(footsteps) - rows.lower[i]
        assert there == pytest.approx(clearance(footsteps, circle), abs=1e-12)
        ahead = rows.matrix[i] @ unknowns(footsteps + 1e-6 * other) - rows.lower[i]
        slope = (clearance(footsteps + 1e-6 * other, circle) - clearance(footsteps - 1e-6 * other, circle)) / 2e-6
        assert (ahead - there) / 1e-6 == pytest.approx(slope, rel=1e-6)
