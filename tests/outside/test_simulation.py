"""The arm in physics: its kinematics against the chain's, its sag against weights worked out here."""

from __future__ import annotations

import time
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle.failures import BadInput, ToddleError
from toddle.outside.simulation import PhysicsOptions, PhysicsPlant
from toddle.robots import Chain, load

WEIGHTLESS = {"noise": 0.0, "gravity": (0.0, 0.0, 0.0), "natural_frequency_hz": 30.0, "still": 1e-4}


def turn(x: float, y: float, z: float) -> np.ndarray:
    cos, sin = np.cos([x, y, z]), np.sin([x, y, z])
    about_x = [[1, 0, 0], [0, cos[0], -sin[0]], [0, sin[0], cos[0]]]
    about_y = [[cos[1], 0, sin[1]], [0, 1, 0], [-sin[1], 0, cos[1]]]
    about_z = [[cos[2], -sin[2], 0], [sin[2], cos[2], 0], [0, 0, 1]]
    return np.array(about_z) @ np.array(about_y) @ np.array(about_x)


def place(position: Any, angles: Any = (0.0, 0.0, 0.0)) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn(*angles), position
    return pose


def chain(before: Any, tip: Any, *, half: Any, slides: Any = None, gain: Any = None, offset: Any = None) -> Chain:
    """A chain with limits of plus or minus `half`; without a gain, every axis is a joint."""
    axes, half = len(before), np.asarray(half, float)

    def single(array: Any) -> jax.Array:
        return jnp.asarray(np.asarray(array, np.float32))

    return Chain(
        name="test arm",
        joints=tuple(f"joint{i}" for i in range(len(half))),
        lower=single(-half),
        upper=single(half),
        home=single(np.zeros(len(half))),
        before=single(before),
        slides=single(np.zeros(axes) if slides is None else slides),
        gain=single(np.eye(axes) if gain is None else gain),
        offset=single(np.zeros(axes) if offset is None else offset),
        tip=single(tip),
    )


def random_chain(seed: int, axes: int, *, mimic: bool = False) -> Chain:
    """Turning and sliding axes in any direction, some meeting in one point; a mimic axis if asked."""
    random = np.random.default_rng(seed)
    before = [
        place(random.normal(size=3) * 0.1 * (random.random() < 0.8), random.uniform(-3, 3, 3)) for _ in range(axes)
    ]
    slides = random.random(axes) < 0.3
    half = np.where(slides, 0.1, random.uniform(0.3, 2.0, axes))
    gain, offset = np.eye(axes), np.zeros(axes)
    if mimic:
        half, gain, offset[-1] = half[:-1], np.eye(axes)[:, :-1], 0.2
        gain[-1] = random.uniform(-1, 1, axes - 1)
    return chain(before, place(random.normal(size=3) * 0.1), half=half, slides=slides, gain=gain, offset=offset)


def forward(arm: Chain, q: np.ndarray) -> np.ndarray:
    return np.asarray(jax.vmap(lambda one: arm.forward(one))(jnp.asarray(q, jnp.float32)))


def postures(plant: PhysicsPlant, count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(plant.lower, plant.upper, (count, len(plant.joints)))


def nicu(**options: Any) -> PhysicsPlant:
    arm = load("nicu")
    assert isinstance(arm, Chain)
    return PhysicsPlant(arm, PhysicsOptions(**options))


def single_link(half: float = 1.0, **options: Any) -> PhysicsPlant:
    """A level link of 0.3 m along x with its hinge along -y: a positive angle lifts the tip."""
    lifted = place((0, 0, 0), (np.pi / 2, 0, 0))
    return PhysicsPlant(chain([lifted], place((0.3, 0, 0)), half=[half]), PhysicsOptions(**options))


@given(seed=st.integers(0, 10**6), axes=st.integers(2, 7), mimic=st.booleans())
def test_mujoco_and_the_chain_agree_on_where_the_tip_is(seed: int, axes: int, mimic: bool) -> None:
    arm = random_chain(seed, axes, mimic=mimic)
    plant = PhysicsPlant(arm, PhysicsOptions(noise=0.0))
    q = postures(plant, 8, seed)
    gain, offset = np.asarray(arm.gain, float), np.asarray(arm.offset, float)
    for joints, expected in zip(q, forward(arm, q), strict=True):
        plant.data.qpos[:] = gain @ joints + offset
        np.testing.assert_allclose(plant.tip, expected, atol=1e-6)


@pytest.mark.parametrize("name", ["nicu", "planar:5", "planar:20"])
def test_mujoco_and_the_catalogue_agree_on_where_the_tip_is(name: str) -> None:
    arm = load(name)
    assert isinstance(arm, Chain)
    plant = PhysicsPlant(arm)
    q = postures(plant, 20)
    for joints, expected in zip(q, forward(arm, q), strict=True):
        plant.data.qpos[:] = joints
        np.testing.assert_allclose(plant.tip, expected, atol=1e-6)


@pytest.mark.parametrize("mimic", [False, True])
def test_without_weight_the_arm_comes_to_rest_where_the_chain_says(mimic: bool) -> None:
    for seed in range(4):
        arm = random_chain(seed, 5, mimic=mimic)
        plant = PhysicsPlant(arm, PhysicsOptions(**WEIGHTLESS))
        q = postures(plant, 5)
        for joints, expected in zip(q, forward(arm, q), strict=True):
            np.testing.assert_allclose(plant.move(joints), expected, atol=1e-4)
            np.testing.assert_allclose(plant.observed_joints, joints, atol=1e-4)


def test_an_axis_without_travel_is_a_fixed_part_of_the_arm() -> None:
    bend = [place((0, 0, 0.1)), place((0.2, 0, 0)), place((0.2, 0, 0))]
    arm = chain(bend, place((0.2, 0, 0)), half=[1.0, 1.0], gain=[[1, 0], [0, 0], [0, 1]], offset=[0, 0.7, 0])
    plant = PhysicsPlant(arm, PhysicsOptions(**WEIGHTLESS))
    assert plant.model.nu == 2
    q = postures(plant, 5)
    for joints, expected in zip(q, forward(arm, q), strict=True):
        np.testing.assert_allclose(plant.move(joints), expected, atol=1e-4)


def test_a_single_link_sags_by_its_weight_over_its_stiffness() -> None:
    plant = single_link(noise=0.0, still=1e-5)
    stiffness = plant.model.actuator_gainprm[0, 0]
    # A uniform rod of 2 kg/m about its end: m l^2 / 3; its round caps change that by a few per cent.
    inertia = 0.6 * 0.3**2 / 3 + plant.options.armature
    assert stiffness == pytest.approx((2 * np.pi * 5) ** 2 * inertia, rel=0.1)
    for command in (-0.8, 0.0, 0.8):
        plant.move([command])
        angle = plant.observed_joints[0]
        # Rest: k (command - angle) = m g l/2 cos(angle), with m = 0.6 kg and l = 0.3 m.
        assert command - angle == pytest.approx(0.6 * 9.81 * 0.15 * np.cos(angle) / stiffness, rel=1e-3)


def test_an_arm_sags_by_the_slope_of_its_weight_over_its_stiffness() -> None:
    arm = load("nicu")
    assert isinstance(arm, Chain)
    plant = PhysicsPlant(arm, PhysicsOptions(noise=0.0, still=1e-5))
    before, tip = np.asarray(arm.before, float), np.asarray(arm.tip, float)

    def energy(q: np.ndarray) -> float:
        """Potential energy [J] of rods of 2 kg/m between the frames."""
        pose, total = np.eye(4), 0.0
        for i, angle in enumerate(q):
            pose = pose @ before[i] @ place((0, 0, 0), (0, 0, angle))
            end = (before[i + 1] if i + 1 < len(q) else tip)[:3, 3]
            middle = pose[:3, :3] @ end / 2 + pose[:3, 3]
            total += 9.81 * 2.0 * np.linalg.norm(end) * middle[2]
        return float(total)

    step = 1e-5 * np.eye(4)
    for command in 0.8 * postures(plant, 6):
        plant.move(command)
        q = plant.observed_joints
        slope = np.array([(energy(q + h) - energy(q - h)) / 2e-5 for h in step])
        sag = plant.model.actuator_gainprm[:, 0] * (command - q)
        np.testing.assert_allclose(sag, slope, atol=5e-3)
        assert np.abs(slope).max() > 0.1  # [N m]: there is something to see


def test_weight_across_the_plane_and_compensated_weight_do_not_sag() -> None:
    arm = load("planar:5")
    assert isinstance(arm, Chain)
    flat = PhysicsPlant(arm, PhysicsOptions(noise=0.0, still=1e-4))
    held = nicu(noise=0.0, still=1e-4, gravity_compensation=True)
    for plant in (flat, held):
        q = 0.8 * postures(plant, 1)[0]
        plant.move(q)
        np.testing.assert_allclose(plant.observed_joints, q, atol=1e-4)


def test_no_mode_of_the_servoed_arm_oscillates_or_is_slow() -> None:
    """The characteristic roots of M a = -K m - D v, in postures that the tuning did not look at."""
    plant = nicu()
    frequency = 2 * np.pi * plant.options.natural_frequency_hz
    stiffness, damping = plant.model.actuator_gainprm[:, 0], -plant.model.actuator_biasprm[:, 2]
    matrix, data = np.zeros((4, 4)), mujoco.MjData(plant.model)
    for posture in postures(plant, 30, seed=5):
        data.qpos[:] = posture
        mujoco.mj_fwdPosition(plant.model, data)
        mujoco.mj_fwdVelocity(plant.model, data)
        mujoco.mj_fullM(plant.model, data, matrix)
        inverse = np.linalg.inv(matrix)
        motion = np.block([[np.zeros((4, 4)), np.eye(4)], [-inverse @ np.diag(stiffness), -inverse @ np.diag(damping)]])
        roots = np.linalg.eigvals(motion)
        assert np.abs(roots.imag).max() < 0.01 * frequency
        assert roots.real.max() < -0.49 * frequency


def test_the_servos_can_hold_twice_the_weight_however_slow_the_movements() -> None:
    plant = nicu(sweep_s=100.0)
    data = mujoco.MjData(plant.model)
    for posture in postures(plant, 30, seed=5):
        data.qpos[:] = posture
        mujoco.mj_forward(plant.model, data)
        assert (plant.model.actuator_forcerange[:, 1] > 2 * np.abs(data.qfrc_bias)).all()


def test_a_movement_takes_its_share_of_a_sweep_and_the_time_to_settle() -> None:
    plant = single_link(half=1.0, sweep_s=2.0, settle_s=0.5)
    for start, end, share in ((-1.0, 1.0, 1.0), (1.0, 0.5, 0.25), (0.5, 0.5, 0.025)):
        plant.move([start])
        before = plant.seconds
        plant.move([end])
        assert 2.0 * share <= plant.seconds - before + 1e-9 <= 2.0 * share + 0.5


def test_the_sensor_has_the_noise_that_was_asked_for() -> None:
    plant = nicu(noise=0.005, seed=3)
    q = plant.home + 0.1
    plant.move(q)
    errors = np.array([plant.move(q) - plant.tip for _ in range(400)])
    # 1200 draws: the standard deviation is known to 1 / sqrt(2400) = 2 %, the mean to 0.005 / sqrt(1200).
    assert errors.std() == pytest.approx(0.005, rel=0.08)
    assert abs(errors.mean()) < 4 * 0.005 / np.sqrt(1200)
    assert not np.array_equal(nicu(seed=0).move(q), nicu(seed=1).move(q))


def test_a_command_beyond_the_limits_is_the_command_at_the_limits() -> None:
    far, near = nicu(), nicu()
    for q in 3 * postures(far, 4):
        np.testing.assert_array_equal(far.move(q), near.move(np.clip(q, near.lower, near.upper)))
    for corner in (far.lower, far.upper):
        far.move(corner)
        assert (far.observed_joints >= far.lower - 1e-3).all()
        assert (far.observed_joints <= far.upper + 1e-3).all()


def test_a_joint_pushed_against_its_limit_stays_there() -> None:
    plant = single_link(half=0.5)
    for push in (-1.0, 1.0):
        plant.data.ctrl[:] = 2 * push
        mujoco.mj_step(plant.model, plant.data, nstep=1000)
        assert plant.observed_joints[0] == pytest.approx(0.5 * push, abs=5e-3)


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_an_interrupted_run_goes_on_bit_for_bit(friction: float) -> None:
    plant = nicu(friction=friction)
    q = postures(plant, 6)
    for joints in q[:3]:
        plant.move(joints)
    kept, seconds = plant.state(), plant.seconds
    then = [plant.move(joints) for joints in q[3:]]
    other = nicu(friction=friction)
    other.restore(kept)
    assert (other.moves, other.seconds) == (3, seconds)
    np.testing.assert_array_equal([other.move(joints) for joints in q[3:]], then)
    assert (other.moves, other.seconds) == (plant.moves, plant.seconds)
    np.testing.assert_array_equal(other.observed_joints, plant.observed_joints)


def test_another_arms_state_is_refused() -> None:
    state = nicu().state()
    with pytest.raises(BadInput, match="test arm: the state's 'physics' is missing, or another arm's; restore it"):
        single_link().restore(state)
    with pytest.raises(BadInput, match="the state's 'random' is missing"):
        nicu().restore({name: state[name] for name in ("physics", "moves")})


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"noise": -1.0}, "physics option noise: -1.0 is no use; it must not be negative"),
        ({"sweep_s": 0.0}, "physics option sweep_s: 0.0 is no use; it must be above zero"),
        ({"gravity": (0.0, 0.0, float("nan"))}, "physics option gravity: .* it must be finite"),
        ({"natural_frequency_hz": 90.0}, "it must be at most 40 Hz"),
    ],
)
def test_options_that_cannot_be_simulated_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        PhysicsOptions(**options)


@pytest.mark.parametrize("q", [[0.1, 0.2], [float("nan")], [[0.1]], []])
def test_a_command_of_the_wrong_shape_is_refused_and_moves_nothing(q: Any) -> None:
    plant = single_link()
    with pytest.raises(BadInput, match=r"joint values .* cannot be moved to; give 1 finite numbers: joint0"):
        plant.move(q)
    with pytest.raises(BadInput, match="test arm: joint values must be numbers; give 1"):
        plant.move("up")
    assert plant.moves == 0


def test_arms_that_cannot_move_or_have_no_limits_are_refused() -> None:
    with pytest.raises(BadInput, match="no joint of the arm can move"):
        single_link(half=0.0)
    with pytest.raises(BadInput, match="not finite; give every joint finite limits"):
        single_link(half=np.inf)


def test_a_simulation_that_breaks_says_so(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its own log where it stands
    plant = single_link()
    plant.data.qvel[:] = np.nan
    with pytest.raises(ToddleError, match="test arm: the simulation became unstable in movement 1; lower"):
        plant.move([0.1])


def test_the_rate_of_movements_is_told() -> None:
    plant = nicu()
    start = time.perf_counter()
    for q in postures(plant, 50):
        plant.move(q)
    print(f"{50 / (time.perf_counter() - start):.0f} movements/s, {plant.seconds / 50:.2f} s simulated each")
    assert plant.moves == 50
    assert plant.seconds > 50 * 0.05
