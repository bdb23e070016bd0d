"""Every humanoid of the catalogue keeps the contract, has all its mass, moves as MuJoCo moves it, and stands."""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

from toddle.failures import BadInput
from toddle.robots.catalogue import HUMANOIDS
from toddle.robots.humanoid import Frame, Humanoid
from toddle.robots.humanoids import load_humanoid
from toddle.signals import Velocity

NAMED = ("heicub", "icub", "talos", "g1")
SITES = ("left_sole", "right_sole", "waist", "chest", "imu")


@cache
def robot(name: str) -> Humanoid:
    return load_humanoid(name)


@cache
def compiled(name: str) -> mujoco.MjModel:
    spec = robot(name).spec.copy()
    spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0.0, 0.0, 0.1])
    return spec.compile()


def at(name: str, q: np.ndarray) -> mujoco.MjData:
    data = mujoco.MjData(compiled(name))
    data.qpos[:] = q
    mujoco.mj_forward(compiled(name), data)
    return data


def turn(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rodrigues' rotation."""
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def bodies(human: Humanoid, q: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Forward kinematics written for this test alone: every body's position and rotation."""
    w, x, y, z = q[3:7]
    base = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    places, turns = [q[:3]], [base]
    tree = human.tree
    for body in range(1, len(tree.parent)):
        parent = tree.parent[body]
        rotation = turns[parent] @ tree.rotation[body]
        position = places[parent] + turns[parent] @ tree.position[body]
        if tree.joint[body] >= 0:
            spun = rotation @ turn(tree.axis[body], float(q[7 + tree.joint[body]]))
            position = position + (rotation - spun) @ tree.anchor[body]
            rotation = spun
        places.append(position)
        turns.append(rotation)
    return places, turns


def random_configuration(human: Humanoid, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    q = human.home.copy()
    q[:3] = rng.normal(size=3)
    q[3:7] = rng.normal(size=4)
    q[3:7] /= np.linalg.norm(q[3:7])
    q[7:] = rng.uniform(human.lower, human.upper)
    return q


def test_heicub_has_fifteen_joints_and_the_documents_mass() -> None:
    assert len(robot("heicub").joints) == 15
    assert robot("heicub").moves.all()
    assert robot("heicub").mass == pytest.approx(26.0, abs=0.1)


def test_the_whole_icub_walks_with_legs_and_torso_and_holds_the_rest() -> None:
    human = robot("icub")
    moving = {joint for joint, moves in zip(human.joints, human.moves, strict=True) if moves}
    assert moving == set(robot("heicub").joints)
    assert {"l_elbow", "r_wrist_yaw", "neck_yaw"} <= set(human.joints) - moving


@pytest.mark.parametrize("name", NAMED)
def test_no_mass_is_lost(name: str) -> None:
    build = HUMANOIDS[name].build
    assert build is not None
    path, settings = build()
    root = ElementTree.parse(path).getroot()
    above = {j.find("child").get("link"): j.find("parent").get("link") for j in root.findall("joint")}  # type: ignore[union-attr]
    total = 0.0
    for link in root.findall("link"):
        chain: list[str | None] = [link.get("name")]
        while chain[-1] in above:
            chain.append(above[chain[-1]])
        mass = link.find("inertial/mass")
        if mass is not None and not set(settings.without) & set(chain):
            total += float(mass.get("value", "0"))
    assert total > 20
    assert robot(name).mass == pytest.approx(total, abs=1e-6)
    assert compiled(name).body_mass.sum() == pytest.approx(total, abs=1e-6)


@pytest.mark.parametrize("name", NAMED)
def test_the_tree_moves_as_mujoco_does(name: str) -> None:
    human, model = robot(name), compiled(name)
    frames: dict[str, Frame] = dict(zip(SITES, (*human.soles, human.waist, human.chest, human.imu), strict=True))
    for seed in range(8):
        q = random_configuration(human, seed)
        data = at(name, q)
        places, turns = bodies(human, q)
        for site, frame in frames.items():
            where = places[frame.body] + turns[frame.body] @ frame.position
            np.testing.assert_allclose(where, data.site(site).xpos, atol=1e-9)
            np.testing.assert_allclose(
                turns[frame.body] @ frame.rotation, data.site(site).xmat.reshape(3, 3), atol=1e-9
            )
        points = np.array([p + r @ c for p, r, c in zip(places, turns, human.tree.centre, strict=True)])
        np.testing.assert_allclose(human.tree.mass @ points / human.mass, data.subtree_com[1], atol=1e-9)
    assert model.nq == 7 + len(human.joints)


@pytest.mark.parametrize("name", NAMED)
def test_what_the_contract_names_is_there_in_order(name: str) -> None:
    human, model = robot(name), compiled(name)
    joints = [model.joint(i).name for i in range(model.njnt)]
    assert joints == ["floating_base", *human.joints]
    assert [model.actuator(i).name for i in range(model.nu)] == list(human.joints)
    assert [int(model.actuator_trnid[i, 0]) for i in range(model.nu)] == list(range(1, model.njnt))
    for site in SITES:
        assert model.site(site).id >= 0
    for sensor, width in (
        ("left_force", 3),
        ("right_torque", 3),
        ("gyro", 3),
        ("accelerometer", 3),
        ("orientation", 4),
    ):
        assert model.sensor_dim[model.sensor(sensor).id] == width
    for sole in SITES[:2]:
        assert model.geom(sole).type == mujoco.mjtGeom.mjGEOM_BOX
        np.testing.assert_allclose(2 * model.geom(sole).size[:2], (human.gait.foot_length, human.gait.foot_width))
    np.testing.assert_allclose(model.jnt_range[1:], np.column_stack([human.lower, human.upper]))
    np.testing.assert_allclose(model.actuator_forcerange[:, 1], human.effort)
    np.testing.assert_allclose(model.actuator_gainprm[:, 0], human.stiffness)
    np.testing.assert_allclose(-model.actuator_biasprm[:, 2], human.damping)
    assert (human.effort > 0).all()
    assert (human.effort < 500).all()


def test_the_ankles_keep_their_real_range() -> None:
    human = robot("heicub")
    ankle = human.joints.index("l_ankle_pitch")
    assert np.rad2deg([human.lower[ankle], human.upper[ankle]]) == pytest.approx([-35, 35])
    assert human.effort[human.joints.index("l_hip_pitch")] == 55.5


@pytest.mark.parametrize("name", NAMED)
def test_home_stands_flat_within_the_limits(name: str) -> None:
    human = robot(name)
    data = at(name, human.home)
    half = human.gait.foot_distance / 2
    for side, y in (("left_sole", half), ("right_sole", -half)):
        np.testing.assert_allclose(data.site(side).xpos, [0, y, 0], atol=1e-5)
        np.testing.assert_allclose(data.site(side).xmat.reshape(3, 3), np.eye(3), atol=1e-5)
    np.testing.assert_allclose(data.subtree_com[1], [0, 0, human.gait.com_height], atol=1e-5)
    np.testing.assert_allclose(data.site("waist").xmat.reshape(3, 3), np.eye(3), atol=1e-5)
    np.testing.assert_allclose(data.site("chest").xmat.reshape(3, 3), np.eye(3), atol=1e-5)
    assert (human.home[7:] >= human.lower).all()
    assert (human.home[7:] <= human.upper).all()


@pytest.mark.parametrize("name", NAMED)
def test_the_eyes_look_ahead_68_mm_apart(name: str) -> None:
    data = at(name, robot(name).home)
    left, right = data.cam("left_eye"), data.cam("right_eye")
    np.testing.assert_allclose(left.xpos - right.xpos, [0, 0.068, 0], atol=1e-6)
    np.testing.assert_allclose(-left.xmat.reshape(3, 3)[:, 2], [1, 0, 0], atol=1e-6)
    np.testing.assert_allclose(left.xmat.reshape(3, 3)[:, 1], [0, 0, 1], atol=1e-6)
    assert left.xpos[0] > data.site("chest").xpos[0]


def static_torque(human: Humanoid, model: mujoco.MjModel, data: Any) -> np.ndarray:
    """Torques that hold the robot still on both soles, the load spread by least squares."""
    rows = []
    for sole in SITES[:2]:
        place, spin = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jacSite(model, data, place, spin, model.site(sole).id)
        rows += [place, spin]
    jacobian = np.vstack(rows)
    wrench = np.linalg.lstsq(jacobian[:, :6].T, data.qfrc_bias[:6], rcond=None)[0]
    return (data.qfrc_bias - jacobian.T @ wrench)[6:]


@pytest.mark.parametrize("name", NAMED)
def test_it_stands_for_a_second_and_feels_its_weight(name: str) -> None:
    human, model = robot(name), compiled(name)
    data = at(name, human.home)
    data.ctrl[:] = human.home[7:] + static_torque(human, model, data) / human.stiffness
    for _ in range(500):
        mujoco.mj_step(model, data)
    assert data.site("waist").xmat[8] > 0.999
    np.testing.assert_allclose(data.subtree_com[1], [0, 0, human.gait.com_height], atol=0.01)
    weight = human.mass * 9.81
    forces = [-data.sensor(f"{side}_force").data[2] for side in ("left", "right")]  # MuJoCo's sign is the reverse
    assert min(forces) > 0.4 * weight
    assert sum(forces) == pytest.approx(weight, rel=0.01)
    assert data.sensor("accelerometer").data[2] == pytest.approx(9.81, abs=0.1)
    assert all("sole" in model.geom(g).name or model.geom(g).name == "floor" for g in data.contact.geom.ravel())


def test_shells_feel_an_obstacle_and_not_the_floor() -> None:
    human = robot("heicub")
    spec = human.spec.copy()
    spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0.0, 0.0, 0.1])
    spec.worldbody.add_geom(
        name="pole", type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[0.02, 1, 0], pos=[0.05, 0.07, 1], contype=3
    )
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = human.home
    mujoco.mj_forward(model, data)
    touching = {frozenset(model.geom(int(geom)).name for geom in pair) for pair in data.contact.geom}
    assert frozenset({"pole", "l_lower_leg_shell"}) in touching
    assert not any("floor" in pair and any(name.endswith("_shell") for name in pair) for pair in touching)
    data.qpos[2] -= 0.2
    mujoco.mj_forward(model, data)
    touching = {frozenset(model.geom(int(geom)).name for geom in pair) for pair in data.contact.geom}
    assert not any("floor" in pair and any(name.endswith("_shell") for name in pair) for pair in touching)


def test_the_document_gaits_are_the_documents() -> None:
    heicub, hrp2 = HUMANOIDS["heicub"].document_gait, HUMANOIDS["hrp2"].document_gait
    assert heicub is not None
    assert hrp2 is not None
    assert (heicub.step_time, heicub.double_support, heicub.sample, heicub.com_height) == (3.2, 1.6, 0.4, 0.45)
    assert heicub.hull[0] == (-0.11, 0.14)
    assert heicub.fastest == Velocity(0.15, 0.02, 0.2)
    assert (hrp2.step_time, hrp2.sample, hrp2.steps, hrp2.still) == (0.8, 0.1, 2, 10)
    assert hrp2.foot_length / 2 - hrp2.margin[0] == pytest.approx(0.0186)
    assert HUMANOIDS["hrp2"].gait == hrp2


def test_hrp2_has_no_body() -> None:
    with pytest.raises(BadInput, match="gait alone"):
        load_humanoid("hrp2")


def test_the_catalogue_is_listed_without_physics() -> None:
    script = (
        "import sys; from toddle.robots.catalogue import HUMANOIDS; "
        "print(sorted(HUMANOIDS), sorted({'mujoco', 'jax'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True, timeout=60)
    assert done.stdout == "['g1', 'heicub', 'hrp2', 'icub', 'talos'] []\n"
