import numpy as np
import pytest

import toddle
from toddle.failures import BadInput
from toddle.reach.gather import Sight, gather, postures, together, truth
from toddle.robots.black_box import CallablePlant
from toddle.robots.body import Body


@pytest.fixture(scope="module")
def arm():
    body = toddle.load("nicu")
    assert isinstance(body, Body)
    return body


def reach_of(body):
    return np.asarray(body.lower, float), np.asarray(body.upper, float)


def test_a_longer_run_begins_like_a_shorter_one(arm):
    lower, upper = reach_of(arm)
    long, short = (postures(lower, upper, count, seed=1) for count in (50, 20))
    np.testing.assert_array_equal(long[:20], short)
    sight = Sight(1e-3, 5e-3, turned=True)
    one, other = gather(arm, long, sight, seed=1), gather(arm, short, sight, seed=1)
    np.testing.assert_allclose(one.x[:20], other.x, atol=1e-12)
    assert one.turn is not None
    assert other.turn is not None
    np.testing.assert_allclose(one.turn[:20], other.turn, atol=1e-12)


def test_noise_has_the_size_that_was_asked_for(arm):
    q = postures(*reach_of(arm), 4000, seed=0)
    x, turn = truth(arm, q, turned=True)
    seen = gather(arm, q, Sight(2e-3, 5e-3, turned=True), seed=0)
    np.testing.assert_allclose((seen.x - x).std(axis=0), 2e-3, rtol=0.05)
    assert seen.turn is not None
    assert turn is not None
    cross = turn.transpose(0, 2, 1) @ seen.turn
    angles = np.stack([cross[:, 2, 1], cross[:, 0, 2], cross[:, 1, 0]], axis=1)
    np.testing.assert_allclose(angles.std(axis=0), 5e-3, rtol=0.05)


def test_a_soft_arm_shows_its_orientation_too():
    body = toddle.load("bha")
    assert isinstance(body, Body)
    q = postures(*reach_of(body), 5, seed=0)
    seen = gather(body, q, Sight(turned=True), seed=0)
    assert seen.turn is not None
    np.testing.assert_allclose(seen.turn @ seen.turn.transpose(0, 2, 1), np.tile(np.eye(3), (5, 1, 1)), atol=1e-5)
    np.testing.assert_allclose(seen.x, truth(body, q)[0], atol=1e-6)


def test_a_callable_is_asked_row_by_row_and_shows_no_orientation():
    plant = CallablePlant(lambda q: [q[0], 2 * q[0]], joints=["a"], lower=[0.0], upper=[1.0])
    q = np.array([[0.25], [0.5]])
    np.testing.assert_allclose(gather(plant, q, Sight(), seed=0).x, [[0.25, 0.5], [0.5, 1.0]])
    with pytest.raises(BadInput, match="orientation isn't seen"):
        gather(plant, q, Sight(turned=True), seed=0)


def test_movements_are_put_together_in_their_order(arm):
    q = postures(*reach_of(arm), 10, seed=0)
    whole = gather(arm, q, Sight(), seed=0)
    parts = together(gather(arm, q[:4], Sight(), seed=0), gather(arm, q[4:], Sight(), seed=0))
    np.testing.assert_allclose(parts.x, whole.x)
    assert parts.turn is None
