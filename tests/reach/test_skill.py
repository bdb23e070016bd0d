"""The six lines: learn, solve, evaluate; their figures by the arm's own trigonometry, their refusals in one line."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import tiny

import toddle
from toddle.failures import BadInput
from toddle.reach.api import hidden_of, suited
from toddle.reach.config import ReachConfig
from toddle.reach.observe import observer
from toddle.robots.black_box import CallablePlant
from toddle.robots.catalogue import CATALOGUE
from toddle.robots.planar import planar

ARM = planar(2)


def error_of(q: np.ndarray, targets: np.ndarray) -> np.ndarray:
    return np.linalg.norm([tiny.forward(row) for row in q] - targets, axis=1)


def test_figures_are_made_of_the_errors_on_each_test_set() -> None:
    skill = tiny.skill()
    errors = error_of(skill.predict(skill.targets), skill.targets)
    np.testing.assert_allclose(skill.errors, errors, atol=1e-6)
    figures = skill.figures
    assert figures["fixed_error_mean_mm"] == pytest.approx(1000 * errors.mean(), rel=1e-4)
    assert figures["fixed_error_max_mm"] == pytest.approx(1000 * errors.max(), rel=1e-4)
    assert figures["fixed_error_p99_mm"] == pytest.approx(1000 * np.percentile(errors, 99), rel=1e-4)
    assert figures["closed_loop_error_mean_mm"] < figures["fixed_error_mean_mm"]  # pyright: ignore[reportOperatorIssue]
    assert figures["test_points"] == len(skill.targets) == 20


def test_what_was_seen_lies_where_the_arm_can_be() -> None:
    seen = tiny.skill().seen
    assert seen.shape == (400, 2)
    assert np.all(np.linalg.norm(seen, axis=1) <= 1.0 + 1e-5)
    assert len(np.unique(seen, axis=0)) > 100


def test_a_cycle_at_a_time_is_told() -> None:
    told: list[int] = []
    skill = toddle.learn("planar:2", on_cycle=lambda cycle: told.append(cycle.samples), **tiny.SIZES)
    assert told == [100, 200, 300, 400]
    np.testing.assert_array_equal(skill.errors, tiny.skill().errors)


def test_evaluation_is_on_fresh_targets_that_can_be_reached() -> None:
    skill = tiny.skill()
    found = toddle.evaluate(skill, points=20, seed=5)
    fraction = np.random.default_rng(5).random((20, 2))
    lower, upper = np.asarray(ARM.lower, float), np.asarray(ARM.upper, float)
    targets = np.array([tiny.forward(q) for q in lower + fraction * (upper - lower)])
    errors = error_of(skill.predict(targets), targets)
    assert found["open_loop_error_mean_mm"] == pytest.approx(1000 * errors.mean(), rel=1e-3)
    assert found["open_loop_error_median_mm"] == pytest.approx(1000 * np.median(errors), rel=1e-3)
    assert found["closed_loop_error_mean_mm"] <= found["open_loop_error_mean_mm"]
    assert toddle.evaluate(skill, ARM, points=20, seed=5) == found
    assert toddle.evaluate(skill, "planar:2", points=20, seed=6) != found


def test_a_plant_moves_one_row_after_the_other() -> None:
    told: list[np.ndarray] = []

    def move(q: np.ndarray) -> np.ndarray:
        told.append(q)
        return tiny.forward(q)

    plant = CallablePlant(move, joints=ARM.joints, lower=ARM.lower, upper=ARM.upper)
    q = np.array([[0.1, 0.2], [-0.3, 0.4], [1.0, -1.0]])
    np.testing.assert_allclose(observer(plant)(q), observer(ARM)(q), atol=1e-6)
    np.testing.assert_array_equal(told, q)


@pytest.mark.parametrize("other", [planar(3), planar(2, limit=1.2), replace(ARM, joints=("left", "right"))])
def test_another_robot_is_refused(other: object) -> None:
    with pytest.raises(BadInput, match=r"aren't those of the skill \(joint_1, joint_2\); take the robot"):
        toddle.evaluate(tiny.skill(), other)  # pyright: ignore[reportArgumentType]


def test_an_arm_with_other_lengths_may_be_tried() -> None:
    """The same joints on a longer arm: open loop it misses, and looking helps."""
    found = toddle.evaluate(tiny.skill(), planar(2, length=1.1), points=20)
    assert found["closed_loop_error_mean_mm"] < found["open_loop_error_mean_mm"]


OPTIONS = {
    "an option that there isn't": ({"sample": 5}, r"learn: no option named 'sample'; did you mean samples"),
    "no samples": ({"samples": 0}, r"--samples: 0 is out of range; give 1 to"),
    "half a sample": ({"samples": 0.5}, r"--samples: 0.5 is no whole number; give 1 to"),
    "too many samples": ({"samples": 10**9}, r"--samples: 1000000000 is out of range"),
    "a negative seed": ({"seed": -1}, r"--seed: -1 is out of range; give 0 to"),
    "hidden layers as a number": ({"hidden": 10}, r"--hidden: 10 is no tuple; give a tuple, such as \(10,\)"),
    "an empty layer": ({"hidden": (10, 0)}, r"--hidden: 0 is out of range"),
    "a word for a rate": ({"learning_rate": "fast"}, r"--learning-rate: 'fast' is out of range; give a number above 0"),
    "a rate that is no number": ({"learning_rate": float("nan")}, r"--learning-rate: nan is out of range"),
    "no perturbation": ({"perturbation": 0.0}, r"--perturbation: 0.0 is out of range"),
    "an unknown method": ({"method": "motor-babling"}, r"--method: no method named .*; did you mean motor-babbling"),
    "an unknown learner": ({"learner": "perceptrn"}, r"--learner: no learner named 'perceptrn'; did you mean perc"),
    "an unknown network": ({"network": "deep"}, r"--network: no network named 'deep'"),
    "an unknown reading": ({"reading": "loose"}, r"--reading: no reading named 'loose'"),
    "hidden layers of a map": ({"learner": "local-linear", "hidden": (5,)}, r"--hidden: local-linear has no hidden"),
}


@pytest.mark.usefixtures("unchecked")
@pytest.mark.parametrize("name", OPTIONS)
def test_an_option_that_is_no_use_is_refused(name: str) -> None:
    options, says = OPTIONS[name]
    with pytest.raises(BadInput, match=says) as refusal:
        toddle.learn("planar:2", **options)
    assert "\n" not in refusal.value.line


def test_evaluating_nothing_is_refused() -> None:
    with pytest.raises(BadInput, match="evaluate: 0 points; give at least 1"):
        toddle.evaluate(tiny.skill(), points=0)


def test_robots_of_a_document_take_its_test_set_unless_told() -> None:
    for robot in CATALOGUE.values():
        assert hidden_of(robot.name.replace("N", "5")) == robot.hidden
        config = suited(ReachConfig(), robot.name)
        if robot.test_points:
            assert (config.test_points, config.test_spacing) == (robot.test_points, robot.test_spacing or None)
    assert suited(ReachConfig(test_points=7), "nicu") == ReachConfig(test_points=7)
    assert suited(ReachConfig(), "my_arm.urdf") == ReachConfig()


def test_the_door_has_what_the_readme_uses() -> None:
    assert {"load", "learn", "solve", "evaluate", "save", "load_skill", "Verdict"} <= set(toddle.__all__)
    for name in toddle.__all__:
        assert getattr(toddle, name).__name__ == name
    with pytest.raises(AttributeError, match="no attribute 'lern'"):
        toddle.lern  # noqa: B018  # pyright: ignore[reportAttributeAccessIssue]
