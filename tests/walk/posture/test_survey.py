"""Kinematics against MuJoCo's own, against finite differences, and statics against its inverse dynamics."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from walk.biped import biped

from toddle.failures import BadInput
from toddle.walk.posture.model import posture_model
from toddle.walk.posture.survey import jacobians, static_torques, survey

HUMANOID = biped()
MODEL = posture_model(HUMANOID)
PHYSICS = HUMANOID.spec.compile()
SEEDS = range(5)


def anywhere(seed: int) -> np.ndarray:
    """A configuration anywhere, in any attitude, its quaternion not quite of length one."""
    rng = np.random.default_rng(seed)
    joints = rng.uniform(HUMANOID.lower, HUMANOID.upper)
    return np.concatenate((rng.normal(size=3), rng.normal(size=4), joints))


def simulated(q: np.ndarray) -> mujoco.MjData:
    data = mujoco.MjData(PHYSICS)
    data.qpos[:] = q
    mujoco.mj_normalizeQuat(PHYSICS, data.qpos)
    mujoco.mj_forward(PHYSICS, data)
    return data


@pytest.mark.parametrize("seed", SEEDS)
def test_bodies_are_where_mujoco_puts_them(seed: int) -> None:
    q = anywhere(seed)
    seen, data = survey(MODEL, q), simulated(q)
    np.testing.assert_allclose(seen.com, data.subtree_com[0], atol=1e-12)
    named = {
        "left_sole": (seen.soles_p[0], seen.soles_R[0]),
        "right_sole": (seen.soles_p[1], seen.soles_R[1]),
        "waist": (seen.waist_p, seen.waist_R),
        "chest": (seen.chest_p, seen.chest_R),
        "imu": (seen.imu_p, seen.imu_R),
    }
    for name, (position, rotation) in named.items():
        np.testing.assert_allclose(position, data.site(name).xpos, atol=1e-12)
        np.testing.assert_allclose(rotation.ravel(), data.site(name).xmat, atol=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_jacobians_are_mujocos(seed: int) -> None:
    q = anywhere(seed)
    got, data = jacobians(MODEL, q), simulated(q)
    expected = np.zeros((3, PHYSICS.nv))
    mujoco.mj_jacSubtreeCom(PHYSICS, data, expected, 1)
    np.testing.assert_allclose(got.com, expected, atol=1e-12)
    for side, name in enumerate(("left_sole", "right_sole")):
        sole = np.zeros((6, PHYSICS.nv))
        mujoco.mj_jacSite(PHYSICS, data, sole[:3], sole[3:], PHYSICS.site(name).id)
        np.testing.assert_allclose(got.soles[side], sole, atol=1e-12)


def test_the_com_jacobian_is_its_finite_difference() -> None:
    q = anywhere(7)
    q[3:7] /= np.linalg.norm(q[3:7])
    differences = np.zeros((3, PHYSICS.nv))
    for i, velocity in enumerate(np.eye(PHYSICS.nv)):
        ahead, behind = q.copy(), q.copy()
        mujoco.mj_integratePos(PHYSICS, ahead, velocity, 1e-6)
        mujoco.mj_integratePos(PHYSICS, behind, velocity, -1e-6)
        differences[:, i] = (survey(MODEL, ahead).com - survey(MODEL, behind).com) / 2e-6
    np.testing.assert_allclose(jacobians(MODEL, q).com, differences, atol=1e-8)


def floor(data: mujoco.MjData, load: np.ndarray, cop: np.ndarray) -> np.ndarray:
    """What the floor's upward forces on the soles do to the base and the joints, by MuJoCo."""
    total = np.zeros(PHYSICS.nv)
    for side, name in enumerate(("left_sole", "right_sole")):
        site = data.site(name)
        point = site.xpos + site.xmat.reshape(3, 3)[:, :2] @ cop[side]
        force = np.array([0, 0, load[side] * HUMANOID.mass * 9.81])
        mujoco.mj_applyFT(PHYSICS, data, force, np.zeros(3), point, int(PHYSICS.site(name).bodyid[0]), total)
    return total


@pytest.mark.parametrize("seed", SEEDS)
def test_static_torques_are_gravity_less_the_floors_forces(seed: int) -> None:
    rng = np.random.default_rng(seed)
    q, share, cop = anywhere(seed), rng.uniform(), rng.uniform(-0.05, 0.05, (2, 2))
    load, data = np.array([share, 1 - share]), simulated(q)
    expected = data.qfrc_bias - floor(data, load, cop)
    np.testing.assert_allclose(static_torques(MODEL, q, load, cop), expected[6:], atol=1e-9)


@pytest.mark.parametrize("share", [0.5, 0.8])
def test_a_robot_whose_feet_carry_its_centre_of_mass_needs_no_hand_from_above(share: float) -> None:
    seen, load = survey(MODEL, HUMANOID.home), np.array([share, 1 - share])
    lack = seen.com - load @ seen.soles_p  # moves both points so that the loads' middle is under the centre of mass
    cop = np.array([(rotation.T @ lack)[:2] for rotation in seen.soles_R])
    data = simulated(HUMANOID.home)
    data.qacc[:] = 0
    mujoco.mj_inverse(PHYSICS, data)
    left = data.qfrc_inverse - floor(data, load, cop)
    np.testing.assert_allclose(left[:6], 0, atol=1e-9)
    np.testing.assert_allclose(left[6:], static_torques(MODEL, HUMANOID.home, load, cop), atol=1e-9)


def test_a_configuration_of_the_wrong_size_is_refused() -> None:
    with pytest.raises(BadInput, match="configuration"):
        survey(MODEL, HUMANOID.home[:-1])
    with pytest.raises(BadInput, match="configuration"):
        jacobians(MODEL, np.zeros(6))


@pytest.mark.usefixtures("unchecked")
def test_loads_of_the_wrong_size_are_refused() -> None:
    with pytest.raises(BadInput, match="loads"):
        static_torques(MODEL, HUMANOID.home, np.ones(3), np.zeros((2, 2)))
