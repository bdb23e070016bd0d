"""The zero moment point: from forces applied at known points, and from MuJoCo's contacts."""

from __future__ import annotations

import math

import numpy as np
import pytest
from box_biped import biped, swaying
from hypothesis import given
from hypothesis import strategies as st

from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.walk.balance.zmp import sole_zmp, zmp

PLACE = st.floats(-0.3, 0.3)
SIDEWAYS = st.floats(-40, 40)
LOAD = st.floats(5, 600)


def wrench(point: tuple[float, float], force: tuple[float, float, float], height: float) -> np.ndarray:
    """What a sensor ``height`` over the sole feels of a force at a point of the sole: r x f."""
    return np.concatenate([force, np.cross([*point, -height], force)])


def turned(yaw: float, vector: np.ndarray) -> np.ndarray:
    cos, sin = math.cos(yaw), math.sin(yaw)
    return np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]) @ vector


@given(PLACE, PLACE, SIDEWAYS, SIDEWAYS, LOAD, st.floats(0, 0.1))
def test_one_force_is_found_where_it_presses(
    x: float, y: float, fx: float, fy: float, fz: float, height: float
) -> None:
    np.testing.assert_allclose(sole_zmp(wrench((x, y), (fx, fy, fz), height), height), [x, y], atol=1e-9)


@given(st.lists(st.tuples(PLACE, PLACE, LOAD), min_size=2, max_size=2), PLACE, PLACE, st.floats(-3, 3))
def test_both_soles_make_the_point_without_level_torque(
    points: list[tuple[float, float, float]], x: float, y: float, yaw: float
) -> None:
    soles = np.array([[0.0, 0.1, 0.0, 0.2], [x, y, 0.0, yaw]])
    wrenches = np.array([wrench((px, py), (3.0, -2.0, fz), 0.0) for px, py, fz in points])
    torque, load = np.zeros(3), 0.0
    for sole, (px, py, fz) in zip(soles, points, strict=True):
        at = sole[:3] + turned(sole[3], np.array([px, py, 0.0]))
        torque += np.cross(at, [0.0, 0.0, fz])
        load += fz
    np.testing.assert_allclose(zmp(wrenches, soles), [-torque[1] / load, torque[0] / load], atol=1e-9)


def test_single_support_is_the_one_soles_point() -> None:
    soles = np.array([[0.1, 0.07, 0.0, math.pi / 2], [0.0, -0.07, 0.0, 0.0]])
    wrenches = np.array([wrench((0.03, 0.01), (0.0, 0.0, 250.0), 0.0), np.zeros(6)])
    np.testing.assert_allclose(zmp(wrenches, soles), [0.1 - 0.01, 0.07 + 0.03])


@pytest.mark.parametrize("lift", [0.0, -20.0, math.nan])
def test_without_a_load_there_is_none(lift: float) -> None:
    felt = np.array([0.0, 0.0, lift, 1.0, 1.0, 0.0])
    assert np.isnan(sole_zmp(felt)).all()
    assert np.isnan(zmp(np.array([felt, felt]), np.zeros((2, 4)))).all()


def test_the_sensors_tell_what_mujocos_contacts_do() -> None:
    """Swaying, one foot carries far more than the other; what differs is the feet's own acceleration."""
    simulation = HumanoidSimulation(biped())
    errors, loads = [], []
    for tick in range(300):
        felt = simulation.tick(swaying(0.01 * tick))
        truth = simulation.truth()
        errors.append(zmp(felt.wrenches, truth.soles) - truth.zmp)
        loads.append(truth.load)
    assert np.min(loads) < 0.4 * np.max(loads)
    assert np.abs(errors[20:]).max() < 1e-3
    assert np.std(errors[20:]) < 3e-4
