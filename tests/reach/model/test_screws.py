"""Rigid arms learned from nothing, judged by the arms that made the movements."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import toddle
from toddle.failures import BadInput
from toddle.reach.explore.isolating import isolating_movements
from toddle.reach.model.model import Fit
from toddle.reach.model.rigid import Rigid
from toddle.reach.model.screws import fit_screws
from toddle.robots.chain import Chain
from toddle.robots.linkage import Linkage, linkage_of, poses
from toddle.signals import Experience

NAMES = tuple("abcdefghij")


def drawn(kinds: str, seed: int, *, motor: tuple[int, ...] = (), gains: bool = False) -> Linkage:
    """An arm with axes anywhere: t turns, s slides; motor names which joint drives which axis."""
    rng = np.random.default_rng(seed)
    axes, joints = len(kinds), len(kinds) if not motor else max(motor) + 1
    frames = np.tile(np.eye(4), (axes + 1, 1, 1))
    frames[:, :3, :3] = Rotation.random(axes + 1, rng=np.random.default_rng(seed)).as_matrix()
    frames[:, :3, 3] = rng.uniform(-0.25, 0.25, (axes + 1, 3))
    gain = np.zeros((axes, joints))
    gain[np.arange(axes), motor or np.arange(axes)] = rng.uniform(0.5, 1.5, axes) * rng.choice([-1, 1], axes)
    if not gains:
        first = np.unique(motor or np.arange(axes), return_index=True)[1]
        gain[first] = np.sign(gain[first])
    offset = rng.uniform(-0.5, 0.5, axes) if gains else np.zeros(axes)
    return Linkage(frames[:-1], np.array([float(kind == "s") for kind in kinds]), gain, offset, frames[-1])


def span_of(linkage: Linkage) -> np.ndarray:
    return np.where((linkage.gain[linkage.slides > 0] != 0).any(axis=0), 0.25, 1.6)


def seen_from(
    linkage: Linkage,
    movements: int,
    seed: int,
    *,
    noise: float = 1e-3,
    wild: float = 0.0,
    turn: float | None = None,
    isolating: bool = False,
    rows: int = 3,
) -> tuple[Experience, np.ndarray]:
    rng = np.random.default_rng(seed)
    span = span_of(linkage)
    q = rng.uniform(-span, span, (movements, len(span)))
    if isolating:
        first = isolating_movements(-span, span, 0.1 * span)
        q[: len(first)] = first
    true = poses(linkage, q)
    x = true[:, :rows, 3] + noise * rng.normal(size=(movements, rows))
    off = rng.random(movements) < wild
    x[off] += rng.choice([-1, 1], (off.sum(), rows)) * rng.uniform(0.1, 1, (off.sum(), rows))
    turns = None
    if turn is not None:
        turns = Rotation.from_rotvec(turn * rng.normal(size=(movements, 3))).as_matrix() @ true[:, :3, :3]
    return Experience(q, x, turns), off


def p99(fit: Fit, linkage: Linkage) -> float:
    """Of the distances between learned and true tips at postures that were not learned from [m]."""
    span = span_of(linkage)
    q = np.random.default_rng(99).uniform(-span, span, (1000, len(span)))
    true = poses(linkage, q)[:, : fit.model.space, 3]
    return float(np.percentile(np.linalg.norm(fit.model.forward(q) - true, axis=1), 99))


@pytest.mark.parametrize("kinds", ["t", "tt", "s", "ts", "ttt", "tttt", "tsttt", "ttttttt"])
def test_an_arm_is_learned_from_random_movements(kinds: str) -> None:
    linkage = drawn(kinds, 3)
    fit = fit_screws(seen_from(linkage, 300, 1)[0], joints=NAMES[: len(kinds)])
    assert p99(fit, linkage) < 1e-3
    assert isinstance(fit.model, Rigid)
    np.testing.assert_array_equal(fit.model.linkage.slides, linkage.slides)
    np.testing.assert_array_equal(fit.model.linkage.gain, np.eye(len(kinds)))
    assert 0.9e-3 < fit.sensor < 1.1e-3


@pytest.mark.parametrize("kinds", ["tttt", "tsttt"])
def test_without_noise_it_is_exact(kinds: str) -> None:
    linkage = drawn(kinds, 4)
    fit = fit_screws(seen_from(linkage, 100, 2, noise=0.0)[0], joints=NAMES[: len(kinds)])
    assert p99(fit, linkage) < 1e-9
    assert fit.sensor < 1e-9
    assert not fit.wild.any()


def test_gains_slides_and_wild_movements_are_found_together() -> None:
    linkage = drawn("ttsttt", 7, gains=True)
    experience, wild = seen_from(linkage, 300, 3, wild=0.05, isolating=True)
    fit = fit_screws(experience, joints=NAMES[:6])
    assert p99(fit, linkage) < 1.3e-3
    np.testing.assert_array_equal(fit.wild, wild)
    assert isinstance(fit.model, Rigid)
    np.testing.assert_allclose(fit.model.linkage.gain, np.abs(linkage.gain), atol=0.02)
    assert "joint c slides" in fit.notes
    assert f"{wild.sum()} of 300 movements were seen wrongly and left out" in fit.notes


def test_a_motor_that_drives_two_axes_is_found() -> None:
    linkage = drawn("ttttt", 5, motor=(0, 1, 2, 1, 3))
    experience = seen_from(linkage, 300, 4, isolating=True)[0]
    fit = fit_screws(experience, joints=NAMES[:4])
    assert p99(fit, linkage) < 1e-3
    assert "motor b drives two axes" in fit.notes


@pytest.mark.parametrize("kinds", ["ttttt", "ttstt"])
def test_orientation_is_learned_with_the_place(kinds: str) -> None:
    linkage = drawn(kinds, 6)
    wrist = linkage._replace(tip=np.diag([1.0, -1.0, -1.0, 1.0]))  # the last axis runs through the tip
    fit = fit_screws(seen_from(wrist, 200, 5, turn=5e-3)[0], joints=NAMES[:5])
    assert p99(fit, wrist) < 1e-3
    q = np.random.default_rng(9).uniform(-span_of(wrist), span_of(wrist), (500, 5))
    assert isinstance(fit.model, Rigid)
    between = (
        Rotation.from_matrix(fit.model.pose(q)[:, :3, :3]) * Rotation.from_matrix(poses(wrist, q)[:, :3, :3]).inv()
    )
    assert np.percentile(between.magnitude(), 99) < 0.01


@pytest.mark.parametrize("joints", [3, 5, 12])
def test_a_planar_arm_keeps_to_its_plane(joints: int) -> None:
    rng = np.random.default_rng(joints)
    frames = np.tile(np.eye(4), (joints + 1, 1, 1))
    frames[:, :2, 3] = rng.uniform(-0.3, 0.3, (joints + 1, 2))
    ways = np.diag(rng.choice([-1.0, 1.0], joints))
    linkage = Linkage(frames[:-1], np.zeros(joints), ways, np.zeros(joints), frames[-1])
    experience = seen_from(linkage, 300, 6, rows=2)[0]
    fit = fit_screws(experience, joints=tuple(f"joint {number}" for number in range(joints)))
    assert fit.model.space == 2
    assert p99(fit, linkage) < 1e-3


def test_what_it_says_of_its_own_error_holds() -> None:
    linkage = drawn("tttt", 8)
    span = span_of(linkage)
    q = np.random.default_rng(1).uniform(-span, span, (200, 4))
    ratios = []
    for seed in range(12):
        fit = fit_screws(seen_from(linkage, 60, seed)[0], joints=NAMES[:4], seed=seed)
        off = fit.model.forward(q) - poses(linkage, q)[:, :3, 3]
        ratios.append(np.einsum("mi,mij,mj->m", off, np.linalg.inv(fit.model.spread(q)), off))
    assert 2.0 < np.mean(ratios) < 4.5  # three coordinates: 3


def test_a_joint_that_the_places_say_nothing_of_is_kept_and_told() -> None:
    linkage = drawn("tttt", 9)._replace(tip=np.eye(4))
    fit = fit_screws(seen_from(linkage, 150, 7)[0], joints=NAMES[:4])
    assert p99(fit, linkage) < 1e-3
    assert "joint d doesn't move the tip as far as was seen" in fit.notes


def test_types_that_are_known_are_kept() -> None:
    linkage = drawn("tstt", 10)
    experience = seen_from(linkage, 150, 8)[0]
    fit = fit_screws(experience, joints=NAMES[:4], slides=np.array([False, True, False, False]))
    assert p99(fit, linkage) < 1e-3


def test_the_catalogues_arm_is_learned_as_its_own_numbers_have_it() -> None:
    body = toddle.load("scara")
    assert isinstance(body, Chain)
    linkage, rng = linkage_of(body), np.random.default_rng(12)
    lower, upper = np.asarray(body.lower, float), np.asarray(body.upper, float)
    q = rng.uniform(lower, upper, (130, 4))
    x = poses(linkage, q)[:, :3, 3] + 1e-3 * rng.normal(size=(130, 3))
    fit = fit_screws(Experience(q, x), joints=body.joints)
    fresh = rng.uniform(lower, upper, (1000, 4))
    off = np.linalg.norm(fit.model.forward(fresh) - poses(linkage, fresh)[:, :3, 3], axis=1)
    assert np.percentile(off, 99) < 1e-3
    assert "joint d_4 slides" in fit.notes


def test_a_soft_arm_gives_the_best_chain_and_says_that_it_does_not_fit() -> None:
    rng = np.random.default_rng(12)
    q = rng.uniform(-1, 1, (50, 2))
    x = np.stack([q[:, 0] ** 3 - q[:, 1] ** 2, np.exp(q[:, 0] * q[:, 1]), np.abs(q[:, 1])], axis=1)
    fit = fit_screws(Experience(q, x), joints=("a", "b"))
    assert fit.miss.mean() > 0.02
    assert any("no rigid chain" in note for note in fit.notes)


def test_gaps_are_left_out_and_told() -> None:
    linkage = drawn("ttt", 13)
    experience = seen_from(linkage, 100, 9)[0]
    experience.x[[3, 40]] = np.nan
    fit = fit_screws(experience, joints=NAMES[:3])
    assert p99(fit, linkage) < 2e-3
    assert fit.wild[[3, 40]].all()
    assert "2 of 100 movements have gaps and were left out (rows 3, 40)" in fit.notes


def spoiled(how: str) -> Experience:
    experience = seen_from(drawn("ttt", 14), 50, 10)[0]
    q, x = experience.q, experience.x
    if how == "few":
        return Experience(q[:6], x[:6])
    if how == "still":
        q[:, 1] = 0.3
    elif how == "together":
        q[:, 2] = 0.5 * q[:, 0] + 1
    elif how == "three together":
        q[:, 2] = q[:, 0] - 0.5 * q[:, 1]
    elif how == "unmoved":
        x[:] = 0.4
    elif how == "unrelated":
        x[:] = 1e-3 * np.random.default_rng(0).normal(size=x.shape)
    elif how == "gaps":
        x[4:] = np.nan
    return experience


@pytest.mark.parametrize(
    ("how", "told"),
    [
        ("few", r"6 movements are too few for 3 joints.*need at least 8"),
        ("still", "joint 'b' never moves"),
        ("together", "joints 'a' and 'c' always move together"),
        ("three together", "joints 'a', 'b', 'c' always move together"),
        ("unmoved", "the tip never moves"),
        ("unrelated", "the tip doesn't follow the joints"),
        ("gaps", r"4 movements \(46 of 50 have gaps\) are too few"),
    ],
)
def test_movements_that_tell_nothing_are_refused(how: str, told: str) -> None:
    with pytest.raises(BadInput, match=told):
        fit_screws(spoiled(how), joints=NAMES[:3])


def test_columns_that_are_missing_are_refused(unchecked: None) -> None:
    experience = seen_from(drawn("ttt", 15), 50, 11)[0]
    with pytest.raises(BadInput, match="2 joints and 3 columns"):
        fit_screws(experience, joints=("a", "b"))
    with pytest.raises(BadInput, match="50 rows of joint values"):
        fit_screws(Experience(experience.q, experience.x[:20]), joints=NAMES[:3])
