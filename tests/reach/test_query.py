"""Answers: the numpy query beside JAX, and the verdicts of `solve` judged by the arm's own trigonometry."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import tiny
from hypothesis import given
from hypothesis import strategies as st

import toddle
from toddle.failures import BadInput
from toddle.reach.skill import Skill
from toddle.reach.solve.query import query_of
from toddle.robots.planar import planar
from toddle.signals import Verdict

ARM = planar(2)


def shaken(skill: Skill, size: float) -> Skill:
    """The same skill with large random weights: outputs in every corner of their range."""
    random = np.random.default_rng(3)
    state = jax.tree.map(lambda leaf: jnp.asarray(size * random.normal(size=leaf.shape), jnp.float32), skill.state)
    return replace(skill, state=state)


@pytest.mark.parametrize("network", ["refined", "plain"])
@pytest.mark.parametrize("size", [1.0, 3.0])
def test_the_numpy_query_answers_as_jax_does(network: str, size: float) -> None:
    learned = tiny.skill() if network == "refined" else tiny.plain_skill()
    skill = shaken(learned, size)
    query = query_of(skill)
    targets = np.random.default_rng(0).uniform(-1.2, 1.2, (300, 2))
    one_by_one = np.array([query(target) for target in targets])
    np.testing.assert_allclose(one_by_one, skill.predict(targets), atol=1e-5)
    assert len(np.unique(one_by_one.round(3))) > 20


@pytest.mark.parametrize("network", ["refined", "plain"])
def test_weights_of_any_size_overflow_nothing(network: str) -> None:
    skill = shaken(tiny.skill() if network == "refined" else tiny.plain_skill(), 1e6)
    query = query_of(skill)
    targets = np.random.default_rng(0).uniform(-1.2, 1.2, (20, 2))
    one_by_one = np.array([query(target) for target in targets])
    np.testing.assert_allclose(one_by_one, skill.predict(targets), atol=1e-5)


@given(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5))
def test_no_answer_leaves_the_joint_limits(x: float, y: float) -> None:
    skill = shaken(tiny.skill(), 3.0)
    for q in (query_of(skill)(np.array([x, y])), skill.predict(np.array([[x, y]]))[0]):
        assert np.all(q >= np.asarray(ARM.lower) - 1e-6)
        assert np.all(q <= np.asarray(ARM.upper) + 1e-6)


def test_an_answer_tried_on_the_arm_is_told_with_the_error_that_was_seen() -> None:
    skill = tiny.skill()
    for target in skill.targets[:8]:
        answer = toddle.solve(skill, target, robot=ARM, looks=3, tolerance=10.0)
        assert np.linalg.norm(tiny.forward(answer.q) - target) == pytest.approx(answer.expected_error, abs=1e-5)
        assert answer.steps == 3
        once = toddle.solve(skill, target, robot=ARM, looks=1, tolerance=10.0)
        alone = np.linalg.norm(tiny.forward(skill.predict(target[None])[0]) - target)
        assert answer.expected_error <= once.expected_error + 1e-6 <= alone + 2e-6


def test_a_verdict_follows_from_the_tolerance() -> None:
    skill, target = tiny.skill(), tiny.skill().targets[0]
    seen = toddle.solve(skill, target, robot=ARM, tolerance=10.0)
    assert seen.verdict is Verdict.REACHED
    error = seen.expected_error
    assert toddle.solve(skill, target, robot=ARM, tolerance=1.01 * error).verdict is Verdict.REACHED
    strict = toddle.solve(skill, target, robot=ARM, tolerance=0.99 * error)
    assert strict.verdict in (Verdict.NOT_CONVERGED, Verdict.AT_JOINT_LIMIT)
    np.testing.assert_array_equal(strict.q, seen.q)
    assert f"{1000 * error:.1f} mm" in strict.reason


def test_open_loop_expects_what_the_nearest_test_targets_had() -> None:
    skill = tiny.skill()
    target = skill.seen[5]
    nearest = np.argsort(np.linalg.norm(skill.targets - target, axis=1))[:5]
    by_hand = [np.linalg.norm(tiny.forward(skill.predict(t[None])[0]) - t) for t in skill.targets[nearest]]
    answer = toddle.solve(skill, target)
    assert answer.expected_error == pytest.approx(np.mean(by_hand), abs=1e-5)
    assert answer.steps == 0
    np.testing.assert_array_equal(answer.q, skill.predict(target[None])[0])


def test_a_joint_at_its_limit_is_named() -> None:
    skill = shaken(tiny.skill(), 1e6)  # every output is driven into its limit
    answer = toddle.solve(skill, skill.seen[0], tolerance=1e-6)
    assert answer.verdict is Verdict.AT_JOINT_LIMIT
    assert "joint_1" in answer.reason


def test_out_of_reach_is_said_with_the_nearest_place_that_was_visited() -> None:
    skill = tiny.skill()
    answer = toddle.solve(skill, [3.0, 4.0], robot=ARM)
    assert answer.verdict is Verdict.OUT_OF_REACH
    nearest = skill.seen[np.argmin(np.linalg.norm(skill.seen - [3.0, 4.0], axis=1))]
    assert " ".join(f"{value:.3f}" for value in nearest) in answer.reason
    np.testing.assert_array_equal(answer.q, skill.predict(nearest[None])[0])
    assert answer.expected_error > 3.9


@pytest.mark.parametrize(
    "target", [[1.0], [1.0, 0.0, 0.0], [], "ab", None, [[0.1, 0.2]], 0.3, [np.nan, 0], [np.inf, 0]]
)
@pytest.mark.usefixtures("unchecked")
def test_what_is_no_position_is_refused(target: object) -> None:
    with pytest.raises(BadInput, match=r"^target: .*; give"):
        toddle.solve(tiny.skill(), target)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("wrong", [{"looks": 0}, {"looks": -1}, {"tolerance": 0.0}, {"tolerance": np.nan}])
@pytest.mark.usefixtures("unchecked")
def test_looks_and_tolerance_must_be_of_use(wrong: dict[str, float]) -> None:
    with pytest.raises(BadInput, match="give"):
        toddle.solve(tiny.skill(), [0.5, 0.5], robot=ARM, **wrong)  # pyright: ignore[reportArgumentType]
