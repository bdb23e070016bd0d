"""A wrong description is corrected: against truth that is known, a second solver, and differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import toddle
from toddle.failures import BadInput
from toddle.reach.explore.informative import propose
from toddle.reach.model.corrected import Corrected, Widths, assumed, correct
from toddle.reach.model.corrected_changes import report
from toddle.reach.model.corrected_fit import Belief, Seen, most_probable, residuals
from toddle.reach.model.rigid import Rigid, changed
from toddle.robots.chain import Chain
from toddle.robots.linkage import linkage_of, poses
from toddle.signals import Experience


class Case:
    """A described arm, the true one beside it, and movements that were seen of the true one."""

    def __init__(
        self, robot: str, seed: int, *, zero: float = 5.0, shift: float = 5.0, tilt: float = 0.0, gain: float = 0.0
    ):
        body = toddle.load(robot)
        assert isinstance(body, Chain)
        self.rng = np.random.default_rng(seed)
        self.nominal, self.joints, self.coordinates = linkage_of(body), body.joints, body.coordinates
        self.lower, self.upper = np.asarray(body.lower, float), np.asarray(body.upper, float)
        axes = len(self.nominal.slides)
        steps = np.zeros((axes, 7))
        steps[:, :3] = self.rng.uniform(-shift, shift, (axes, 3)) / 1e3
        steps[:, 3:5] = self.rng.uniform(-tilt, tilt, (axes, 2))
        turns = self.nominal.slides == 0
        steps[turns, 5] = np.radians(self.rng.uniform(-zero, zero, turns.sum()))
        steps[:, 6] = self.rng.uniform(-gain, gain, axes)
        self.zeros = steps[:, 5]
        tip = [*self.rng.uniform(-shift, shift, 3) / 1e3, 0, 0, 0]
        self.truth = changed(self.nominal, np.concatenate([steps.ravel(), tip]))

    def moved(self, count: int, noise: float = 1e-3, turn_noise: float | None = None) -> Experience:
        q = self.rng.uniform(self.lower, self.upper, (count, len(self.lower)))
        return self.seen(q, noise, turn_noise)

    def seen(self, q: np.ndarray, noise: float = 1e-3, turn_noise: float | None = None) -> Experience:
        pose = poses(self.truth, q)
        x = pose[:, self.coordinates, 3]
        x = x + noise * self.rng.normal(size=x.shape)
        if turn_noise is None:
            return Experience(q, x)
        wobble = Rotation.from_rotvec(turn_noise * self.rng.normal(size=(len(q), 3))).as_matrix()
        return Experience(q, x, wobble @ pose[:, :3, :3])

    def correct(self, experience: Experience, **settings) -> Corrected:
        return correct(self.nominal, experience, joints=self.joints, coordinates=self.coordinates, **settings)

    def misses(self, corrected: Corrected) -> np.ndarray:
        """Distances between the corrected and the true arm's tip, over postures that were not seen [mm]."""
        q = np.random.default_rng(99).uniform(self.lower, self.upper, (4096, len(self.lower)))
        off = corrected.fit.model.forward(q) - poses(self.truth, q)[:, self.coordinates, 3]
        return 1e3 * np.linalg.norm(off, axis=1)


def zeros_of(corrected: Corrected) -> np.ndarray:
    return np.array([change.zero for change in corrected.changes[:-1]])


def test_the_slopes_agree_with_differences() -> None:
    case = Case("scara", 0)
    movements = case.moved(4, turn_noise=0.1)
    seen = Seen(case.nominal, movements.q, movements.x, movements.turn, (0, 1, 2))
    numbers = 0.2 * case.rng.normal(size=34)
    slope = residuals(seen, numbers)[1]
    for number, step in enumerate(1e-6 * np.eye(34)):
        ahead, behind = (poses(changed(case.nominal, numbers + sign * step), movements.q) for sign in (1, -1))
        turned = Rotation.from_matrix(ahead[:, :3, :3] @ behind[:, :3, :3].transpose(0, 2, 1)).as_rotvec()
        expected = np.concatenate([ahead[:, :3, 3] - behind[:, :3, 3], turned], axis=1) / 2e-6
        np.testing.assert_allclose(slope[:, :, number], expected, atol=1e-6)


def test_a_second_solver_finds_the_same_arm() -> None:
    case = Case("nicu", 1)
    movements = case.moved(30)
    seen = Seen(case.nominal, movements.q, movements.x, None, (0, 1, 2))
    belief = Belief(np.tile([0.005] * 3 + [0.01] * 2 + [0.2, 0.01], 5)[:34], np.full(34, -1))
    found = most_probable(seen, belief, rounds=30)

    def weighed(numbers: np.ndarray) -> np.ndarray:
        off = movements.x - poses(changed(case.nominal, numbers), movements.q)[:, :3, 3]
        return np.concatenate([off.ravel() / found.sensor[0], numbers / belief.sd])

    expected = least_squares(weighed, np.zeros(34), x_scale=belief.sd, xtol=1e-12, ftol=1e-12).x
    np.testing.assert_allclose(found.numbers / belief.sd, expected / belief.sd, atol=5e-3)


@pytest.mark.parametrize("robot", ["nicu", "suralp", "scara"])
def test_thirty_chosen_movements_are_enough(robot: str) -> None:
    case = Case(robot, 2)
    chosen = propose(assumed(case.nominal), case.lower, case.upper, 30)
    corrected = case.correct(case.seen(chosen))
    assert np.percentile(case.misses(corrected), 99) < 1.5
    assert not corrected.doubtful
    assert 0.6e-3 < corrected.fit.sensor < 1.5e-3
    assert not corrected.fit.wild.any()


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_zeros_that_are_off_are_the_zeros_that_are_told(seed: int) -> None:
    case = Case("nicu", seed, shift=0)
    corrected = case.correct(case.seen(propose(assumed(case.nominal), case.lower, case.upper, 30)))
    np.testing.assert_allclose(np.degrees(zeros_of(corrected)), np.degrees(case.zeros), atol=0.25)


def test_its_doubt_is_as_large_as_its_error() -> None:
    ratios = []
    for seed in range(8):
        case = Case("nicu", seed, shift=0)
        corrected = case.correct(case.moved(40))
        doubt = np.array([change.zero_sd for change in corrected.changes[:-1]])
        ratios.append((zeros_of(corrected) - case.zeros) / doubt)
        q = case.rng.uniform(case.lower, case.upper, (200, 4))
        spread = np.trace(corrected.fit.model.spread(q), axis1=1, axis2=2).mean()
        ratios.append(np.full(4, np.sqrt(np.mean(case.misses(corrected) ** 2) / 1e6 / spread)))
    zero, tip = np.sqrt(np.mean(np.square(ratios[::2]))), np.sqrt(np.mean(np.square(ratios[1::2])))
    assert 0.6 < zero < 1.5
    assert 0.6 < tip < 1.5


def test_wild_movements_are_left_out() -> None:
    case = Case("nicu", 3)
    movements = case.moved(60)
    wild = np.arange(60) % 20 == 7
    movements.x[wild] += case.rng.uniform(-1, 1, (3, 3))
    corrected = case.correct(movements)
    np.testing.assert_array_equal(corrected.fit.wild, wild)
    assert np.percentile(case.misses(corrected), 99) < 1.5
    assert "3 of 60 movements were left out as wild" in corrected.fit.notes


@pytest.mark.parametrize(("sign", "zero"), [(-1.0, 0.0), (1.0, 70.0), (-1.0, -100.0)])
def test_a_gross_error_is_found(sign: float, zero: float) -> None:
    case = Case("nicu", 4)
    gain = case.truth.gain * [1, 1, sign, 1]
    case.truth = case.truth._replace(gain=gain, offset=case.truth.offset + gain[:, 2] * np.radians(zero))
    corrected = case.correct(case.moved(40))
    assert np.percentile(case.misses(corrected), 99) < 2
    assert [change.flipped for change in corrected.changes] == [False, False, sign < 0, False, False]
    assert ("arm_x: moves the other way" in report(corrected.changes)[2]) == (sign < 0)
    assert abs(np.degrees(corrected.changes[2].zero) - zero) < 10


def test_orientations_help() -> None:
    case = Case("nicu", 5)
    q = case.rng.uniform(case.lower, case.upper, (30, 4))
    blind, sighted = case.correct(case.seen(q)), case.correct(case.seen(q, turn_noise=0.005))
    assert np.mean(case.misses(sighted)) < np.mean(case.misses(blind))
    assert isinstance(sighted.fit.model, Rigid)
    turned = sighted.fit.model.pose(q)[:, :3, :3] @ poses(case.truth, q)[:, :3, :3].transpose(0, 2, 1)
    assert np.percentile(Rotation.from_matrix(turned).magnitude(), 99) < 0.01


def test_gains_and_tilts_change_only_on_evidence() -> None:
    straight = Case("nicu", 6)
    assert all(change.gain == 1 for change in straight.correct(straight.moved(60)).changes)
    bent = Case("nicu", 6, tilt=0.02, gain=0.03)
    corrected = bent.correct(bent.moved(60))
    true = bent.truth.gain.diagonal() / bent.nominal.gain.diagonal()
    assert any(change.gain != 1 for change in corrected.changes)
    assert all(abs(c.gain - g) < 4 * c.gain_sd for c, g in zip(corrected.changes[:-1], true, strict=True))
    assert np.percentile(bent.misses(corrected), 99) < 2


@pytest.mark.parametrize("robot", ["planar3", "scara", "planar:4"])
def test_a_description_that_is_right_stays_as_it_is(robot: str) -> None:
    case = Case(robot, 7, zero=0, shift=0)
    corrected = case.correct(case.moved(25, noise=0))
    assert case.misses(corrected).max() < 1e-3
    assert max(np.abs(change.shift).max() for change in corrected.changes) < 1e-6


def test_a_follower_of_a_joint_is_corrected_too() -> None:
    case = Case("planar:4", 8)
    case.nominal, case.truth = (
        arm._replace(gain=arm.gain[:, :3] + np.outer([0, 0, 0, 1], [0, 0.5, 0])) for arm in (case.nominal, case.truth)
    )
    case.lower, case.upper, case.joints = case.lower[:3], case.upper[:3], ("a", "b", "c")
    corrected = case.correct(case.moved(40))
    assert np.percentile(case.misses(corrected), 99) < 1.5
    assert [change.joint for change in corrected.changes] == ["a", "b", "c", "b", "tip"]


def test_a_joint_that_never_moved_is_named() -> None:
    case = Case("nicu", 9)
    q = case.rng.uniform(case.lower, case.upper, (30, 4))
    q[:, 1] = 0.1
    assert any("shoulder_y never moved" in note for note in case.correct(case.seen(q)).fit.notes)


def test_a_zero_that_does_not_show_is_said_not_to() -> None:
    case = Case("nicu", 10)
    onto_axis = case.nominal._replace(tip=np.eye(4))
    case.nominal, case.truth = onto_axis, case.truth._replace(tip=np.eye(4))
    last = case.correct(case.moved(40)).changes[-2]
    assert last.seen < 0.5
    assert last.zero_sd > np.radians(10)
    assert "not seen" in report((last,))[0]


def test_a_marker_that_is_placed_badly_is_found_where_it_is() -> None:
    case = Case("nicu", 11)
    case.truth.tip[:3, 3] += [0.03, -0.02, 0.04]
    corrected = case.correct(case.moved(40), widths=Widths(tip=0.03))
    assert np.percentile(case.misses(corrected), 99) < 2


def test_an_arm_that_sags_is_doubtful() -> None:
    case = Case("nicu", 12)
    movements = case.moved(60)
    sag = 0.03 * np.sin(7 * movements.q.sum(axis=1))
    corrected = case.correct(Experience(movements.q, movements.x + np.outer(sag, [0, 0, 1])))
    assert corrected.doubtful
    assert "learn the arm from nothing" in corrected.fit.notes[-1]


def test_what_cannot_be_used_is_refused() -> None:
    case = Case("nicu", 13)
    good = case.moved(30)
    with pytest.raises(BadInput, match="7 movements are too few"):
        case.correct(Experience(good.q[:7], good.x[:7]))
    with pytest.raises(BadInput, match="movement 4 is not all finite"):
        case.correct(Experience(good.q, np.where(np.arange(30)[:, None] == 3, np.nan, good.x)))
    with pytest.raises(BadInput, match="3 joints and the robot has 4"):
        case.correct(Experience(good.q[:, :3], good.x))
    with pytest.raises(BadInput, match="2 coordinates"):
        case.correct(Experience(good.q, good.x[:, :2]))


def test_a_log_of_another_robot_is_noticed() -> None:
    nicu, suralp = Case("nicu", 14), Case("suralp", 14)
    nicu.truth, suralp.truth = suralp.truth, nicu.truth
    with pytest.raises(BadInput, match="can't be this robot's"):
        suralp.correct(suralp.moved(60))
    assert nicu.correct(nicu.moved(60)).doubtful
