"""The tasks' hand-written derivatives against finite differences; the logarithm up to half a turn."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from walk.biped import biped

from toddle.walk.posture.kernels import place, place_frames
from toddle.walk.posture.model import posture_model
from toddle.walk.posture.tasks import ROWS, logarithm, normal_equations, task_columns, task_errors

HUMANOID = biped()
SKELETON = posture_model(HUMANOID).skeleton
PHYSICS = HUMANOID.spec.compile()
VARIABLES = np.concatenate((np.arange(6), 6 + np.flatnonzero(HUMANOID.moves)))


def errors_at(q: np.ndarray, target: np.ndarray) -> np.ndarray:
    placed, errors = place(SKELETON, q), np.zeros(ROWS)
    at, facing = place_frames(SKELETON, placed[0], placed[1])
    task_errors(target, placed[5], at, facing, errors)
    return errors


def setting(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A configuration and a target with errors of up to two radians."""
    rng = np.random.default_rng(seed)
    q = np.concatenate((rng.normal(size=3), rng.normal(size=4), rng.uniform(HUMANOID.lower, HUMANOID.upper)))
    q[3:7] /= np.linalg.norm(q[3:7])
    placed = place(SKELETON, q)
    _, facing = place_frames(SKELETON, placed[0], placed[1])
    turns = [Rotation.from_rotvec(rng.uniform(-1.2, 1.2, 3)).as_matrix() for _ in range(4)]
    goals = [facing[f] @ turn for f, turn in enumerate(turns)]
    return q, np.concatenate((rng.normal(size=9), *goals, rng.uniform(0.1, 2, ROWS)), axis=None)


@pytest.mark.parametrize("seed", range(4))
def test_columns_are_finite_differences_of_the_errors(seed: int) -> None:
    q, target = setting(seed)
    placed, columns = place(SKELETON, q), np.zeros((len(VARIABLES), ROWS))
    at, facing = place_frames(SKELETON, placed[0], placed[1])
    task_columns(SKELETON, placed, at, facing, errors_at(q, target), columns)
    for column, variable in zip(columns, VARIABLES, strict=True):
        velocity, ahead, behind = np.zeros(PHYSICS.nv), q.copy(), q.copy()
        velocity[variable] = 1.0
        mujoco.mj_integratePos(PHYSICS, ahead, velocity, 1e-6)
        mujoco.mj_integratePos(PHYSICS, behind, velocity, -1e-6)
        difference = -(errors_at(ahead, target) - errors_at(behind, target)) / 2e-6
        np.testing.assert_allclose(column, difference, atol=1e-7)


def test_normal_equations_skip_only_zeros() -> None:
    q, target = setting(9)
    placed, n = place(SKELETON, q), len(VARIABLES)
    columns, hessian, gradient = np.zeros((n, ROWS)), np.zeros((n, n)), np.zeros(n)
    at, facing = place_frames(SKELETON, placed[0], placed[1])
    errors, weights = errors_at(q, target), target[45:]
    task_columns(SKELETON, placed, at, facing, errors, columns)
    normal_equations(SKELETON, target, 0.25, q, errors, columns, hessian, gradient)
    pulled = np.where(VARIABLES >= 6, 0.25, 0.0)
    away = np.concatenate((np.zeros(6), (q - HUMANOID.home)[7:][HUMANOID.moves]))
    expected = columns * weights @ columns.T + np.diag(pulled)
    np.testing.assert_allclose(np.tril(hessian), np.tril(expected), atol=1e-12)
    np.testing.assert_allclose(gradient, columns * weights @ errors - pulled * away, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 1.0, 3.0, np.pi - 1e-4, np.pi - 1e-7])
def test_the_logarithm_is_scipys(angle: float) -> None:
    rng = np.random.default_rng(0)
    for axis in (*np.eye(3), *-np.eye(3), *rng.normal(size=(20, 3))):
        vector = angle * axis / np.linalg.norm(axis)
        start, out = Rotation.random(rng=rng), np.zeros(3)
        logarithm(start.as_matrix(), (start * Rotation.from_rotvec(vector)).as_matrix(), out)
        np.testing.assert_allclose(out, vector, atol=1e-6)


def test_half_a_turn_is_half_a_turn() -> None:
    for axis in (*np.eye(3), np.array([0.6, 0.0, 0.8]), np.array([0.48, 0.64, -0.6])):
        out = np.zeros(3)
        logarithm(np.eye(3), Rotation.from_rotvec(np.pi * axis).as_matrix(), out)
        np.testing.assert_allclose(np.abs(out @ axis), np.pi, atol=1e-6)
