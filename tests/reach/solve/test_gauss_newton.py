import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import toddle
from toddle.failures import BadInput
from toddle.reach.model.multilinear import fit_multilinear
from toddle.reach.model.rigid import Rigid
from toddle.reach.solve.gauss_newton import descend, freedom, solve_model
from toddle.robots.chain import Chain
from toddle.robots.linkage import linkage_of, poses
from toddle.signals import Experience


def arm(name="planar:4", count=300):
    body = toddle.load(name)
    assert isinstance(body, Chain)
    linkage, rng = linkage_of(body), np.random.default_rng(0)
    lower, upper = np.asarray(body.lower, float), np.asarray(body.upper, float)
    model = Rigid(linkage, 1e-10 * np.eye(7 * len(linkage.slides) + 6), (0, 1, 2)[: body.space])
    q = rng.uniform(lower, upper, (count, len(lower)))
    return model, lower, upper, (q, model.forward(q)), model.forward(rng.uniform(lower, upper, (100, len(lower))))


@pytest.mark.parametrize("name", ["planar:4", "nicu", "scara"])
def test_reachable_targets_are_reached_within_the_limits(name):
    model, lower, upper, memory, targets = arm(name)
    answers = solve_model(model, targets, lower, upper, memory=memory)
    assert answers.solved.mean() >= 0.98
    assert (answers.q >= lower).all()
    assert (answers.q <= upper).all()
    np.testing.assert_allclose(answers.distance, np.linalg.norm(model.forward(answers.q) - targets, axis=1), atol=1e-12)
    np.testing.assert_array_equal(answers.held, (answers.q <= lower) | (answers.q >= upper))


def test_any_model_is_solved():
    model, lower, upper, memory, targets = arm("nicu")
    learned = fit_multilinear(Experience(*memory), lower, upper).model
    answers = solve_model(learned, targets, lower, upper, memory=memory)
    assert np.linalg.norm(model.forward(answers.q[answers.solved]) - targets[answers.solved], axis=1).max() < 2e-4


def test_what_is_out_of_reach_ends_as_near_as_least_squares_finds():
    model, lower, upper, memory, _ = arm("nicu")
    targets = memory[1].mean(0) + 2.0 * np.eye(3)
    answers = solve_model(model, targets, lower, upper, memory=memory, starts=12, iterations=100)
    assert not answers.solved.any()
    for target, distance in zip(targets, answers.distance, strict=True):
        runs = [
            least_squares(lambda q, t=target: model.forward(q[None])[0] - t, q, bounds=(lower, upper)).cost
            for q in memory[0][:12]
        ]
        assert distance < np.sqrt(2 * min(runs)) + 2e-3


def test_orientations_are_met():
    model, lower, upper, memory, _ = arm("planar:4")
    rng = np.random.default_rng(3)
    wanted = model.pose(rng.uniform(lower, upper, (40, 4)))
    full = Rigid(model.linkage, model.covariance, (0, 1, 2))
    q = memory[0]
    answers = solve_model(
        full, wanted[:, :3, 3], lower, upper, memory=(q, full.forward(q)), turns=wanted[:, :3, :3], starts=10
    )
    assert answers.solved.mean() > 0.9
    pose = poses(model.linkage, answers.q)
    off = Rotation.from_matrix(wanted[:, :3, :3] @ pose[:, :3, :3].transpose(0, 2, 1)).magnitude()
    np.testing.assert_allclose(answers.angle, off, atol=1e-9)


def test_an_orientation_needs_a_model_that_knows_one():
    _, lower, upper, memory, targets = arm("nicu")
    learned = fit_multilinear(Experience(*memory), lower, upper).model
    with pytest.raises(BadInput, match="orientation"):
        solve_model(learned, targets[:1], lower, upper, memory=memory, turns=np.eye(3)[None])


def test_redundancy_is_a_choice():
    model, lower, upper, memory, targets = arm("planar:4")
    here = memory[0][0]
    span, middle = upper - lower, (upper + lower) / 2
    free = solve_model(model, targets, lower, upper, memory=memory)
    near = solve_model(model, targets, lower, upper, memory=memory, near=here)
    central = solve_model(model, targets, lower, upper, memory=memory, central=True)
    assert near.solved.mean() > 0.98
    assert np.mean(((near.q - here) / span) ** 2) < 0.7 * np.mean(((free.q - here) / span) ** 2)
    assert np.mean(((central.q - middle) / span) ** 2) < np.mean(((free.q - middle) / span) ** 2)


def test_of_several_postures_the_freest_is_taken():
    model, lower, upper, memory, targets = arm("planar:4")
    one, many = (solve_model(model, targets, lower, upper, memory=memory, starts=starts) for starts in (1, 8))
    merit = [
        freedom(model.slope(each.q)[1], each.q, lower, upper)
        / (1e-6 + np.sqrt(np.trace(model.spread(each.q), axis1=1, axis2=2)))
        for each in (one, many)
    ]
    assert (merit[1] >= merit[0] * (1 - 1e-3))[one.solved].all()
    assert np.median(merit[1]) > 1.2 * np.median(merit[0])


def test_a_joint_at_its_limit_leaves_the_way_to_the_others():
    # two joints that add up: the first one starts at its limit, and plain clipping would stop there
    def miss(rows, q):
        return 1.5 - q.sum(1, keepdims=True), np.ones((len(q), 1, 2)) * np.array([10.0, 1.0])

    found = descend(miss, np.array([[1.0, 0.0]]), np.zeros(2), np.ones(2), iterations=50)
    np.testing.assert_allclose(found.q, [[1.0, 0.5]], atol=1e-5)


def test_rows_are_solved_as_if_alone():
    model, lower, upper, memory, targets = arm("planar:4")
    together = solve_model(model, targets[:6], lower, upper, memory=memory)
    alone = [solve_model(model, target[None], lower, upper, memory=memory).q[0] for target in targets[:6]]
    np.testing.assert_allclose(together.q, alone, atol=1e-6)
