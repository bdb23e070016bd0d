"""The parts of the fit, each against an answer of its own."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.reach.explore.isolating import isolating_movements
from toddle.reach.explore.outward import outward_movements
from toddle.reach.model.rigid import changed, number_slopes
from toddle.reach.model.screw_arms import (
    Arms,
    from_lines,
    lines_of,
    linkage_from,
    move,
    recentred,
    stepped,
    tidied,
    without,
)
from toddle.reach.model.screw_isolation import alone
from toddle.reach.model.screw_start import lack_of_fit, robust_sigma
from toddle.reach.model.screw_steps import turned
from toddle.reach.model.screw_types import sliding
from toddle.robots.linkage import poses


def some_arms(seed: int, axes: int = 4, count: int = 3, ways: tuple[int, ...] = (1,)) -> Arms:
    rng = np.random.default_rng(seed)
    shape = (count, axes, 3)
    slides = rng.integers(0, 2, (count, axes)).astype(float)
    motor = np.tile(np.arange(axes), (count, 1))
    arms = from_lines(rng.normal(size=shape), rng.normal(size=shape), slides, rng.normal(size=(count, 3)), motor)
    return arms._replace(gain=rng.uniform(0.5, 1.5, (count, axes)) * rng.choice(ways, (count, axes)))


def test_candidates_move_as_linkages_do_and_so_do_their_slopes() -> None:
    arms, rng = some_arms(0), np.random.default_rng(1)
    q = rng.normal(size=(6, 4))
    free = rng.permutation(34)[:20]
    motion = move(arms, q, free, turns=True)
    for one in range(3):
        linkage = linkage_from(arms.pick(one), np.zeros(4))
        pose, slope = number_slopes(linkage, q)
        np.testing.assert_allclose(motion.place[one].T, pose[:, :3, 3], atol=1e-12)
        np.testing.assert_allclose(motion.turn[one].transpose(2, 1, 0), pose[:, :3, :3], atol=1e-12)
        np.testing.assert_allclose(motion.slope[one].transpose(2, 1, 0), slope[:, :, free], atol=1e-12)


def test_a_step_of_candidates_is_that_of_linkages() -> None:
    arms, rng = some_arms(2), np.random.default_rng(3)
    step, q = 0.1 * rng.normal(size=(3, 34)), rng.normal(size=(5, 4))
    after = stepped(arms, step, np.arange(34))
    for one in range(3):
        expected = changed(linkage_from(arms.pick(one), np.zeros(4)), step[one])
        np.testing.assert_allclose(poses(linkage_from(after.pick(one), np.zeros(4)), q), poses(expected, q), atol=1e-12)


@given(seed=st.integers(0, 10**6))
def test_what_only_writes_an_arm_differently_leaves_it_where_it_is(seed: int) -> None:
    arms, rng = some_arms(seed, count=1, ways=(1, -1)), np.random.default_rng(seed)
    q, shift = rng.normal(size=(5, 4)), rng.normal(size=4)
    there = poses(linkage_from(arms, np.zeros(4)), q)
    np.testing.assert_allclose(poses(linkage_from(tidied(arms), np.zeros(4)), q), there, atol=1e-9)
    np.testing.assert_allclose(poses(linkage_from(recentred(arms, shift), shift), q), there, atol=1e-9)


def test_an_arm_without_an_axis_is_the_arm_with_that_joint_at_zero() -> None:
    arms, q = some_arms(4), np.random.default_rng(5).normal(size=(6, 4))
    q[:, 2] = 0.0
    none = np.zeros(0, int)
    np.testing.assert_allclose(move(without(arms, 2), q, none).place, move(arms, q, none).place, atol=1e-9)


@given(seed=st.integers(0, 10**6))
def test_lines_of_an_arm_make_the_same_arm_again(seed: int) -> None:
    arms, q = some_arms(seed), np.random.default_rng(seed).normal(size=(5, 4))
    again = from_lines(*lines_of(arms)[:2], arms.slides, lines_of(arms)[2], arms.motor)._replace(gain=arms.gain)
    none = np.zeros(0, int)
    np.testing.assert_allclose(move(again, q, none).place, move(arms, q, none).place, atol=1e-9)


def test_an_axis_far_away_slides() -> None:
    far = from_lines(
        np.array([[[0.0, 0.0, 1.0]]]),
        np.array([[[0.0, 1000.0, 0.0]]]),
        np.zeros((1, 1)),
        np.zeros((1, 3)),
        np.zeros((1, 1), int),
    )._replace(gain=np.array([[2e-3]]))
    q, none = np.linspace(-0.3, 0.3, 5)[:, None], np.zeros(0, int)
    slid = sliding(far, np.array([True]))
    assert slid.slides[0, 0] == 1.0
    np.testing.assert_allclose(slid.gain, 2.0)
    np.testing.assert_allclose(move(slid, q, none).place, move(far, q, none).place, atol=1e-3)


@given(seed=st.integers(0, 10**6), angle=st.floats(0.0, 3.1))
def test_turns_are_measured_by_their_rotation_vector(seed: int, angle: float) -> None:
    from scipy.spatial.transform import Rotation

    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    vector = angle * axis / np.linalg.norm(axis)
    model = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    seen = Rotation.from_rotvec(vector).as_matrix() @ model
    np.testing.assert_allclose(turned(model.T[None, :, :, None], seen[None])[0, :, 0], vector, atol=1e-6)


@pytest.mark.parametrize("rows", [2, 3, 6])
def test_the_median_tells_the_noise(rows: int) -> None:
    miss = 0.7 * np.random.default_rng(rows).normal(size=(rows, 20000))
    np.testing.assert_allclose(robust_sigma((miss**2).sum(axis=0), rows), 0.7, rtol=0.03)


def test_noise_leaves_nothing_to_tell_and_a_wrong_arm_does() -> None:
    rng = np.random.default_rng(5)
    q = rng.uniform(-1.5, 1.5, (200, 4))
    chance = [lack_of_fit(rng.normal(size=(3, 200)), q, rng) for _ in range(100)]
    assert abs(np.mean(chance)) < 0.5
    assert 0.7 < np.std(chance) < 1.5
    told = np.stack([np.cos(q[:, 0]), np.sin(q[:, 1]), q[:, 2]])
    assert lack_of_fit(told + rng.normal(size=(3, 200)), q, rng) > 4


def test_every_joint_moves_alone_within_its_limits() -> None:
    lower, upper = np.array([-1.0, 0.0, -6.0]), np.array([1.0, 0.2, 6.0])
    home = np.array([0.5, 0.0, 0.0])
    movements = isolating_movements(lower, upper, home)
    assert (movements >= lower).all()
    assert (movements <= upper).all()
    found = alone(movements)
    assert found is not None
    np.testing.assert_array_equal(movements[found[0]], home)
    assert [int((found[1] == joint).sum()) for joint in range(3)] == [4, 3, 4]  # one place of the second is its home


def test_random_movements_show_no_joint_alone() -> None:
    assert alone(np.random.default_rng(6).normal(size=(100, 4))) is None


def test_outward_movements_follow_the_arcsine_law_and_full_turns_do_not() -> None:
    lower, upper = np.array([-1.0, -3.0]), np.array([0.0, 3.0])
    q = outward_movements(lower, upper, 400, np.random.default_rng(7))
    assert (q >= lower).all()
    assert (q <= upper).all()
    np.testing.assert_allclose(np.quantile(q[:, 0], [0.25, 0.5, 0.75]), [-0.8536, -0.5, -0.1464], atol=0.01)
    np.testing.assert_allclose(np.quantile(q[:, 1], [0.25, 0.5, 0.75]), [-1.5, 0.0, 1.5], atol=0.03)
    assert abs(np.corrcoef(q.T)[0, 1]) < 0.15
