"""Whole-body inverse kinematics: against mink, at the joints' limits, out of reach, and on a walking reference."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mink
import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from walk.biped import biped

from toddle.failures import BadInput
from toddle.robots.humanoid import Humanoid
from toddle.signals import Reference, Verdict
from toddle.walk.posture.model import posture_model
from toddle.walk.posture.solve import WEIGHTS, PostureTarget, explain, posture_target, settle, solve_posture
from toddle.walk.posture.survey import survey

HUMANOID = biped()
MODEL = posture_model(HUMANOID)
PHYSICS = HUMANOID.spec.compile()
HOME = survey(MODEL, HUMANOID.home)
LIMITS = HUMANOID.lower, HUMANOID.upper


def target(com: object = (0, 0, 0), left: object = (0, 0, 0), yaw: float = 0.0, pitch: float = 0.0) -> PostureTarget:
    """Home, with the centre of mass and the left sole displaced, the left sole turned."""
    turn = Rotation.from_euler("zy", (yaw, pitch)).as_matrix()
    return PostureTarget(
        HOME.com + np.asarray(com, float),
        HOME.soles_p + np.array([np.asarray(left, float), np.zeros(3)]),
        np.array([turn @ HOME.soles_R[0], HOME.soles_R[1]]),
        HOME.waist_R,
        HOME.chest_R,
    )


REACHABLE = (
    target(),
    target(com=(0.02, -0.04, -0.02)),
    target(com=(0.0, -0.05, 0.0), left=(0.1, 0.02, 0.04), yaw=0.2),
    target(com=(-0.02, -0.03, -0.03), left=(-0.08, 0.0, 0.02), pitch=-0.1),
)


def missed(q: np.ndarray, goal: PostureTarget) -> np.ndarray:
    """The tasks' errors, by MuJoCo's kinematics and scipy's rotations."""
    data = mujoco.MjData(PHYSICS)
    data.qpos[:] = q
    mujoco.mj_kinematics(PHYSICS, data)
    mujoco.mj_comPos(PHYSICS, data)
    rows = [goal.com - data.subtree_com[0]]
    for side, name in enumerate(("left_sole", "right_sole")):
        rows += [goal.soles[side] - data.site(name).xpos, turned(data, name, goal.sole_rotations[side])]
    return np.concatenate(
        [*rows, turned(data, "waist", goal.waist_rotation), turned(data, "chest", goal.chest_rotation)]
    )


def turned(data: mujoco.MjData, name: str, goal: np.ndarray) -> np.ndarray:
    return Rotation.from_matrix(data.site(name).xmat.reshape(3, 3).T @ goal).as_rotvec()


def by_mink(goal: PostureTarget) -> np.ndarray:
    """The same targets through mink, the arm held."""
    configuration = mink.Configuration(PHYSICS, HUMANOID.home)
    com = mink.ComTask(cost=1.0)
    com.set_target(goal.com)
    frames = [
        ("left_sole", 1.0, goal.sole_rotations[0], goal.soles[0]),
        ("right_sole", 1.0, goal.sole_rotations[1], goal.soles[1]),
        ("waist", 0.0, goal.waist_rotation, np.zeros(3)),
        ("chest", 0.0, goal.chest_rotation, np.zeros(3)),
    ]
    tasks: list[Any] = [com]
    for name, cost, rotation, position in frames:
        task = mink.FrameTask(name, "site", position_cost=cost, orientation_cost=1.0)
        task.set_target(mink.SE3.from_rotation_and_translation(mink.SO3.from_matrix(rotation), position))
        tasks.append(task)
    held = mink.DofFreezingTask(PHYSICS, [int(PHYSICS.joint("arm").dofadr[0])])
    limits = [mink.ConfigurationLimit(PHYSICS)]
    for _ in range(60):
        step = mink.solve_ik(configuration, tasks, 1.0, "daqp", damping=1e-9, limits=limits, constraints=[held])
        configuration.integrate_inplace(step, 1.0)
    return configuration.q.copy()


@pytest.mark.parametrize("goal", REACHABLE)
def test_the_answer_is_minks(goal: PostureTarget) -> None:
    """As many rows as variables: the posture is unique near home, so both must find the same joints."""
    peer, ours = by_mink(goal), settle(MODEL, HUMANOID.home, goal)
    assert ours.verdict is Verdict.REACHED
    assert np.abs(missed(peer, goal)).max() < 1e-6
    assert np.abs(missed(ours.q, goal)).max() < 1e-5
    np.testing.assert_allclose(ours.q[7:], peer[7:], atol=1e-3)


@given(st.integers(0, 10**6), st.sampled_from([1, 2, 40]))
def test_no_joint_leaves_its_limits_and_no_step_comes_out_farther(seed: int, iterations: int) -> None:
    rng = np.random.default_rng(seed)
    start = HUMANOID.home.copy()
    start[7:] = rng.uniform(*LIMITS) + rng.choice([0, 0.3, -0.3], len(start) - 7) * HUMANOID.moves
    start[3:7] = rng.normal(size=4)
    size = 10 ** rng.uniform(-3, 0)
    goal = target(rng.normal(size=3) * size, rng.normal(size=3) * size, *(rng.normal(size=2) * size))
    posture = solve_posture(MODEL, start, goal, iterations)
    assert np.all((posture.q[7:] >= HUMANOID.lower) & (posture.q[7:] <= HUMANOID.upper))
    assert abs(np.linalg.norm(posture.q[3:7]) - 1) < 1e-12
    arm = HUMANOID.joints.index("arm")
    assert posture.q[7 + arm] == start[7 + arm], "a held joint moved"
    inside = start.copy()
    inside[7:] = np.clip(start[7:], *LIMITS)
    cost = [float(WEIGHTS @ missed(q, goal) ** 2) for q in (inside, posture.q)]
    assert cost[1] <= cost[0] + 1e-5, "the pull to home is too weak to raise it by more"


FAR = {
    "too high": (target(com=(0, 0, 0.2)), Verdict.OUT_OF_REACH, "the centre of mass"),
    "too low": (target(com=(0, 0, -0.25)), Verdict.AT_JOINT_LIMIT, "the centre of mass"),
    "too far": (target(left=(0.5, 0, 0)), Verdict.AT_JOINT_LIMIT, "the left sole"),
    "aside": (target(com=(0, 0.4, 0)), Verdict.AT_JOINT_LIMIT, "the centre of mass"),
}


@pytest.mark.parametrize("name", FAR)
def test_out_of_reach_it_is_the_nearest_posture_and_says_so(name: str) -> None:
    goal, verdict, what = FAR[name]
    posture = settle(MODEL, HUMANOID.home, goal)
    assert posture.verdict is verdict
    assert what in explain(MODEL, posture)
    assert "at a limit: " in explain(MODEL, posture)
    assert posture.at_limit.any()
    # scipy, from there, by finite differences and with the same bounds, finds nothing nearer
    moves = np.flatnonzero(HUMANOID.moves)
    free = np.concatenate((np.arange(6), 6 + moves))

    def rows(d: np.ndarray) -> np.ndarray:
        q, velocity = posture.q.copy(), np.zeros(PHYSICS.nv)
        velocity[free] = d
        mujoco.mj_integratePos(PHYSICS, q, velocity, 1.0)
        return np.sqrt(WEIGHTS) * missed(q, goal)

    lower = np.concatenate((np.full(6, -1.0), (HUMANOID.lower - posture.q[7:])[moves]))
    upper = np.concatenate((np.full(6, 1.0), (HUMANOID.upper - posture.q[7:])[moves]))
    start = np.clip(np.zeros(len(free)), lower + 1e-10, upper - 1e-10)
    peer = least_squares(rows, start, bounds=(lower, upper), xtol=1e-12, ftol=1e-12, max_nfev=20)
    assert np.sum(rows(np.zeros(len(free))) ** 2) <= 2 * peer.cost * (1 + 1e-3)


def test_out_of_reach_without_a_limit_to_blame() -> None:
    """A robot whose joints are free can't grow either."""
    loose = replace(HUMANOID, lower=np.full(15, -3.0), upper=np.full(15, 3.0))
    model = posture_model(loose)
    posture = settle(model, HUMANOID.home, target(com=(0, 0, 0.3)), 2000)
    assert posture.verdict is Verdict.OUT_OF_REACH, explain(model, posture)
    assert not posture.at_limit.any()


def walking(t: float) -> PostureTarget:
    """Something like a step each 0.6 s: the swing foot at up to 0.8 m/s, the centre of mass swaying."""
    phase = 2 * np.pi * t / 0.6
    return target(
        com=(0.02 * np.sin(phase), 0.03 * np.sin(phase / 2), -0.02 + 0.005 * np.sin(phase)),
        left=(0.075 * np.sin(phase), 0.01 * np.sin(phase), 0.02 * (1 - np.cos(phase))),
        yaw=0.1 * np.sin(phase),
    )


@pytest.mark.parametrize(("iterations", "metres"), [(1, 4e-4), (2, 5e-6)])
def test_a_step_or_two_a_tick_follow_a_walk(iterations: int, metres: float) -> None:
    q = settle(MODEL, HUMANOID.home, walking(0.0)).q
    for tick in range(1, 241):
        goal = walking(0.01 * tick)
        posture = solve_posture(MODEL, q, goal, iterations)
        assert posture.verdict is Verdict.REACHED, (tick, explain(MODEL, posture))
        assert np.abs(missed(posture.q, goal)).max() < metres
        q = posture.q


def test_a_released_pitch_errs_and_is_not_judged() -> None:
    weights = WEIGHTS.copy()
    weights[7] = 1e-5
    goal = target(left=(0.02, 0, 0.05), pitch=1.4)._replace(weights=weights)
    posture = settle(MODEL, HUMANOID.home, goal)
    assert posture.verdict is Verdict.REACHED
    pitch = missed(posture.q, goal)[6:9]
    assert abs(pitch[1]) > 0.02
    assert np.abs(pitch[[0, 2]]).max() < 1e-3
    assert settle(MODEL, HUMANOID.home, goal._replace(weights=WEIGHTS)).verdict is not Verdict.REACHED


def test_what_no_task_asks_goes_home() -> None:
    """With the chest released the torso is free."""
    weights = WEIGHTS.copy()
    weights[18:] = 0.0
    start = HUMANOID.home.copy()
    torso = [7 + HUMANOID.joints.index(name) for name in ("torso_pitch", "torso_yaw")]
    start[torso] = 0.3, -0.4
    posture = settle(MODEL, start, target()._replace(weights=weights))
    np.testing.assert_allclose(posture.q, HUMANOID.home, atol=1e-5)


def test_a_robot_without_a_torso_answers() -> None:
    """Fewer variables than rows: the chest is where the waist puts it."""
    stiff = replace(HUMANOID, moves=np.array(["torso" not in name and name != "arm" for name in HUMANOID.joints]))
    assert settle(posture_model(stiff), HUMANOID.home, REACHABLE[2]).verdict is Verdict.REACHED


def test_joints_beyond_their_limits_come_back_even_where_no_step_is_made() -> None:
    start = HUMANOID.home.copy()
    start[7:][HUMANOID.moves] = HUMANOID.upper[HUMANOID.moves] + 0.1
    posture = solve_posture(MODEL, start, target(com=(0, 0, np.nan)))
    np.testing.assert_array_equal(posture.q[7:], np.minimum(start[7:], HUMANOID.upper))
    assert np.array_equal(posture.at_limit, HUMANOID.moves)


@pytest.mark.parametrize("height", [np.nan, np.inf, 1e200])
def test_what_is_not_finite_leaves_the_posture_as_it_was(height: float) -> None:
    posture = solve_posture(MODEL, HUMANOID.home, target(com=(0, 0, height)), 3)
    assert posture.verdict is not Verdict.REACHED
    np.testing.assert_allclose(posture.q, HUMANOID.home, atol=1e-12)
    assert "the centre of mass by " in explain(MODEL, posture)


def test_a_reference_becomes_flat_soles_and_an_upright_trunk() -> None:
    feet = np.array([[0.1, 0.2, 0.03, 0.4], [0.0, -0.1, 0.0, -0.2]])
    none = np.zeros((2, 4))
    reference = Reference(
        0.0, np.array([[0.0, 0.0, 0.4], [1.0, 0, 0], [0, 0, 0]]), np.zeros(2), np.array([0.3, 1.0, 0]),
        feet, none, none, np.ones(2) / 2,
    )  # fmt: skip
    goal = posture_target(reference)
    np.testing.assert_array_equal(goal.com, [0, 0, 0.4])
    np.testing.assert_array_equal(goal.soles, feet[:, :3])
    yaws = [0.4, -0.2, 0.3, 0.3]
    for rotation, yaw in zip((*goal.sole_rotations, goal.waist_rotation, goal.chest_rotation), yaws, strict=True):
        np.testing.assert_allclose(rotation, Rotation.from_euler("z", yaw).as_matrix(), atol=1e-15)


@pytest.mark.usefixtures("unchecked")
def test_what_is_of_the_wrong_size_is_refused() -> None:
    with pytest.raises(BadInput, match="configuration"):
        solve_posture(MODEL, HUMANOID.home[1:], target())
    with pytest.raises(BadInput, match="target of 65 numbers"):
        solve_posture(MODEL, HUMANOID.home, target()._replace(com=np.zeros(2)))


def _without_mass(humanoid: Humanoid) -> Humanoid:
    return replace(humanoid, tree=humanoid.tree._replace(mass=0 * humanoid.tree.mass))


@pytest.mark.parametrize(
    ("broken", "what"),
    [
        (replace(HUMANOID, lower=HUMANOID.upper, upper=HUMANOID.lower), "joint left_hip_yaw: the lower limit"),
        (_without_mass(HUMANOID), "biped: the robot has no mass"),
    ],
)
def test_a_robot_that_cannot_be_is_refused(broken: Humanoid, what: str) -> None:
    with pytest.raises(BadInput, match=what):
        posture_model(broken)


@pytest.mark.parametrize("setting", [{"damping": 0.0}, {"pull": -1.0}, {"tolerance": (0.0, 1.0)}])
def test_settings_out_of_range_are_refused(setting: dict[str, Any]) -> None:
    with pytest.raises(BadInput, match="out of range"):
        posture_model(HUMANOID, **setting)
