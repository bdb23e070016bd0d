"""Runs: the same whatever interrupts them, one by one or side by side, in one scan or one movement at a time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import tiny

import toddle
from toddle.failures import BadInput, ToddleError
from toddle.outside.simulation import PhysicsOptions, PhysicsPlant
from toddle.outside.skills import read_run, resume, save_run
from toddle.reach import live, loop
from toddle.reach.config import ReachConfig
from toddle.reach.session import Cycle, Session, cycles, open_session, start
from toddle.robots.black_box import CallablePlant
from toddle.robots.planar import planar

ARM = planar(2)
CONFIG = replace(ReachConfig(**tiny.SIZES), samples=200)


def plant_of(arm: Any = ARM, watched: list[np.ndarray] | None = None) -> CallablePlant:
    """The planar arm as a callable; what it was told is kept where somebody watches."""

    def move(q: np.ndarray) -> np.ndarray:
        if watched is not None:
            watched.append(q)
        return tiny.forward(q)

    return CallablePlant(move, joints=arm.joints, lower=arm.lower, upper=arm.upper, home=arm.home, name="told")


def equal(a: Any, b: Any) -> bool:
    """Whether two pytrees hold the same bits."""
    bits = lambda leaf: np.asarray(  # noqa: E731
        jax.random.key_data(leaf) if jnp.issubdtype(leaf.dtype, jax.dtypes.prng_key) else leaf
    ).tobytes()
    return [bits(leaf) for leaf in jax.tree.leaves(a)] == [bits(leaf) for leaf in jax.tree.leaves(b)]


def finish(session: Session, cycle: Cycle) -> Cycle:
    *_, last = cycles(session, cycle)
    return last


def interrupted(session: Session, after: int, folder: Path) -> Cycle:
    """The end of a run that was stopped after so many cycles, saved, and taken up by another process' session."""
    stopped = next(c for i, c in enumerate(cycles(session, start(session)), 1) if i == after)
    save_run(folder, session, stopped, {})
    config, _, tensors = read_run(folder)
    body = PhysicsPlant(ARM, session.body.options) if isinstance(session.body, PhysicsPlant) else planar(2)
    again = open_session(body, config, survey=planar(2))
    return finish(again, resume(again, tensors, str(folder)))


def test_a_run_goes_on_bit_for_bit(tmp_path: Path) -> None:
    """Ten cycles at once, or four, an interruption, and six."""
    session = tiny.session(samples=1000)
    straight = tiny.course(samples=1000)
    assert len(straight) == 10
    last = interrupted(session, 4, tmp_path)
    assert equal(last.progress, straight[-1].progress)
    assert equal(last.history, straight[-1].history)


def test_a_run_in_physics_goes_on_bit_for_bit(tmp_path: Path) -> None:
    """The arm's momentum and the sensor's noise are part of the run."""
    options = PhysicsOptions(noise=0.002, seed=3, sweep_s=0.2, settle_s=0.1)

    def opened() -> Session:
        return open_session(PhysicsPlant(ARM, options), CONFIG, survey=ARM)

    straight = finish(opened(), start(opened()))
    last = interrupted(opened(), 1, tmp_path)
    assert equal(last.progress, straight.progress)
    assert equal(last.history, straight.history)


def test_cycles_have_the_size_that_was_asked_for_and_the_last_one_the_rest() -> None:
    session = replace(tiny.session(), config=replace(tiny.session().config, samples=250))
    found = list(cycles(session, start(session)))
    assert [cycle.samples for cycle in found] == [100, 200, 250]
    assert [int(scores.samples) for scores in found[-1].history] == [100, 200, 250]
    assert equal(found[1].progress, tiny.course()[1].progress)


def test_a_seed_decides_everything() -> None:
    again = open_session(planar(2), tiny.session().config)
    assert equal(finish(again, start(again)).progress, tiny.course()[-1].progress)
    np.testing.assert_array_equal(again.targets, tiny.session().targets)
    other = tiny.course(seed=1)[-1]
    assert not equal(other.progress.learner, tiny.course()[-1].progress.learner)
    assert not equal(other.history, tiny.course()[-1].history)
    assert not np.array_equal(tiny.session(seed=1).targets, tiny.session().targets)


def test_test_targets_never_teach() -> None:
    """Other targets, and as many as one likes: what is learned stays the same to the last bit."""
    config = replace(tiny.session().config, test_points=7, test_spacing=0.2)
    session = open_session(ARM, config)
    assert not equal(session.targets, tiny.session().targets)
    last = finish(session, start(session))
    assert equal(last.progress, tiny.course()[-1].progress)


def test_targets_can_be_reached_and_are_as_many_as_asked() -> None:
    targets = tiny.session().targets
    assert targets.shape == (20, 2)
    assert np.all(np.linalg.norm(targets, axis=1) <= 1.0 + 1e-6)
    gaps = np.linalg.norm(targets[:, None] - targets[None], axis=2)[~np.eye(20, dtype=bool)]
    assert gaps.min() >= tiny.session().spacing * (1 - 1e-6)
    assert tiny.session().spacing > 0.1


def test_scores_are_mean_distances_by_the_arm_s_own_trigonometry() -> None:
    session, last = tiny.session(), tiny.course()[-1]
    q = session.predict(last.progress, session.targets)
    by_hand = [np.linalg.norm(tiny.forward(row) - target) for row, target in zip(q, session.targets, strict=True)]
    assert float(last.history[-1].fixed_error) == pytest.approx(np.mean(by_hand), abs=1e-5)
    assert 0 < float(last.history[-1].coverage) < 1


def test_one_movement_at_a_time_is_the_same_as_in_one_scan() -> None:
    """The callable computes in double precision, so the two part slowly: for fifty movements they stay together."""
    watched: list[np.ndarray] = []
    session = tiny.session()
    begun = start(session).progress
    scanned, movements = loop.advance_jit(session.setting, ARM, begun, 100)
    told = live.advance(session.setting, plant_of(watched=watched), begun, 100)
    q = np.asarray(session.setting.box.q_from_unit(movements.q))
    np.testing.assert_allclose(np.stack(watched[:50]), q[:50], atol=2e-3)
    np.testing.assert_allclose(told.seen.positions[:50], scanned.seen.positions[:50], atol=2e-3)
    assert int(told.seen.total) == len(watched) == 100
    assert equal(told.key, scanned.key)
    both = (told.explorer, told.learner), (scanned.explorer, scanned.learner)
    for one, other in zip(*map(jax.tree.leaves, both), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-2)


def test_a_callable_learns_what_the_body_learns() -> None:
    on_callable = open_session(plant_of(), CONFIG, survey=ARM)
    told = finish(on_callable, start(on_callable))
    assert len(told.history) == 2
    for one, other in zip(tiny.course()[1].history, told.history, strict=True):
        assert float(one.fixed_error) == pytest.approx(float(other.fixed_error), abs=5e-3)
        assert float(one.coverage) == pytest.approx(float(other.coverage), abs=0.01)


def test_a_callable_is_all_that_learn_needs() -> None:
    watched: list[np.ndarray] = []
    learned = toddle.learn(plant_of(watched=watched), samples=100, per_cycle=100, hidden=(4,), test_points=20)
    skill = tiny.inverse(learned)
    assert skill.figures["robot"] == "told"
    assert skill.figures["samples"] == 100
    assert len(watched) > 1100, "it surveys with a thousand movements, then learns"
    assert np.all(np.stack(watched) >= np.asarray(ARM.lower) - 1e-6)
    answer = toddle.solve(skill, skill.seen[0], robot=plant_of(), tolerance=10.0)
    assert np.linalg.norm(tiny.forward(answer.q) - skill.seen[0]) == pytest.approx(answer.expected_error, abs=1e-5)


def test_runs_side_by_side_are_the_runs_one_by_one() -> None:
    session = tiny.session()
    targets = jnp.asarray(session.targets, jnp.float32)

    @eqx.filter_jit
    @jax.vmap
    def family(key: jax.Array) -> tuple[loop.Progress, loop.Scores]:
        return loop.learn_in_cycles(session.setting, ARM, key, 4, 100, targets, session.reachable_cells)

    keys = [jax.random.key(0), jax.random.key(1)]
    progress, scores = family(jnp.stack(keys))
    for i, key in enumerate(keys):
        alone = finish(session, Cycle(eqx.filter_jit(loop.begin)(session.setting, key), ()))
        for one, other in zip(jax.tree.leaves(alone.progress.learner), jax.tree.leaves(progress.learner), strict=True):
            np.testing.assert_allclose(other[i], one, atol=1e-4)
        np.testing.assert_allclose(scores.fixed_error[i], [s.fixed_error for s in alone.history], atol=1e-4)
        np.testing.assert_array_equal(scores.samples[i], [100, 200, 300, 400])
    assert np.ptp(np.asarray(scores.fixed_error)[:, -1]) > 1e-3


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        (lambda q: q[:1], r"told: its tip has 1 coordinates; it takes 2 or 3"),
        (lambda q: np.ones(4), r"told: its tip has 4 coordinates; it takes 2 or 3"),
        (lambda q: np.ones(2), r"no joint moves the tip"),
        (lambda q: [q[0], np.nan], r"told: call 1 answered .*nan"),
        (lambda q: "here", r"told: call 1 answered here"),
        (lambda q: 1 / 0, r"told: call 1 raised ZeroDivisionError"),
    ],
)
def test_a_callable_that_answers_nonsense_is_told_so(answer: Any, says: str) -> None:
    plant = CallablePlant(answer, joints=["a", "b"], lower=[-1, -1], upper=[1, 1], name="told")
    with pytest.raises(ToddleError, match=says):
        toddle.learn(plant, samples=20, test_points=5)


def test_learning_that_diverges_is_told_and_ends() -> None:
    session = tiny.session()
    spoilt = start(session)
    broken = jax.tree.map(lambda leaf: leaf * jnp.nan, spoilt.progress.learner)
    with pytest.raises(ToddleError, match=r"learning diverged after 100 movements; lower --learning-rate") as told:
        finish(session, Cycle(spoilt.progress._replace(learner=broken), ()))
    assert not isinstance(told.value, BadInput)
