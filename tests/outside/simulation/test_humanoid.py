"""A humanoid in physics: truth against mechanics, senses against truth, the world against what was asked."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest
from box_biped import biped, biped_home, swaying

from toddle.failures import BadInput
from toddle.outside.simulation.disturbances import Noise, WorldOptions
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.robots.humanoid import Humanoid
from toddle.signals import Circle

HOME = biped_home()


@pytest.fixture(scope="module")
def robot() -> Humanoid:
    return biped()


def stood(robot: Humanoid, ticks: int = 60, **options: object) -> HumanoidSimulation:
    simulation = HumanoidSimulation(robot, WorldOptions(**options))  # type: ignore[arg-type]
    for _ in range(ticks):
        simulation.tick(HOME)
    return simulation


def thrown(robot: Humanoid, yaw: float = 0.0, **options: object) -> HumanoidSimulation:
    """In the air, far over the floor."""
    simulation = HumanoidSimulation(robot, WorldOptions(**options))  # type: ignore[arg-type]
    q = robot.home.copy()
    q[2], q[3], q[6] = 5.0, math.cos(yaw / 2), math.sin(yaw / 2)
    simulation.reset(q)
    return simulation


def contact_zmp(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[np.ndarray, float]:
    """Moment of all contact points, and the load, straight from MuJoCo's contacts with the floor."""
    moment, load, local = np.zeros(2), 0.0, np.zeros(6)
    for number in range(data.ncon):
        mujoco.mj_contactForce(model, data, number, local)
        force = local[:3] @ data.contact[number].frame.reshape(3, 3)
        moment += data.contact[number].pos[:2] * force[2]
        load += force[2]
    return moment, load


def test_it_stands_and_its_soles_carry_its_weight(robot: Humanoid) -> None:
    simulation = stood(robot, 200)
    truth, felt = simulation.truth(), simulation.tick(HOME)
    weight = 9.81 * robot.mass
    assert not truth.fallen
    assert truth.load.sum() == pytest.approx(weight, rel=1e-3)
    assert felt.wrenches[:, 2].sum() == pytest.approx(weight, rel=1e-3)
    np.testing.assert_allclose(truth.zmp, truth.com[:2], atol=5e-4)
    np.testing.assert_allclose(truth.soles[:, 1], [0.07, -0.07], atol=1e-3)
    np.testing.assert_allclose(felt.joints, truth.q[7:], atol=1e-6)
    np.testing.assert_allclose(felt.acceleration, [0, 0, 9.81], atol=0.05)
    np.testing.assert_allclose(felt.place, truth.waist, atol=1e-6)


def test_the_true_zmp_is_that_of_the_contacts_over_the_tick(robot: Humanoid) -> None:
    simulation = stood(robot, 0)
    for tick in range(150):
        simulation.tick(swaying(0.01 * tick))
    data, servo = mujoco.MjData(simulation.model), swaying(1.5)
    mujoco.mj_copyData(data, simulation.model, simulation.data)
    data.ctrl[:] = servo
    moment, load = np.zeros(2), 0.0
    for _ in range(5):
        mujoco.mj_step(simulation.model, data)
        step = contact_zmp(simulation.model, data)
        moment, load = moment + step[0], load + step[1]
    simulation.tick(servo)
    truth = simulation.truth()
    # the floor gives way by a fraction of a millimetre: contacts are not exactly at z = 0
    np.testing.assert_allclose(truth.zmp, moment / load, atol=1e-4)
    assert truth.load.sum() == pytest.approx(load / 5, rel=1e-9)


@pytest.mark.parametrize(("start", "yaw", "direction"), [(0.0, 0.0, 0.0), (0.034, 1.0, math.pi / 2)])
def test_a_push_in_the_air_gives_its_impulse(robot: Humanoid, start: float, yaw: float, direction: float) -> None:
    simulation = thrown(robot, yaw)
    simulation.push(8.0, direction, start, 0.1)
    for _ in range(20):
        simulation.tick(HOME)
    expected = 8.0 / robot.mass * np.array([math.cos(yaw + direction), math.sin(yaw + direction)])
    velocity = simulation.truth().com_velocity
    np.testing.assert_allclose(velocity[:2], expected, atol=2e-3)
    assert velocity[2] == pytest.approx(-9.81 * 0.2, rel=1e-3)
    assert math.isnan(simulation.truth().zmp[0])


def test_late_senses_are_those_of_before(robot: Humanoid) -> None:
    early, late = stood(robot, 0), stood(robot, 0, delay_s=0.02)
    told = [early.tick(swaying(0.01 * tick)) for tick in range(20)]
    then = [late.tick(swaying(0.01 * tick)) for tick in range(20)]
    for one, other in zip(told, then[2:], strict=False):
        assert one.t == other.t
        np.testing.assert_array_equal(one.joints, other.joints)
        np.testing.assert_array_equal(one.wrenches, other.wrenches)


def test_servos_lag_exponentially(robot: Humanoid) -> None:
    simulation = thrown(robot, lag_s=0.02)
    for _ in range(3):
        simulation.tick(HOME + 0.1)
    np.testing.assert_allclose(simulation.data.act - HOME, 0.1 * (1 - math.exp(-0.03 / 0.02)), rtol=1e-6)


def test_a_seed_repeats_everything_and_another_does_not(robot: Humanoid) -> None:
    def told(seed: int) -> np.ndarray:
        options = WorldOptions(noise=Noise(), bias=Noise(), mass_error=0.1, bumps=5, seed=seed)
        simulation = HumanoidSimulation(robot, options)
        first = [simulation.tick(HOME) for _ in range(10)][-1]
        simulation.reset()
        again = [simulation.tick(HOME) for _ in range(10)][-1]
        for one, other in zip(first, again, strict=True):
            np.testing.assert_array_equal(one, other)
        return np.concatenate([first.joints, first.wrenches.ravel(), simulation.model.body_mass])

    np.testing.assert_array_equal(told(3), told(3))
    assert not np.isclose(told(3), told(4)).any(where=told(3) != 0)


def test_noise_has_the_deviations_that_were_asked_for(robot: Humanoid) -> None:
    exact, noisy = stood(robot), stood(robot, noise=Noise(encoder=0.01, force=2.0, orientation=0.02))
    truly = exact.tick(HOME)
    felt = [noisy.tick(HOME) for _ in range(300)]
    joints = np.array([one.joints for one in felt]) - truly.joints
    forces = np.array([one.wrenches[:, :3] for one in felt]) - truly.wrenches[:, :3]
    turns = np.array([one.orientation[1:] for one in felt]) - truly.orientation[1:]
    assert np.std(joints) == pytest.approx(0.01, rel=0.06)
    assert np.std(forces) == pytest.approx(2.0, rel=0.1)
    assert 2 * np.std(turns) == pytest.approx(0.02, rel=0.1)


def test_the_inertial_unit_shows_a_tilted_floor(robot: Humanoid) -> None:
    felt = HumanoidSimulation(robot, WorldOptions(tilt_deg=2.0, downhill_deg=90.0)).reset()
    # downhill is to the left: the robot leans left, which is a negative turn about x
    np.testing.assert_allclose(2 * felt.orientation[1:], [-math.radians(2.0), 0, 0], atol=1e-4)


@pytest.mark.parametrize(("downhill", "direction"), [(0.0, (1, 0)), (90.0, (0, 1))])
def test_it_slides_downhill_where_friction_is_too_small(
    robot: Humanoid, downhill: float, direction: tuple[int, int]
) -> None:
    firm = stood(robot, 40, tilt_deg=5.0, downhill_deg=downhill, friction=0.4).truth()
    loose = stood(robot, 40, tilt_deg=5.0, downhill_deg=downhill, friction=0.02).truth()
    # the slope's own law: (sin a - mu cos a) g t^2 / 2
    slope = math.radians(5.0)
    slid = 0.5 * 9.81 * (math.sin(slope) - 0.02 * math.cos(slope)) * 0.4**2
    moved = (loose.soles[:, :2].mean(axis=0) - firm.soles[:, :2].mean(axis=0)) @ np.array(direction)
    assert moved == pytest.approx(slid, rel=0.2)


def test_obstacles_are_near_touched_and_solid(robot: Humanoid) -> None:
    # the left sole's toe is at x = 0.13; a cylinder before it leaves 2 cm
    near = stood(robot, 0, circles=(Circle(0.25, 0.07, 0.1),))
    assert near.truth().clearance[0] == pytest.approx(0.02, abs=1e-3)
    assert not near.truth().touching.any()
    inside = stood(robot, 1, circles=(Circle(0.22, 0.07, 0.1),))
    assert inside.truth().touching.tolist() == [True, False, False]
    assert inside.touched.tolist() == [True, False, False]
    trunk = thrown(robot, circles=(Circle(0.16, 0.0, 0.1),))
    assert trunk.truth().clearance[2] == 1.0  # the cylinder ends far below
    assert HumanoidSimulation(robot).truth().clearance.tolist() == [1.0, 1.0, 1.0]


def test_what_an_obstacle_weighs_is_not_the_robots(robot: Humanoid) -> None:
    alone = stood(robot, 3).truth()
    together = stood(robot, 3, circles=(Circle(3.0, 0.0, 0.5),)).truth()
    np.testing.assert_allclose(together.com, alone.com, atol=1e-9)


def test_bumps_lie_within_reach_but_not_under_the_first_stance(robot: Humanoid) -> None:
    model = stood(robot, 0, bumps=50, bump_reach=1.5, bump_height=0.005).model
    bumps = [model.geom(f"bump{number}") for number in range(50)]
    away = np.array([math.hypot(*bump.pos[:2]) for bump in bumps])
    assert (away > 0.3 + 0.06).all()
    assert (away <= 1.5).all()
    assert all(bump.pos[2] + bump.size[2] == pytest.approx(0.005) for bump in bumps)


def test_masses_are_off_by_no_more_than_was_asked_for(robot: Humanoid) -> None:
    model = stood(robot, 0, mass_error=0.1, seed=5).model
    scale = model.body_mass[1:] / robot.tree.mass
    assert ((scale >= 0.9) & (scale <= 1.1)).all()
    assert np.std(scale) > 0.02
    assert model.body_subtreemass[0] == pytest.approx(model.body_mass.sum())


def test_lying_is_fallen_and_reset_stands_again(robot: Humanoid) -> None:
    simulation = HumanoidSimulation(robot)
    simulation.push(60.0, 0.0)
    for _ in range(150):
        simulation.tick(HOME)
    assert simulation.truth().fallen
    simulation.reset()
    assert not simulation.truth().fallen


@pytest.mark.parametrize(
    ("options", "line"),
    [
        ({"friction": math.nan}, "world, friction: nan is no use; give a number from 0.01 to 10"),
        ({"delay_s": 0.015}, "world, delay_s: 0.015 is no multiple of 0.01 s; round it"),
        ({"mass_error": -0.1}, "world, mass_error: -0.1 is no use; give a number from 0 to 0.9"),
        ({"circles": (Circle(0.0, math.inf, 0.1),)}, "world, circles, 0: y: inf is no use; give a finite number"),
    ],
)
def test_a_world_that_cannot_be_is_refused(options: dict[str, object], line: str) -> None:
    with pytest.raises(BadInput) as refused:
        WorldOptions(**options)  # type: ignore[arg-type]
    assert refused.value.line == line


def test_what_is_no_command_is_refused(robot: Humanoid) -> None:
    simulation = HumanoidSimulation(robot)
    for servo in (HOME[1:], np.full(10, math.nan)):
        with pytest.raises(BadInput, match="give 10 finite numbers"):
            simulation.tick(servo)
    with pytest.raises(BadInput, match="give 17 finite numbers"):
        simulation.reset(HOME)
    with pytest.raises(BadInput, match="is no push"):
        simulation.push(math.inf, 0.0)


def test_a_description_without_a_sole_is_refused(robot: Humanoid) -> None:
    bare = biped()
    bare.spec.delete(bare.spec.geom("left_sole"))
    with pytest.raises(BadInput, match=r"biped: there is no geom left_sole"):
        HumanoidSimulation(bare)
