import numpy as np
import pytest
from scipy.optimize import minimize

import toddle
from toddle.reach.model.damage_hypotheses import joint_family, link_family
from toddle.reach.model.damage_repair import repair, telling_movement
from toddle.reach.model.rigid import Rigid, changed
from toddle.robots.chain import Chain
from toddle.robots.damage import Damage
from toddle.robots.damaged import DamagedPlant
from toddle.robots.linkage import linkage_of, poses
from toddle.signals import Experience

SENSOR = 1e-3


class Case:
    """A learned arm, the same arm broken, and the movements since."""

    def __init__(self, name, damage, count, *, seed=0, orientation=False):
        body = toddle.load(name)
        assert isinstance(body, Chain)
        rng = np.random.default_rng(seed)
        linkage = linkage_of(body)
        numbers = 7 * len(linkage.slides) + 6
        self.model = Rigid(linkage, 2e-4**2 * np.eye(numbers), tuple(body.coordinates))
        plant = DamagedPlant(body, [damage], noise=SENSOR, angle_noise=5e-3, seed=seed)
        self.lower, self.upper = plant.lower, plant.upper
        q = rng.uniform(plant.lower, plant.upper, (count + 1, len(plant.joints)))
        self.stood = q[0]
        plant.move(q[0])
        looks = [plant.move_pose(row) for row in q[1:]]
        turn = np.array([r for _, r in looks]) if orientation else None
        self.since = Experience(q[1:], np.array([x for x, _ in looks]), turn)
        self.plant, self.fresh = plant, rng.uniform(plant.lower, plant.upper, (300, len(plant.joints)))

    def repaired(self, **options):
        return repair(self.model, self.since, self.lower, self.upper, SENSOR, stood=self.stood, **options)

    def error(self, model):
        """Mean distance between where the broken arm goes and where the model puts it [m]."""
        actual, linkage = self.plant.actual(self.fresh)
        assert linkage is not None
        truth = poses(linkage, actual)[:, self.model.coordinates, 3]
        return np.linalg.norm(truth - model.forward(self.fresh), axis=1).mean()


@pytest.mark.parametrize(
    ("name", "damage", "count"),
    [
        ("nicu", Damage("lock", "elbow_y", 0.0, 2), 4),
        ("nicu", Damage("slip", "shoulder_y", 0.2, 2), 4),
        ("nicu", Damage("weaken", "shoulder_z", 0.5, 2), 4),
        ("nicu", Damage("bend", "arm_x", 0.05, 2), 8),
        ("nicu", Damage("replace", "arm_x", 0.08, 2), 4),
        ("planar:6", Damage("lock", "joint_2", 0.0, 2), 4),
        ("planar:6", Damage("slip", "joint_4", 0.2, 2), 4),
        ("scara", Damage("slip", "d_4", 0.05, 2), 4),
        ("scara", Damage("lock", "theta_2", 0.0, 2), 4),
        ("suralp", Damage("bend", "shoulder_x", 0.05, 2), 8),
    ],
)
def test_the_cause_is_named_and_the_arm_known_again(name, damage, count):
    case = Case(name, damage, count)
    found = case.repaired()[0]
    assert case.error(case.model) > 5e-3
    assert case.error(found.model) < 2e-3
    assert (found.kind, case.plant.joints[found.joint]) == (damage.kind, damage.part)
    assert found.sureness > 0.5
    assert found.free.sum() == len(found.free) - (damage.kind == "lock")
    if damage.kind not in ("lock", "bend"):
        assert found.amount == pytest.approx(damage.amount, abs=0.02)
    if damage.kind == "lock":
        joint = case.plant.joints.index(damage.part)
        assert not found.free[joint]
        assert not found.model.linkage.gain[:, joint].any()
        assert found.amount == pytest.approx(case.stood[joint], abs=0.02)


def test_an_arm_that_is_as_it_was_is_left_alone():
    case = Case("nicu", Damage("slip", "elbow_y", 0.2, 99), 5)
    found = case.repaired()[0]
    assert found.kind == "nothing"
    assert found.joint == -1
    assert found.model is case.model


def test_one_wild_look_among_them_is_left_out():
    case = Case("nicu", Damage("bend", "arm_x", 0.05, 2), 7)
    clean = case.repaired()[0]
    case.since.x[4] += np.array([0.3, -0.5, 0.2])
    found = case.repaired()[0]
    assert (found.kind, found.joint) == (clean.kind, clean.joint)
    assert case.error(found.model) < 2e-3


def test_surenesses_are_probabilities_the_likeliest_first():
    found = Case("nicu", Damage("bend", "arm_x", 0.05, 2), 1).repaired()
    sureness = [each.sureness for each in found]
    assert sureness == sorted(sureness, reverse=True)
    assert 0.9 < sum(sureness) < 1 + 1e-9


def test_orientation_tells_a_bend_from_fewer_movements():
    damage = Damage("bend", "arm_x", 0.05, 2)
    errors = [[Case("nicu", damage, 2, seed=s, orientation=o) for s in range(6)] for o in (False, True)]
    without, with_turn = (np.median([c.error(c.repaired(angle_sensor=5e-3)[0].model) for c in row]) for row in errors)
    assert with_turn < 0.5 * without
    assert with_turn < 4e-3


def test_the_slopes_of_the_hypotheses_agree_with_differences():
    body = toddle.load("scara")
    assert isinstance(body, Chain)
    linkage, rng = linkage_of(body), np.random.default_rng(0)
    lower, upper = np.asarray(body.lower, float), np.asarray(body.upper, float)
    q = rng.uniform(lower, upper, (3, 4))
    for family in (joint_family(linkage, q, lower, upper, None), link_family(linkage, q)):
        numbers = family.mean + 0.3 * rng.normal(size=family.mean.shape)
        pose, slope = family.predict(numbers)
        for k in range(numbers.shape[1]):
            step = 1e-6 * np.eye(numbers.shape[1])[k]
            near, far = family.predict(numbers - step)[0], family.predict(numbers + step)[0]
            np.testing.assert_allclose(slope[:, :, :3, k], (far - near)[..., :3, 3] / 2e-6, atol=1e-6)
            spin = (far - near)[..., :3, :3] @ np.swapaxes(pose[..., :3, :3], -1, -2) / 2e-6
            turn = np.stack([spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]], -1)
            np.testing.assert_allclose(slope[:, :, 3:, k], turn, atol=1e-6)


def test_a_link_hypothesis_is_the_step_of_the_numbers_of_a_rigid_arm():
    body = toddle.load("suralp")
    assert isinstance(body, Chain)
    linkage, rng = linkage_of(body), np.random.default_rng(1)
    q = rng.uniform(-1, 1, (3, 4))
    family = link_family(linkage, q)
    for case, (kind, axis) in enumerate(zip(family.kinds, family.axes, strict=True)):
        if kind == "bend":
            numbers = np.zeros((len(family.kinds), 6))
            numbers[case] = twist = 0.2 * rng.normal(size=6)
            step = np.zeros(34)
            step[7 * (axis + 1) : 7 * (axis + 1) + 6] = twist
            expected = poses(changed(linkage, step), q)
            np.testing.assert_allclose(family.predict(numbers)[0][case], expected, atol=1e-12)


def test_a_slip_is_what_a_second_optimiser_finds():
    case = Case("nicu", Damage("slip", "arm_x", 0.2, 2), 3)
    found = case.repaired()[0]
    spread = case.model.spread(case.since.q) + SENSOR**2 * np.eye(3)

    def cost(slip):
        miss = case.since.x - case.model.forward(case.since.q + np.array([0, 0, slip[0], 0]))
        return np.einsum("mi,mij,mj", miss, np.linalg.inv(spread), miss) + (slip[0] / 0.3) ** 2

    assert found.amount == pytest.approx(minimize(cost, [0.1]).x[0], abs=1e-4)


def test_the_repaired_arm_is_as_unsure_as_it_is_wrong():
    ratios = []
    for seed in range(8):
        case = Case("nicu", Damage("bend", "arm_x", 0.05, 2), 5, seed=seed)
        model = case.repaired()[0].model
        said = np.sqrt(np.trace(model.spread(case.fresh), axis1=1, axis2=2).mean())
        ratios.append(case.error(model) / said)
    assert 0.4 < np.median(ratios) < 1.3


def test_a_telling_movement_tells_more_than_a_random_one():
    told, random = [], []
    for seed in range(8):
        case = Case("nicu", Damage("bend", "arm_x", 0.05, 2), 1, seed=seed)
        choice = telling_movement(case.repaired(), case.fresh, SENSOR)
        for q, errors in ((case.fresh[choice], told), (case.fresh[0], random)):
            since = Experience(np.vstack([case.since.q, q]), np.vstack([case.since.x, case.plant.move(q)]))
            errors.append(case.error(repair(case.model, since, case.lower, case.upper, SENSOR)[0].model))
    assert np.mean(told) < np.mean(random)
