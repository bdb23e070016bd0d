"""The iterated inverse on every kind of body: rigid, sliding, planar, soft, and a callable."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.failures import BadInput
from toddle.reach.explore.babble import babble, suited_eps
from toddle.reach.iterated import IteratedInverse, fit_iterated, learn_iterated
from toddle.reach.observe import Observe, observer
from toddle.robots.body import Body
from toddle.robots.catalogue import load
from toddle.signals import Experience

BODIES = ("nicu", "scara", "planar:3", "bha")
TARGETS = 60


@functools.cache
def learned(spec: str) -> tuple[Body, Observe, IteratedInverse]:
    body = load(spec)
    return body, observer(body), learn_iterated(body, samples=1200, noise=0.005, seed=1, hidden=15, iterations=25)


@functools.cache
def targets_of(spec: str) -> np.ndarray:
    body, look, inverse = learned(spec)
    share = np.random.default_rng(9).uniform(size=(TARGETS, len(body.joints)))
    return look(inverse.lower + share * (inverse.upper - inverse.lower))


def distance(look: Observe, q: np.ndarray, targets: np.ndarray) -> np.ndarray:
    return np.linalg.norm(look(q) - targets, axis=1)


@pytest.mark.parametrize("spec", BODIES)
def test_it_comes_near_from_home_and_from_anywhere(spec: str):
    _, look, inverse = learned(spec)
    targets = targets_of(spec)
    share = np.random.default_rng(10).uniform(size=(TARGETS, len(inverse.lower)))
    anywhere = inverse.lower + share * (inverse.upper - inverse.lower)
    for starts in (np.tile(inverse.home, (TARGETS, 1)), anywhere):
        settled = inverse.solve(targets, starts, act=lambda q: (q, look(q)))
        assert np.median(distance(look, settled.q, targets)) < 0.25 * np.median(distance(look, starts, targets))
        assert np.all((settled.q >= inverse.lower) & (settled.q <= inverse.upper))
        assert np.array_equal(settled.trajectory[0], starts)
        assert np.array_equal(settled.trajectory[-1], settled.q)
        assert np.median(settled.steps) < 15


@pytest.mark.parametrize("spec", BODIES)
def test_it_settles_where_it_stays(spec: str):
    _, look, inverse = learned(spec)
    targets = targets_of(spec)
    settled = inverse.solve(targets, act=lambda q: (q, look(q)), most=50)
    done = settled.steps < 50
    moved = np.linalg.norm(np.diff(np.stack([look(q) for q in settled.trajectory]), axis=0), axis=2)
    for k in np.flatnonzero(done):
        assert np.all(moved[: settled.steps[k] - 1, k] >= 1e-3)
        assert moved[settled.steps[k] - 1, k] < 1e-3
        assert np.all(moved[settled.steps[k] :, k] == 0)


@pytest.mark.parametrize("spec", BODIES)
def test_unwatched_it_ends_where_it_would_when_watched(spec: str):
    _, look, inverse = learned(spec)
    targets = targets_of(spec)
    watched = distance(look, inverse.solve(targets, act=lambda q: (q, look(q))).q, targets)
    alone = distance(look, inverse.solve(targets).q, targets)
    assert np.median(alone) == pytest.approx(np.median(watched), rel=0.1)


@pytest.mark.parametrize("spec", BODIES)
def test_looks_bring_it_to_most_targets(spec: str):
    _, look, inverse = learned(spec)
    targets = targets_of(spec)
    q, errors = inverse.reach_for(look, targets, 8)
    assert errors.shape == (9, TARGETS)
    assert np.median(errors[8]) < 1e-3
    np.testing.assert_allclose(distance(look, q, targets), errors[8], atol=1e-6)
    assert np.all((q >= inverse.lower) & (q <= inverse.upper))


def test_with_feedback_the_soft_arm_follows_even_when_actuators_stand_still():
    _, look, inverse = learned("bha")
    angle = np.linspace(0, 2 * np.pi, 100, endpoint=False)
    path = np.stack([0.2 * np.cos(angle), 0.2 * np.sin(angle), np.full(100, 0.7)], axis=1)

    def act(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        stuck = np.concatenate([q[:, :6], np.tile(inverse.home[6:], (len(q), 1))], axis=1)
        return stuck, look(stuck)

    plain, corrected = (inverse.follow(path, act, feedback=share) for share in (0.0, 1.0))
    off, mended = (np.linalg.norm(way - path, axis=1)[20:].mean() for way in (plain, corrected))
    assert mended < 0.01
    assert mended < 0.2 * off


@given(st.floats(0.05, 2.0), st.integers(0, 100))
def test_the_walk_keeps_its_limits_and_its_step(eps: float, seed: int):
    body = load("scara")
    lower, upper = np.asarray(body.lower, float), np.asarray(body.upper, float)
    walk = babble(body, 50, eps=eps, noise=0.01, seed=seed)
    share = (walk.q - lower) / (upper - lower)
    assert np.all((share > -1e-9) & (share < 1 + 1e-9))
    assert np.all(np.linalg.norm(np.diff(share, axis=0), axis=1) < eps)
    np.testing.assert_allclose(walk.q[0], np.asarray(body.home, float), atol=1e-6)
    off = np.abs(walk.x - observer(body)(walk.q))
    assert 0 < off.max() <= 0.01 + 1e-6


def test_the_walk_comes_everywhere_alike():
    body = load("bha")
    share = (babble(body, 10_000, eps=0.8, seed=0).q - 0.1) / 0.2
    for joint in share.T:
        counts, _ = np.histogram(joint, bins=5, range=(0, 1))
        np.testing.assert_allclose(counts / len(joint), 0.2, atol=0.025)


def test_only_neighbours_that_are_near_are_learned_from():
    body = load("planar:2")
    walk = babble(body, 120, eps=0.3, seed=2)
    lower, upper, home = (np.asarray(v, float) for v in (body.lower, body.upper, body.home))
    # two walks in a row, a leap between them: the same as learning from the walk, told twice
    leap = Experience(np.concatenate([walk.q, walk.q]), np.concatenate([walk.x, walk.x]))
    whole = fit_iterated(leap, lower, upper, home, eps=0.3, hidden=3, iterations=2)
    assert whole.gain == pytest.approx(
        fit_iterated(walk, lower, upper, home, eps=0.3, hidden=3, iterations=2).gain, rel=0.05
    )
    with pytest.raises(BadInput, match="made one after the other"):
        fit_iterated(walk, lower, upper, home, eps=1e-6)


def test_nine_joints_step_as_the_experiments_do_about():
    assert suited_eps(9) == pytest.approx(1.2)


@pytest.mark.parametrize(
    ("targets", "starts", "line"),
    [
        (np.zeros((2, 3)), None, "rows of 2 numbers"),
        (np.array([[0.1, np.nan]]), None, "no number"),
        (np.zeros((2, 2)), np.zeros((2, 5)), "2 rows of 3 joint values"),
    ],
)
def test_targets_of_another_body_are_refused(
    unchecked: None, targets: np.ndarray, starts: np.ndarray | None, line: str
):
    _, _, inverse = learned("planar:3")
    with pytest.raises(BadInput, match=line):
        inverse.solve(targets, starts)


@pytest.mark.parametrize("change", [{"samples": 0}, {"eps": 0.0}, {"noise": -0.1}])
def test_a_walk_that_goes_nowhere_is_refused(change: dict[str, float]):
    asked = {"samples": 10, "eps": 0.1, "noise": 0.0, **change}
    with pytest.raises(BadInput, match="give positive numbers"):
        babble(load("planar:2"), int(asked["samples"]), eps=asked["eps"], noise=asked["noise"])
