"""Chosen movements: their worth by another formula, and by what is learned from them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import toddle
from toddle.failures import BadInput
from toddle.reach.explore.informative import propose
from toddle.reach.model.corrected import assumed, correct
from toddle.reach.model.rigid import Rigid, changed, number_slopes
from toddle.robots.chain import Chain
from toddle.robots.linkage import linkage_of, poses
from toddle.signals import Experience

Case = tuple[Rigid, np.ndarray, np.ndarray]


@pytest.fixture(scope="module")
def nicu() -> Case:
    body = toddle.load("nicu")
    assert isinstance(body, Chain)
    return assumed(linkage_of(body)), np.asarray(body.lower, float), np.asarray(body.upper, float)


def doubt_after(model: Rigid, q: np.ndarray, probes: np.ndarray, sensor: float = 1e-3) -> float:
    """Mean variance of the tip [m^2] after the movements, by information matrices."""
    free = np.diag(model.covariance) > 0
    looks = number_slopes(model.linkage, q)[1][:, :3, free].reshape(-1, free.sum()) / sensor
    left = np.linalg.inv(np.linalg.inv(model.covariance[np.ix_(free, free)]) + looks.T @ looks)
    slope = number_slopes(model.linkage, probes)[1][:, :3, free]
    return float(np.trace(slope @ left @ slope.transpose(0, 2, 1), axis1=1, axis2=2).mean())


def test_each_movement_is_the_best_of_its_candidates(nicu: Case) -> None:
    model, lower, upper = nicu
    rng = np.random.default_rng(0)
    pool, probes = rng.uniform(lower, upper, (15, 4)), rng.uniform(lower, upper, (4000, 4))
    chosen = propose(model, lower, upper, 3, candidates=pool)
    for made in range(3):
        worth = [doubt_after(model, np.vstack([chosen[:made], one]), probes) for one in pool]
        assert doubt_after(model, chosen[: made + 1], probes) < 1.05 * min(worth)


def test_what_was_done_counts(nicu: Case) -> None:
    model, lower, upper = nicu
    first = propose(model, lower, upper, 6, seed=3)
    np.testing.assert_array_equal(propose(model, lower, upper, 3, seed=3, done=first[:3]), first[3:])


def test_they_lie_within_the_limits_and_are_drawn_again_alike(nicu: Case) -> None:
    model, lower, upper = nicu
    chosen = propose(model, lower, upper, 12, turn_sensor=0.005, seed=1)
    assert chosen.shape == (12, 4)
    assert ((chosen >= lower) & (chosen <= upper)).all()
    np.testing.assert_array_equal(chosen, propose(model, lower, upper, 12, turn_sensor=0.005, seed=1))


def test_more_is_learned_from_them_than_from_random_ones(nicu: Case) -> None:
    model, lower, upper = nicu
    errors = {"chosen": [], "random": []}
    for seed in range(4):
        rng = np.random.default_rng(seed)
        truth = changed(model.linkage, np.sqrt(np.diag(model.covariance)) * rng.uniform(-1, 1, 34))
        unseen = rng.uniform(lower, upper, (500, 4))
        for way, q in {
            "chosen": propose(model, lower, upper, 20, seed=seed),
            "random": rng.uniform(lower, upper, (20, 4)),
        }.items():
            x = poses(truth, q)[:, :3, 3] + 1e-3 * rng.normal(size=(20, 3))
            fit = correct(model.linkage, Experience(q, x), joints=tuple("abcd")).fit
            off = fit.model.forward(unseen) - poses(truth, unseen)[:, :3, 3]
            errors[way].append(np.percentile(np.linalg.norm(off, axis=1), 99))
    assert np.median(errors["chosen"]) < 0.9 * np.median(errors["random"])


WRONG: dict[str, tuple[Callable[[Case], object], str]] = {
    "none wanted": (lambda c: propose(*c, 0), "0 movements"),
    "no noise": (lambda c: propose(*c, 3, sensor=0.0), "not positive"),
    "limits turned round": (lambda c: propose(c[0], c[2], c[1], 3), "limits"),
    "candidates of another arm": (lambda c: propose(*c, 3, candidates=np.zeros((5, 3))), "candidates"),
    "no candidates": (lambda c: propose(*c, 3, candidates=np.zeros((0, 4))), "no candidates"),
    "a gap": (lambda c: propose(*c, 3, done=np.full((1, 4), np.nan)), "made already"),
}


@pytest.mark.parametrize(("call", "message"), WRONG.values(), ids=WRONG.keys())
@pytest.mark.usefixtures("unchecked")
def test_what_cannot_be_used_is_refused(nicu: Case, call: Callable[[Case], object], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        call(nicu)
