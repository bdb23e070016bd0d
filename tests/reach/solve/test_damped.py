"""The native solver against other ways to know: the chain's own poses, SciPy, differences, an optimum's conditions."""

import dataclasses
import importlib.metadata

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reach.solve.odd_arms import odd_arms
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import toddle
from toddle.failures import BadInput
from toddle.reach.solve.damped import RADIAN, damped_solver, solver_for
from toddle.reach.solve.redundancy import apart
from toddle.robots.chain import Chain
from toddle.robots.linkage import Linkage, linkage_of, pose_slopes, poses
from toddle.signals import Verdict

PACKAGE = importlib.metadata.distribution("example-robot-data")
FILES = "cmeel.prefix/share/example-robot-data/robots"
ARMS = {
    "panda": ("panda_description/urdf/panda.urdf", "panda_hand_tcp"),
    "xarm7": ("xarm_description/urdf/xarm7.urdf", None),
    "ur5": ("ur_description/urdf/ur5_robot.urdf", "tool0"),
    "tiago": ("tiago_description/robots/tiago_no_hand.urdf", "wrist_ft_tool_link"),
}


def chain(name: str) -> Chain:
    file, tip = ARMS.get(name, (None, None))
    body = toddle.load(str(PACKAGE.locate_file(f"{FILES}/{file}")), tip=tip) if file else toddle.load(name)
    assert isinstance(body, Chain)
    return body


def targets(body: Chain, count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random postures, and where and how they put the tip."""
    lower, upper = np.asarray(body.lower, float), np.asarray(body.upper, float)
    q = np.random.default_rng(seed).uniform(lower, upper, (count, len(lower)))
    pose = poses(linkage_of(body), q)
    return pose[:, list(body.coordinates), 3], pose[:, :3, :3], q


def tip(linkage: Linkage, q: np.ndarray) -> np.ndarray:
    """The tip's transform for one posture, as it is defined."""
    frame = np.eye(4)
    for before, slides, motion in zip(linkage.before, linkage.slides, linkage.gain @ q + linkage.offset, strict=True):
        cos, sin = (1, 0) if slides else (np.cos(motion), np.sin(motion))
        z = np.array([[cos, -sin, 0, 0], [sin, cos, 0, 0], [0, 0, 1, slides * motion], [0, 0, 0, 1]])
        frame = frame @ before @ z
    return frame @ linkage.tip


def missed(body: Chain, q: np.ndarray, x: np.ndarray, turn: np.ndarray | None) -> np.ndarray:
    """Distance [m] and angle [rad] by the chain's poses and SciPy's rotations."""
    pose = poses(linkage_of(body), np.atleast_2d(q))
    distance = np.linalg.norm(pose[:, list(body.coordinates), 3] - x, axis=1)
    if turn is None:
        return np.stack([distance, 0 * distance], axis=1)
    return np.stack([distance, Rotation.from_matrix(pose[:, :3, :3].transpose(0, 2, 1) @ turn).magnitude()], axis=1)


@pytest.mark.parametrize("posed", [True, False])
@pytest.mark.parametrize("name", [*ARMS, "icub_arm", "nicu", "scara", "planar:3", "planar:20"])
def test_reachable_targets_are_reached_inside_the_limits(name, posed):
    body = chain(name)
    x, turns, _ = targets(body, 300)
    solver = solver_for(body)
    answers = solver.solve(x, turns if posed else None)
    assert answers.solved.all()
    assert ((solver.lower <= answers.q) & (answers.q <= solver.upper)).all()
    independent = missed(body, answers.q, x, turns if posed else None)
    assert independent[:, 0].max() < 1.001e-5
    assert independent[:, 1].max() < 1.001e-4
    np.testing.assert_allclose(independent, np.stack([answers.distance, answers.angle], axis=1), atol=1e-7)


def test_one_at_a_time_is_the_same_as_a_batch():
    body = chain("panda")
    x, turns, q = targets(body, 20)
    solver = solver_for(body)
    for choice in ("first", "nearest"):
        batch = solver.solve(x, turns, near=q[::-1].copy(), choice=choice)
        for row, near in enumerate(q[::-1]):
            one = solver.solve_one(x[row], turns[row], near, choice)
            np.testing.assert_array_equal(one.q, batch.q[row])
            assert (one.distance, one.angle, one.solved) == (batch.distance[row], batch.angle[row], batch.solved[row])


@pytest.mark.parametrize(("name", "posed"), [("panda", True), ("ur5", False), ("scara", False), ("planar:3", False)])
def test_out_of_reach_the_nearest_pose_is_that_of_scipy(name, posed):
    body = chain(name)
    x, turns, q = targets(body, 4)
    x = 1.5 * x + 0.1
    turn = turns[::-1].copy() if posed else None
    solver = solver_for(body)
    linkage, wanted = linkage_of(body), list(body.coordinates)

    def error(q, row):
        pose = tip(linkage, q)
        shift = pose[wanted, 3] - x[row]
        if turn is None:
            return shift
        return np.concatenate([shift, RADIAN * Rotation.from_matrix(pose[:3, :3].T @ turn[row]).as_rotvec()])

    for row in range(len(x)):
        q_near, distance, angle = solver.nearest(x[row], None if turn is None else turn[row])
        np.testing.assert_allclose(
            missed(body, q_near, x[row], turn if turn is None else turn[row])[0, 0], distance, atol=1e-9
        )
        starts = np.random.default_rng(1).uniform(solver.lower, solver.upper, (10, q.shape[1]))
        best = min(least_squares(error, s, bounds=(solver.lower, solver.upper), args=(row,)).cost for s in starts)
        assert 0.5 * (distance**2 + (RADIAN * angle) ** 2) < best + 1e-7
        answer = solver.solve_one(x[row], None if turn is None else turn[row])
        assert answer.solved == (best < 1e-9)


def test_the_nearest_posture_satisfies_the_conditions_of_an_optimum():
    body = chain("panda")
    x, turns, q = targets(body, 60)
    solver = solver_for(body)
    near = np.clip(q + np.random.default_rng(3).uniform(-1, 1, q.shape), solver.lower, solver.upper)
    answers = solver.solve(x, turns, near=near, choice="nearest")
    first = solver.solve(x, turns, near=near)
    assert answers.solved.all()
    assert np.mean(apart(solver.arm, answers.q, near) <= apart(solver.arm, first.q, near) + 1e-6) > 0.95
    span = solver.upper - solver.lower
    slope = pose_slopes(linkage_of(body), answers.q)[1]
    along_self_motion = []
    for row in range(len(q)):
        free = ~answers.held[row]
        if free.sum() <= 6:
            continue
        wish = ((near[row] - answers.q[row]) / span)[free]
        columns = (slope[row] * span)[:, free]
        along_self_motion.append(np.abs(wish - np.linalg.pinv(columns) @ (columns @ wish)).max())
    assert len(along_self_motion) > 20
    assert np.mean(np.array(along_self_motion) < 0.02) > 0.9  # singular postures are slow to settle


def test_the_central_posture_is_more_central():
    body = chain("xarm7")
    x, turns, _ = targets(body, 50)
    solver = solver_for(body)
    middle = (solver.lower + solver.upper) / 2
    central, first = solver.solve(x, turns, choice="central"), solver.solve(x, turns)
    assert central.solved.all()
    assert apart(solver.arm, central.q, middle).mean() < 0.7 * apart(solver.arm, first.q, middle).mean()


def test_whole_turns_are_taken_where_the_limits_let_them():
    body = chain("ur5")
    x, turns, q = targets(body, 1)
    solver = solver_for(body)
    near = np.where(q[0] > 0, q[0] - 2 * np.pi, q[0] + 2 * np.pi)
    near = np.where((near >= solver.lower) & (near <= solver.upper), near, q[0])
    assert (near != q[0]).any()
    np.testing.assert_allclose(solver.solve_one(x[0], turns[0], near, "nearest").q, near, atol=1e-3)


@pytest.mark.parametrize("name", ["panda", "ur5"])
def test_distinct_solutions_are_solutions_and_distinct(name):
    body = chain(name)
    x, turns, q = targets(body, 5)
    solver = solver_for(body)
    counts = []
    for row in range(5):
        solutions = solver.distinct(x[row], turns[row], 6, near=q[row])
        counts.append(len(solutions))
        assert missed(body, solutions, x[row], turns[row]).max() < 1e-4
        assert (np.diff(apart(solver.arm, solutions, q[row])) >= 0).all()
        for i in range(1, len(solutions)):
            assert apart(solver.arm, solutions[:i], solutions[i]).min() > 0.04
    assert sum(counts) >= 20


def test_what_keeps_the_tip_away_is_told():
    solver = solver_for(chain("planar:2"))
    upper = float(solver.upper[0])
    reached, beyond = np.array([0.5, 0.5]), np.array([1.5, 0.0])
    limited = 0.999 * np.array([np.cos(upper + 0.3), np.sin(upper + 0.3)])
    verdicts = [solver.judge(x, None, solver.solve_one(x)) for x in (reached, beyond, limited)]
    assert [v.verdict for v in verdicts] == [Verdict.REACHED, Verdict.OUT_OF_REACH, Verdict.AT_JOINT_LIMIT]
    assert verdicts[2].joints == (0,)


@given(
    arm=odd_arms(),
    target=st.tuples(*[st.sampled_from([0.0, 1e-9, 0.3, -0.7, 5.0, -9e4])] * 3),
    turn=st.none() | st.sampled_from([(0, 0, 0), (np.pi, 0, 0), (0.1, -2, 0.3)]),
    choice=st.sampled_from(["first", "nearest", "central"]),
)
def test_odd_arms_are_answered_with_numbers_inside_the_limits(arm, target, turn, choice):
    linkage, lower, upper = arm
    solver = damped_solver(linkage, lower, upper, postures=64, tries=8)
    x, turns = np.array([target]), None if turn is None else Rotation.from_rotvec([turn]).as_matrix()
    answers = solver.solve(x, turns, near=lower, choice=choice)
    assert ((lower <= answers.q) & (answers.q <= upper)).all()
    pose = poses(linkage, answers.q)[0]
    np.testing.assert_allclose(np.linalg.norm(pose[:3, 3] - x[0]), answers.distance[0], rtol=1e-9, atol=1e-9)
    if turns is not None:
        angle = Rotation.from_matrix(pose[:3, :3].T @ turns[0]).magnitude()
        np.testing.assert_allclose(answers.angle[0], angle, atol=1e-6)
    own = poses(linkage, (0.5 * (lower + upper))[None])[0]
    assert solver.solve_one(own[:3, 3], own[:3, :3], 0.5 * (lower + upper), choice).solved


@pytest.mark.usefixtures("unchecked")
def test_what_cannot_be_used_is_refused():
    body = chain("panda")
    solver = solver_for(body, postures=64)
    x, turn = np.array([0.4, 0.0, 0.4]), np.eye(3)
    for target, turned in [
        (x * np.nan, None),
        (x + np.inf, None),
        (x[:2], None),
        (x * 1e7, None),
        (x, 2 * turn),
        (x, -turn),
        (x, turn * np.nan),
        (x, turn[:2]),
    ]:
        with pytest.raises(BadInput):
            solver.solve_one(target, turned)
        with pytest.raises(BadInput):
            solver.solve(target[None], None if turned is None else turned[None])
    for near in (np.zeros(6), np.full(7, np.nan), np.zeros((3, 7))):
        with pytest.raises(BadInput):
            solver.solve(x[None], near=near)
    linkage = linkage_of(body)
    with pytest.raises(BadInput, match="joint 2 has no range"):
        damped_solver(linkage, solver.lower, np.where(np.arange(7) == 2, solver.lower, solver.upper))
    with pytest.raises(BadInput):
        damped_solver(linkage, solver.lower, np.where(np.arange(7) == 2, np.inf, solver.upper))
    with pytest.raises(dataclasses.FrozenInstanceError):
        solver.tries = 3  # pyright: ignore[reportAttributeAccessIssue]
