import jax.numpy as jnp
import numpy as np
import pytest

import toddle
from toddle.reach.model.rigid import Rigid, changed, number_slopes
from toddle.robots.chain import Chain
from toddle.robots.linkage import linkage_of, pose_slopes, poses


def twist_between(near, far):
    """Shift and turn of a small motion between two batches of transforms, in the base frame."""
    cross = (far - near)[:, :3, :3] @ ((near + far) / 2)[:, :3, :3].transpose(0, 2, 1)
    turn = np.stack([cross[:, 2, 1], cross[:, 0, 2], cross[:, 1, 0]], axis=1)
    return np.concatenate([far[:, :3, 3] - near[:, :3, 3], turn], axis=1)


@pytest.fixture(params=["nicu", "scara", "planar:3"])
def arm(request):
    body = toddle.load(request.param)
    assert isinstance(body, Chain)
    lower, upper = np.asarray(body.lower, float), np.asarray(body.upper, float)
    return linkage_of(body), np.random.default_rng(0).uniform(lower, upper, (5, len(lower))), body


def test_poses_are_those_of_the_chain(arm):
    linkage, q, body = arm
    for row, pose in zip(q, poses(linkage, q), strict=True):
        np.testing.assert_allclose(pose, np.asarray(body.pose(jnp.asarray(row, jnp.float32))), atol=1e-5)


def test_the_jacobian_agrees_with_differences(arm):
    linkage, q, _ = arm
    slope = pose_slopes(linkage, q)[1]
    for joint in range(q.shape[1]):
        step = np.eye(q.shape[1])[joint] * 1e-6
        expected = twist_between(poses(linkage, q - step), poses(linkage, q + step)) / 2e-6
        np.testing.assert_allclose(slope[:, :, joint], expected, atol=1e-6)


def test_the_slopes_of_the_constants_agree_with_differences(arm):
    linkage, q, _ = arm
    slope = number_slopes(linkage, q)[1]
    for number in range(slope.shape[2]):
        step = np.eye(slope.shape[2])[number] * 1e-6
        expected = twist_between(poses(changed(linkage, -step), q), poses(changed(linkage, step), q)) / 2e-6
        np.testing.assert_allclose(slope[:, :, number], expected, atol=2e-6)


def test_the_spread_is_that_of_arms_drawn_from_the_covariance():
    body = toddle.load("nicu")
    assert isinstance(body, Chain)
    linkage, rng = linkage_of(body), np.random.default_rng(1)
    root = 1e-4 * rng.normal(size=(34, 34))
    q = np.zeros((1, 4))
    drawn = np.concatenate([poses(changed(linkage, root @ rng.normal(size=34)), q)[:, :3, 3] for _ in range(4000)])
    np.testing.assert_allclose(np.cov(drawn.T), Rigid(linkage, root @ root.T).spread(q)[0], rtol=0.1, atol=1e-7)
