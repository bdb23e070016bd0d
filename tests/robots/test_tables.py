"""Arms that are tables: the document's closed forms, and the planar arm's."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle import robots
from toddle.failures import BadInput
from toddle.robots.chain import Chain
from toddle.robots.dh import Row, from_table, planar3, scara
from toddle.robots.planar import planar

Answer = Callable[[Chain, np.ndarray], tuple[np.ndarray, np.ndarray]]
SINGLE = 1e-6  # [m] arms of less than a metre in single precision


def test_planar3_is_equation_3_of_martin_2009(answer: Answer) -> None:
    chain = planar3()
    q = np.random.default_rng(0).uniform(-np.pi / 2, np.pi / 2, (20, 3))
    a1, a2, a3 = 0.08625, 0.08625, 0.06125
    t1, t12, t123 = np.cumsum(q, axis=1).T
    expected = np.stack(
        [
            a1 * np.cos(t1) + a2 * np.cos(t12) + a3 * np.cos(t123),
            a1 * np.sin(t1) + a2 * np.sin(t12) + a3 * np.sin(t123),
        ],
        axis=1,
    )
    x, pose = answer(chain, q)
    np.testing.assert_allclose(x, expected, atol=SINGLE)
    np.testing.assert_allclose(pose[:, 0, 0], np.cos(t123), atol=SINGLE)
    np.testing.assert_allclose(pose[:, 0, 1], -np.sin(t123), atol=SINGLE)


def test_scara_is_equation_4_of_martin_2009(answer: Answer) -> None:
    """But for the signs of the second column, whose printed matrix is no rotation: its determinant is -1."""
    chain = scara()
    rng = np.random.default_rng(0)
    q = rng.uniform(np.asarray(chain.lower), np.asarray(chain.upper), (20, 4))
    t1, t12, t12_3 = q[:, 0], q[:, 0] + q[:, 1], q[:, 0] + q[:, 1] - q[:, 2]
    c, s, zero = np.cos(t12_3), np.sin(t12_3), np.zeros(20)
    x = 0.2 * np.cos(t1) + 0.2 * np.cos(t12)
    y = 0.2 * np.sin(t1) + 0.2 * np.sin(t12)
    rows = [[c, s, zero, x], [s, -c, zero, y], [zero, zero, zero - 1, -q[:, 3]], [zero, zero, zero, zero + 1]]
    expected = np.moveaxis(np.array(rows), 2, 0)
    positions, poses = answer(chain, q)
    np.testing.assert_allclose(poses, expected, atol=SINGLE)
    np.testing.assert_allclose(positions, expected[:, :3, 3], atol=SINGLE)


@given(st.sampled_from([1, 5, 17, 50]), st.integers(0, 10**6))
def test_the_planar_arm_is_a_sum_of_links(answer: Answer, n: int, seed: int) -> None:
    q = np.random.default_rng(seed).uniform(-np.pi / 2, np.pi / 2, n)
    angles = np.cumsum(q)
    expected = [np.cos(angles).sum() / n, np.sin(angles).sum() / n]
    np.testing.assert_allclose(answer(planar(n), q[None])[0][0], expected, atol=2e-6)


def test_the_straight_planar_arm_is_a_metre_long(answer: Answer) -> None:
    for n in (1, 17, 50):
        np.testing.assert_allclose(answer(planar(n), np.zeros((1, n)))[0][0], [1.0, 0.0], atol=2e-6)


def test_the_planar_arms_limits_and_length_can_be_chosen() -> None:
    arm = planar(3, limit=0.4, length=2.0)
    np.testing.assert_allclose(np.asarray(arm.upper), 0.4, rtol=1e-6)
    assert np.all(np.asarray(arm.home) <= 0.2 + 1e-6)
    assert float(arm.tip[0, 3]) == pytest.approx(2 / 3)
    for wrong in ({"limit": 0.0}, {"limit": math.nan}, {"length": -1.0}):
        with pytest.raises(BadInput, match="give a positive number"):
            planar(3, **wrong)


@pytest.mark.parametrize("spec", ["0", "201", "", "x", "-1", "1.5", "٣", "5 ", "1e2", "9" * 30, "5:5"])
def test_a_planar_arm_of_a_wrong_size(spec: str) -> None:
    with pytest.raises(BadInput) as caught:
        robots.load(f"planar:{spec}")
    assert re.search(r"^planar:.*: N is .*; give ", str(caught.value))


def test_a_table_that_makes_no_arm() -> None:
    with pytest.raises(BadInput, match="no row"):
        from_table("empty", [])
    for row in (Row("one", a=math.nan), Row("one", home=3.0), Row("one", limits=(1.0, 1.0), home=1.0)):
        with pytest.raises(BadInput, match="joint 'one'"):
            from_table("wrong", [row])
