"""The state from the senses, against the truth of physics; the plan's frame carries through; noise stays small."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from box_biped import biped, biped_home, swaying

from toddle.outside.simulation.disturbances import Noise, WorldOptions
from toddle.outside.simulation.humanoid import HumanoidSimulation, Truth
from toddle.robots.humanoid import Humanoid
from toddle.signals import Senses
from toddle.walk.balance.estimate import Estimate, Observer, estimate, observer
from toddle.walk.posture.model import posture_model

EVEN = np.array([0.5, 0.5])


@pytest.fixture(scope="module")
def robot() -> Humanoid:
    return biped()


@pytest.fixture(scope="module")
def watching(robot: Humanoid) -> Observer:
    return observer(robot, posture_model(robot))


def swayed(
    robot: Humanoid, watching: Observer, options: WorldOptions, seconds: float = 5.0, settle: float = 1.0
) -> list[tuple[Senses, Estimate, Truth]]:
    """A swaying robot, estimated; the truth is told from where its soles stood."""
    simulation = HumanoidSimulation(robot, options)
    anchors = simulation.truth().soles.copy()
    anchors[:, 2] = 0.0
    found, last = [], None
    for tick in range(round(100 * seconds)):
        felt = simulation.tick(swaying(0.01 * tick))
        load = np.maximum(felt.wrenches[:, 2], 0.0)
        last, truth = estimate(watching, felt, anchors, load, last, 0.01), simulation.truth()
        slipped = load @ (truth.soles[:, :2] - anchors[:, :2]) / load.sum()
        moved = truth._replace(com=truth.com - [*slipped, 0.0], zmp=truth.zmp - slipped)
        if tick >= 100 * settle:
            found.append((felt, last, moved))
    return found


def deviations(
    found: list[tuple[Senses, Estimate, Truth]], error: Callable[[Estimate, Truth], np.ndarray]
) -> tuple[float, float]:
    """Greatest and mean square of an error."""
    errors = np.array([error(one, truth) for _, one, truth in found])
    return float(np.abs(errors).max()), float(np.sqrt(np.mean(errors**2)))


def place(one: Estimate, truth: Truth) -> np.ndarray:
    return one.com - truth.com


def velocity(one: Estimate, truth: Truth) -> np.ndarray:
    return one.com_velocity[:2] - truth.com_velocity[:2]


def pressed(one: Estimate, truth: Truth) -> np.ndarray:
    return one.zmp - truth.zmp


def test_perfect_senses_give_the_truth(robot: Humanoid, watching: Observer) -> None:
    found = swayed(robot, watching, WorldOptions())
    speeds = [truth.com_velocity[1] for _, _, truth in found]
    assert np.ptp(speeds) > 0.2  # it does sway
    assert deviations(found, place)[0] < 2e-3
    assert deviations(found, velocity)[1] < 5e-3
    assert deviations(found, pressed)[0] < 1e-3
    for _, one, truth in found[::50]:
        np.testing.assert_allclose(one.q[:3], truth.q[:3], atol=3e-3)
        np.testing.assert_allclose(one.q[3:7], truth.q[3:7], atol=3e-3)
        np.testing.assert_allclose(one.dcm, one.com[:2] + one.com_velocity[:2] / watching.omega, atol=1e-12)


def test_noise_delay_and_lag_are_borne(robot: Humanoid, watching: Observer) -> None:
    found = swayed(robot, watching, WorldOptions(noise=Noise(), delay_s=0.01, lag_s=0.02, seed=1))
    assert deviations(found, place)[1] < 2e-3
    assert deviations(found, velocity)[1] < 1e-2
    assert deviations(found, pressed)[1] < 5e-3


def test_wrong_masses_and_biased_sensors_shift_it_by_millimetres(robot: Humanoid, watching: Observer) -> None:
    bias = Noise(encoder=1e-3, force=2.0, torque=0.2, orientation=5e-3)
    found = swayed(robot, watching, WorldOptions(noise=Noise(), bias=bias, mass_error=0.1, seed=2))
    assert deviations(found, place)[1] < 1e-2
    assert deviations(found, velocity)[1] < 2e-2


def test_yaw_comes_from_the_soles_however_the_inertial_unit_drifts(robot: Humanoid, watching: Observer) -> None:
    steady, drifting = swayed(robot, watching, WorldOptions()), swayed(robot, watching, WorldOptions(yaw_drift=0.3))
    assert abs(drifting[-1][0].orientation[3]) > 0.5
    np.testing.assert_allclose(drifting[-1][1].q, steady[-1][1].q, atol=1e-9)
    np.testing.assert_allclose(drifting[-1][1].com_velocity, steady[-1][1].com_velocity, atol=1e-9)


def test_moving_the_plan_moves_the_estimate_with_it(robot: Humanoid, watching: Observer) -> None:
    simulation = HumanoidSimulation(robot)
    anchors = simulation.truth().soles
    yaw, shift = 2.8, np.array([3.0, -2.0])
    cos, sin = math.cos(yaw), math.sin(yaw)
    turn = np.array([[cos, -sin], [sin, cos]])
    moved = anchors.copy()
    moved[:, :2] = anchors[:, :2] @ turn.T + shift
    moved[:, 3] += yaw
    here = there = None
    for tick in range(30):
        felt = simulation.tick(swaying(0.5 + 0.01 * tick))
        here = estimate(watching, felt, anchors, EVEN, here, 0.01)
        there = estimate(watching, felt, moved, EVEN, there, 0.01)
    assert here is not None
    assert there is not None
    for name in ("com", "zmp", "dcm"):
        expected = turn @ getattr(here, name)[:2] + shift
        np.testing.assert_allclose(getattr(there, name)[:2], expected, atol=1e-9)
    np.testing.assert_allclose(there.com_velocity[:2], turn @ here.com_velocity[:2], atol=1e-9)
    np.testing.assert_allclose(there.soles[:, :2], here.soles[:, :2] @ turn.T + shift, atol=1e-9)
    np.testing.assert_allclose(there.tilt, here.tilt, atol=1e-9)
    np.testing.assert_allclose(math.remainder(there.yaw - here.yaw - yaw, 2 * math.pi), 0.0, atol=1e-9)


def test_the_believed_sole_is_where_the_plan_put_it(robot: Humanoid, watching: Observer) -> None:
    simulation = HumanoidSimulation(robot)
    felt = simulation.tick(biped_home())
    anchors = simulation.truth().soles
    anchors[1, :2] += 0.05
    for side in (0, 1):
        one = estimate(watching, felt, anchors, np.eye(2)[side], None, 0.01)
        np.testing.assert_allclose(one.soles[side], anchors[side], atol=1e-3)
        assert np.abs(one.soles[1 - side, :2] - anchors[1 - side, :2]).max() > 0.04


def test_contact_has_hysteresis(robot: Humanoid, watching: Observer) -> None:
    felt = HumanoidSimulation(robot).reset()
    between = 0.5 * (watching.lands + watching.lifts) * watching.weight
    last, told = None, []
    for load in (0.0, between, 2 * watching.weight, between, 0.0):
        wrenches = np.zeros((2, 6))
        wrenches[:, 2] = load, watching.weight
        last = estimate(watching, felt._replace(wrenches=wrenches), np.zeros((2, 4)), EVEN, last, 0.01)
        told.append((bool(last.contact[0]), bool(last.contact[1])))
    assert told == [(False, True), (False, True), (True, True), (True, True), (False, True)]


def test_in_the_air_the_last_zmp_stays_and_all_is_finite(robot: Humanoid, watching: Observer) -> None:
    felt = HumanoidSimulation(robot).reset()
    nothing = felt._replace(wrenches=np.zeros((2, 6)))
    anchors = np.array([[0.0, 0.07, 0.0, 0.0], [0.0, -0.07, 0.0, 0.0]])
    stood = estimate(watching, felt, anchors, EVEN, None, 0.01)
    flies = estimate(watching, nothing, anchors, np.zeros(2), stood, 0.01)
    np.testing.assert_array_equal(flies.zmp, stood.zmp)
    assert not flies.contact.any()
    for number in (flies.q, flies.com, flies.com_velocity, flies.dcm, flies.zmp):
        assert np.isfinite(number).all()
