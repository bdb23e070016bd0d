"""Any callable as a body: what it answers is passed on, and every fault of it is told as what it is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from toddle.failures import BadInput, ToddleError
from toddle.robots.black_box import CallablePlant
from toddle.robots.body import Plant


def wrap(function: Any, **changes: Any) -> CallablePlant:
    arguments = {"joints": ("a", "b"), "lower": [-1.0, 0.0], "upper": [1.0, 4.0], "name": "box", **changes}
    return CallablePlant(function, **arguments)


def two_links(q: np.ndarray) -> list[float]:
    return [float(np.cos(q[0]) + np.cos(q.sum())), float(np.sin(q[0]) + np.sin(q.sum()))]


def test_it_answers_what_the_callable_answers_within_the_limits() -> None:
    seen: list[np.ndarray] = []

    def watched(q: np.ndarray) -> list[float]:
        seen.append(q)
        return two_links(q)

    plant: Plant = wrap(watched)
    np.testing.assert_allclose(plant.move(np.array([0.0, np.pi / 2])), [1.0, 1.0], atol=1e-12)
    plant.move(np.array([-9.0, 9.0]))
    np.testing.assert_array_equal(seen[1], [-1.0, 4.0])
    np.testing.assert_array_equal(plant.home, [0.0, 2.0])
    np.testing.assert_array_equal(wrap(two_links, home=[0.5, 1.0]).home, [0.5, 1.0])


def test_a_callable_that_changes_its_argument_or_keeps_its_answer_harms_nothing() -> None:
    kept = np.zeros(2)

    def careless(q: np.ndarray) -> np.ndarray:
        q[:] = 7.0
        kept[:] += 1.0
        return kept

    plant, q = wrap(careless), np.array([0.5, 0.5])
    first = plant.move(q)
    plant.move(q)
    np.testing.assert_array_equal(q, [0.5, 0.5])
    np.testing.assert_array_equal(first, [1.0, 1.0])


def test_an_exception_of_the_callable_is_told_with_its_cause() -> None:
    def late(q: np.ndarray) -> list[float]:
        if q[0] > 0.5:
            raise RuntimeError("motor 2\nis hot")
        return two_links(q)

    plant = wrap(late)
    plant.move(np.array([0.0, 0.0]))
    with pytest.raises(ToddleError) as caught:
        plant.move(np.array([0.9, 0.0]))
    assert caught.value.line == "box: call 2 raised RuntimeError: motor 2 is hot; mend the callable"
    assert caught.value.exit_code == 1
    assert isinstance(caught.value.__cause__, RuntimeError)


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        ([1.0, float("nan")], r"box: call 1 answered \[ *1. nan\] at q = \[0. 0.\]; return finite numbers"),
        (None, "box: call 1 answered"),
        ("here", "box: call 1 answered here; return the tip position as numbers"),
        ([[1.0], [1.0, 2.0]], "return the tip position as numbers"),
        (3.0, r"box: call 1 answered with shape \(\); return a vector"),
        ([], r"answered with shape \(0,\); return a vector"),
        ([[1.0, 2.0]], r"answered with shape \(1, 2\); return a vector"),
    ],
)
def test_an_answer_that_is_no_position_is_refused(answer: Any, message: str) -> None:
    with pytest.raises(ToddleError, match=message):
        wrap(lambda q: answer).move(np.zeros(2))


def test_an_answer_of_another_length_than_before_is_refused() -> None:
    answers = iter([[1.0, 2.0], [1.0, 2.0, 3.0]])
    plant = wrap(lambda q: next(answers))
    plant.move(np.zeros(2))
    with pytest.raises(ToddleError, match=r"call 2 answered with shape \(3,\); return 2 numbers, as before"):
        plant.move(np.zeros(2))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"joints": ()}, "are none, or repeat; name every joint once"),
        ({"joints": ("a", "a")}, "are none, or repeat"),
        ({"lower": [0.0]}, r"box: lower = \[0.\] cannot be used; give 2 finite numbers"),
        ({"upper": [1.0, float("inf")]}, "upper = .* cannot be used"),
        ({"lower": [-1.0, 5.0]}, "the limits of b are not in order"),
        ({"home": [0.0, 9.0]}, "home is outside the limits"),
    ],
)
def test_a_wrong_description_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        wrap(two_links, **changes)


def test_what_is_no_command_is_refused() -> None:
    plant = wrap(two_links)
    for q in ([0.0], [0.0, float("nan")]):
        with pytest.raises(BadInput, match=r"box: q = .* cannot be used; give 2 finite numbers"):
            plant.move(np.array(q))
    with pytest.raises(BadInput, match="box: q = up is no vector; give 2 finite numbers"):
        plant.move("up")
    assert plant.moves == 0
