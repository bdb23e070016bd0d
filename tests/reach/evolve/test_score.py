import numpy as np
import pytest

from toddle.reach.evolve.score import arm_of, scores, tips
from toddle.robots.dh import UNIT, planar3, scara
from toddle.robots.linkage import poses
from toddle.robots.planar import planar

CHAINS = {"planar3": planar3, "scara": scara, "planar:7": lambda: planar(7)}


@pytest.mark.parametrize("name", CHAINS)
def test_tips_are_those_of_the_transforms(name: str):
    arm = arm_of(CHAINS[name]())
    q = np.random.default_rng(0).uniform(arm.lower, arm.upper, (50, len(arm.lower)))
    expected = poses(arm.linkage, q)[:, arm.coordinates, 3]
    np.testing.assert_allclose(tips(arm, q.T).T, expected, atol=1e-15)
    rough = tips(arm, q.T.astype(np.float32))
    assert rough.dtype == np.float32
    np.testing.assert_allclose(rough.T, expected, atol=1e-6)


def test_tips_are_those_of_the_documents_equations_3_and_4():
    q = np.random.default_rng(1).uniform(-1, 1, (4, 20))
    sums = np.cumsum(q[:3], axis=0)
    lengths = np.array([8.625, 8.625, 6.125])
    by_3 = [(lengths[:, None] * f(sums)).sum(axis=0) for f in (np.cos, np.sin)]
    np.testing.assert_allclose(tips(arm_of(planar3()), q[:3]) / UNIT, by_3, rtol=1e-5)
    by_4 = [20 * f(sums[0]) + 20 * f(sums[1]) for f in (np.cos, np.sin)]
    np.testing.assert_allclose(tips(arm_of(scara()), q) / UNIT, [*by_4, -q[3] / UNIT], rtol=1e-5, atol=1e-6)


def test_a_score_is_a_mean_over_the_goals():
    arm, random = arm_of(scara()), np.random.default_rng(2)
    q, goals = random.uniform(-1, 1, (3, 4, 5)), random.uniform(-1, 1, (5, 3))
    for k, score in enumerate(scores(arm, q, goals)):
        reached = poses(arm.linkage, q[k].T)[:, :3, 3]
        assert score == pytest.approx(np.mean(np.sum((reached - goals) ** 2, axis=1)), rel=1e-12)


def test_drawn_goals_can_be_reached_and_fill_the_workspace():
    arm = arm_of(planar3())
    goals, box = arm.drawn(500, 0), arm.workspace()
    assert np.all(np.linalg.norm(goals, axis=1) <= 23.375 * UNIT + 1e-9)
    units = (arm.drawn(5000, 1) - box.centre) / box.half
    assert np.all(np.abs(units) < 1.02)
    assert np.all(np.abs(units).max(axis=0) > 0.95)
    np.testing.assert_array_equal(goals, arm.drawn(500, 0))
