import jax.numpy as jnp
import numpy as np
import pytest

import toddle
from toddle.failures import BadInput
from toddle.robots.body import Plant, Resumable
from toddle.robots.chain import Chain
from toddle.robots.damage import Damage, parse_damage
from toddle.robots.damaged import DamagedPlant
from toddle.robots.linkage import linkage_of, poses


@pytest.fixture
def nicu():
    return toddle.load("nicu")


def true_tip(body, q):
    return poses(linkage_of(body), np.asarray(q, float)[None])[0, :3, 3]


def linkage_now(plant):
    linkage = plant.actual(plant.home[None])[1]
    assert linkage is not None
    return linkage


def made(plant, count=6, seed=0):
    """Random movements and what was seen."""
    q = np.random.default_rng(seed).uniform(plant.lower, plant.upper, (count, len(plant.joints)))
    return q, np.array([plant.move(row) for row in q])


@pytest.mark.parametrize(
    ("text", "damage"),
    [
        ("lock:elbow@500", Damage("lock", "elbow", 0.0, 500)),
        ("slip:elbow=0.2@500", Damage("slip", "elbow", 0.2, 500)),
        ("slip:elbow=-10deg@500", Damage("slip", "elbow", -np.pi / 18, 500, "rad")),
        ("weaken:elbow=0.5@7", Damage("weaken", "elbow", 0.5, 7)),
        ("bend:fore arm=5cm@1", Damage("bend", "fore arm", 0.05, 1, "m")),
        ("replace:elbow=+80mm@2", Damage("replace", "elbow", 0.08, 2, "m")),
    ],
)
def test_damage_is_read_as_it_is_written(text, damage):
    read = parse_damage(text)
    assert read._replace(amount=0.0) == damage._replace(amount=0.0)
    assert read.amount == pytest.approx(damage.amount)
    assert parse_damage(str(read)).amount == pytest.approx(read.amount, rel=1e-5)


@pytest.mark.parametrize(
    "text",
    [
        *("", "lock", "lock:elbow", "lock:elbow@0", "lock:elbow=1@5", "lock:elbow@-3", "melt:elbow@5"),
        *("slip:elbow@5", "slip:elbow=far@5", "slip:elbow=3stone@5", "slip:elbow=0@5", "slip:elbow=nan@5"),
        *("weaken:elbow=1.5@5", "weaken:elbow=20deg@5", "bend:elbow=3deg@5", "bend:elbow=20m@5", "replace:elbow=0@5"),
    ],
)
def test_what_is_no_damage_is_refused_in_one_line(text):
    with pytest.raises(BadInput) as refused:
        parse_damage(text)
    assert "\n" not in refused.value.line
    assert refused.value.remedy


@pytest.mark.parametrize(
    "text", ["lock:knee@5", "lock:shoulder@5", "slip:elbow=2cm@5", "replace:elbow_y=-2m@5", "lock:nowhere@1"]
)
def test_a_part_that_this_body_lacks_is_refused(nicu, text):
    with pytest.raises(BadInput):
        DamagedPlant(nicu, [parse_damage(text)])


def test_a_soft_arm_has_no_links_to_bend():
    with pytest.raises(BadInput, match="no rigid links"):
        DamagedPlant(toddle.load("bha"), [parse_damage("bend:segment_1_length_1=5cm@3")])


def test_before_its_damage_it_is_the_body(nicu):
    plant = DamagedPlant(nicu, [parse_damage("bend:elbow=5cm@100")])
    assert isinstance(plant, Plant)
    assert isinstance(plant, Resumable)
    for row, x in zip(*made(plant), strict=True):
        np.testing.assert_allclose(x, np.asarray(nicu.forward(jnp.asarray(row, jnp.float32))), atol=1e-5)


def test_a_locked_joint_stays_where_it_stood(nicu):
    plant = DamagedPlant(nicu, [parse_damage("lock:elbow@3")])
    q, x = made(plant)
    held = q.copy()
    held[2:, 3] = q[1, 3]
    np.testing.assert_allclose(x, [true_tip(nicu, row) for row in held], atol=1e-12)


def test_a_weak_joint_moves_half_as_far_and_a_slip_adds(nicu):
    plant = DamagedPlant(nicu, [parse_damage("weaken:arm_x=0.5@2"), parse_damage("slip:arm_x=0.2@4")])
    q, x = made(plant)
    held = q.copy()
    held[1:, 2] = q[0, 2] + 0.5 * (q[1:, 2] - q[0, 2])
    held[3:, 2] += 0.2
    np.testing.assert_allclose(x, [true_tip(nicu, row) for row in held], atol=1e-12)


@pytest.mark.parametrize("name", ["nicu", "planar:4"])
def test_a_bent_link_has_its_far_end_aside_by_the_amount(name):
    body = toddle.load(name)
    assert isinstance(body, Chain)
    plant = DamagedPlant(body, [Damage("bend", body.joints[1], 0.05, 1)], seed=4)
    linkage = linkage_of(body)
    np.testing.assert_array_equal(linkage_now(plant).before, linkage.before)
    plant.move(plant.home)
    bent = linkage_now(plant)
    away = bent.before[2, :3, 3] - linkage.before[2, :3, 3]
    assert np.linalg.norm(away) == pytest.approx(0.05)
    assert abs(away @ linkage.before[2, :3, 3]) < 1e-9
    np.testing.assert_allclose(bent.before[2, :3, :3] @ bent.before[2, :3, :3].T, np.eye(3), atol=1e-7)
    np.testing.assert_array_equal(np.delete(bent.before, 2, 0), np.delete(linkage.before, 2, 0))
    if name == "planar:4":
        assert away[2] == 0
        np.testing.assert_allclose(bent.before[2, 2, :3], [0, 0, 1], atol=1e-9)


def test_another_link_is_as_much_longer(nicu):
    plant = DamagedPlant(nicu, [parse_damage("replace:forearm=+8cm@1")], links={"forearm": "elbow_y"})
    plant.move(plant.home)
    longer, linkage = linkage_now(plant), linkage_of(nicu)
    assert np.linalg.norm(longer.tip[:3, 3]) - np.linalg.norm(linkage.tip[:3, 3]) == pytest.approx(0.08)


def test_a_soft_arm_loses_an_actuator():
    body = toddle.load("bha")
    plant = DamagedPlant(body, [parse_damage("lock:segment_1_length_2@2")])
    q, x = made(plant, 3)
    q[1:, 1] = q[0, 1]
    for row, tip in zip(q, x, strict=True):
        np.testing.assert_allclose(tip, np.asarray(body.forward(jnp.asarray(row, jnp.float32))), atol=1e-6)


def test_noise_has_its_size_and_the_pose_its_own(nicu):
    plant = DamagedPlant(nicu, [], noise=2e-3, angle_noise=5e-3, seed=1)
    seen = [plant.move_pose(plant.home) for _ in range(400)]
    away = np.array([x for x, _ in seen]) - true_tip(nicu, plant.home)
    assert away.std() == pytest.approx(2e-3, rel=0.1)
    turn = poses(linkage_of(nicu), plant.home[None])[0, :3, :3]
    angles = [np.arccos(np.clip((np.trace(r @ turn.T) - 1) / 2, -1, 1)) for _, r in seen]
    assert np.sqrt(np.mean(np.square(angles)) / 3) == pytest.approx(5e-3, rel=0.1)


def test_an_interrupted_run_goes_on_bit_for_bit(nicu):
    damages = [parse_damage("lock:elbow@3"), parse_damage("bend:arm_x=3cm@5")]
    whole, first, second = (DamagedPlant(nicu, damages, noise=1e-3, seed=2) for _ in range(3))
    q = np.random.default_rng(0).uniform(whole.lower, whole.upper, (8, 4))
    expected = [whole.move(row) for row in q]
    for row in q[:4]:
        first.move(row)
    second.restore(first.state())
    np.testing.assert_array_equal([second.move(row) for row in q[4:]], expected[4:])
