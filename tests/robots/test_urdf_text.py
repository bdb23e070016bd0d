"""A learned arm written as a URDF, read back by our own reader and by MuJoCo; an owner's file with a corrected arm."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import toddle
from toddle.failures import BadInput
from toddle.reach.model.rigid import changed
from toddle.robots.catalogue import MODELS
from toddle.robots.chain import Chain
from toddle.robots.frames import from_rpy
from toddle.robots.linkage import Linkage, linkage_of, poses
from toddle.robots.urdf_corrected import corrected_urdf
from toddle.robots.urdf_elements import rpy
from toddle.robots.urdf_text import urdf_text

Pose = Callable[[mujoco.MjModel, str, str, Mapping[str, float]], np.ndarray]
CLOSE = 1e-6  # [m or 1]: the reader holds a chain in single precision


def drawn(rng: np.random.Generator, axes: int, *, joints: int | None = None) -> Linkage:
    """An arm of about a metre, sliding joints, wrong gains and directions, offsets, mimic axes where joints < axes."""
    joints = joints or axes
    before = np.tile(np.eye(4), (axes + 1, 1, 1))
    for frame in before:
        frame[:3, :3], frame[:3, 3] = from_rpy(rng.uniform(-np.pi, np.pi, 3)), rng.uniform(-0.15, 0.15, 3)
    gain = np.zeros((axes, joints))
    gain[range(axes), [*range(joints), *rng.integers(0, joints, axes - joints)]] = rng.choice([-1, 1], axes)
    slides = (rng.random(axes) < 0.3).astype(float)
    return Linkage(before[:-1], slides, gain * rng.uniform(0.5, 1.5, (axes, 1)), rng.uniform(-1, 1, axes), before[-1])


def mujoco_poses(path: Path, joints: tuple[str, ...], q: np.ndarray, tip: str) -> np.ndarray:
    """Tip poses by MuJoCo's own kinematics, mimic joints set as the equalities say that it made of them."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data, out = mujoco.MjData(model), []
    for row in q:
        data.qpos[:] = 0
        for name, value in zip(joints, row, strict=True):
            data.joint(name).qpos[0] = value
        for follower, leader, rule in zip(model.eq_obj1id, model.eq_obj2id, model.eq_data, strict=True):
            value = data.qpos[model.jnt_qposadr[leader]]
            data.qpos[model.jnt_qposadr[follower]] = rule[0] + rule[1] * value
        mujoco.mj_kinematics(model, data)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = data.body(tip).xmat.reshape(3, 3), data.body(tip).xpos
        out.append(pose)
    return np.array(out)


def loaded(path: Path, tip: str | None = None) -> Chain:
    body = toddle.load(str(path), tip=tip)
    assert isinstance(body, Chain)
    return body


@pytest.mark.parametrize(("axes", "joints"), [(3, 3), (6, 6), (7, 5)])
def test_a_written_arm_is_the_learned_one(tmp_path: Path, axes: int, joints: int) -> None:
    rng = np.random.default_rng(axes)
    linkage = drawn(rng, axes, joints=joints)
    names = tuple(f"motor {i} <&" for i in range(joints))
    lower, upper = -rng.uniform(0.5, 2, joints), rng.uniform(0.5, 2, joints)
    path = tmp_path / "arm.urdf"
    path.write_text(urdf_text("arm & all", names, linkage, lower, upper, about="Seen -- 300 times --"))
    q = rng.uniform(lower, upper, (40, joints))
    chain = loaded(path)
    assert chain.joints == names or set(chain.joints) == set(names)
    order = [names.index(name) for name in chain.joints]
    np.testing.assert_allclose(poses(linkage_of(chain), q[:, order]), poses(linkage, q), atol=CLOSE)
    np.testing.assert_allclose(mujoco_poses(path, names, q, "tip"), poses(linkage, q), atol=1e-9)
    np.testing.assert_allclose(np.asarray(chain.lower), lower[order], atol=1e-6)
    np.testing.assert_allclose(np.asarray(chain.upper), upper[order], atol=1e-6)


def test_a_constant_axis_and_an_arm_of_one_joint_can_be_written(tmp_path: Path) -> None:
    linkage = drawn(np.random.default_rng(1), 3)
    held = linkage._replace(gain=np.array([[0.0], [1.0], [0.0]]))
    path = tmp_path / "arm.urdf"
    path.write_text(urdf_text("arm", ["only"], held, np.array([-1.0]), np.array([1.0])))
    q = np.linspace(-1, 1, 5)[:, None]
    np.testing.assert_allclose(poses(linkage_of(loaded(path)), q), poses(held, q), atol=CLOSE)


def test_names_that_are_taken_are_left_alone(tmp_path: Path) -> None:
    linkage = drawn(np.random.default_rng(2), 3)
    names = ("to_tip", "a", "a_gain")
    path = tmp_path / "arm.urdf"
    path.write_text(urdf_text("arm", names, linkage, -np.ones(3), np.ones(3)))
    assert loaded(path).joints == names


@given(st.tuples(*[st.floats(-4, 4)] * 3), st.sampled_from([0.0, 1e-12, 1e-7]))
def test_roll_pitch_yaw_give_the_rotation_back(angles: tuple[float, float, float], near: float) -> None:
    turn = from_rpy(np.array([angles[0], np.pi / 2 + near, angles[2]]))
    for one in (turn, turn.T, from_rpy(np.array(angles))):
        np.testing.assert_allclose(from_rpy(rpy(one)), one, atol=1e-12)


def test_what_no_file_can_hold_is_refused() -> None:
    linkage = drawn(np.random.default_rng(3), 3)
    low, high = -np.ones(3), np.ones(3)
    with pytest.raises(BadInput, match="axis 2 is moved by a and b"):
        urdf_text("arm", "abc", linkage._replace(gain=np.array([[1.0, 0, 0], [1, 1, 0], [0, 0, 1]])), low, high)
    with pytest.raises(BadInput, match="joint 'c' moves nothing"):
        urdf_text("arm", "abc", linkage._replace(gain=np.diag([1.0, 1, 0])), low, high)
    with pytest.raises(BadInput, match="joint 'b' has limits"):
        urdf_text("arm", "abc", linkage, low, np.array([1.0, -1.0, 1.0]))


def wrong(linkage: Linkage, rng: np.random.Generator, size: float = 0.05) -> Linkage:
    """The linkage with every number changed a little, gains too."""
    return changed(linkage, size * rng.uniform(-1, 1, 7 * len(linkage.slides) + 6))


MIMIC = b"""<?xml version="1.0"?>
<robot name="own"><!-- mine -->
  <link name="base"/><link name="a"><visual><geometry><mesh filename="a.stl"/></geometry></visual></link>
  <link name="b"/><link name="c"/><link name="d"/><link name="hand"/>
  <joint name="one" type="revolute"><parent link="base"/><child link="a"/><origin xyz="0 0 .3" rpy="0 .2 0"/>
    <axis xyz="0 1 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="lift" type="prismatic"><parent link="a"/><child link="b"/><origin xyz=".1 0 .2"/>
    <limit lower="0" upper=".3" effort="1" velocity="1"/></joint>
  <joint name="bolt" type="fixed"><parent link="b"/><child link="c"/><origin rpy="1 0 0"/></joint>
  <joint name="two" type="continuous"><parent link="c"/><child link="d"/><origin xyz=".2 .1 0"/>
    <axis xyz="0 -2 0"/></joint>
  <joint name="follower" type="revolute"><parent link="d"/><child link="hand"/><origin xyz=".2 .1 0"/>
    <axis xyz="0 0 1"/><mimic joint="two" multiplier="-.5" offset=".3"/></joint>
</robot>"""


@pytest.mark.parametrize("flips", [(), (1,), (0, 2)])
def test_an_owners_file_holds_the_corrected_arm(tmp_path: Path, flips: tuple[int, ...]) -> None:
    rng = np.random.default_rng(4)
    path = tmp_path / "own.urdf"
    path.write_bytes(MIMIC)
    chain = loaded(path)
    corrected = wrong(linkage_of(chain), rng)
    corrected.gain[:, list(flips)] *= -1
    corrected = corrected._replace(offset=corrected.offset + corrected.gain @ rng.uniform(-0.1, 0.1, 3))
    text = corrected_urdf(MIMIC, "own.urdf", corrected, about="30 movements")
    path.write_text(text)
    again = loaded(path, tip="hand")
    q = rng.uniform(np.asarray(chain.lower), np.asarray(chain.upper), (30, 3))
    assert again.joints == chain.joints
    np.testing.assert_allclose(poses(linkage_of(again), q), poses(corrected, q), atol=CLOSE)
    assert "<!-- mine -->" in text
    assert 'filename="a.stl"' in text


def test_a_file_with_nothing_to_correct_keeps_its_numbers() -> None:
    text = (MODELS / "nicu.urdf").read_bytes()
    again = corrected_urdf(text, "nicu", linkage_of(loaded(MODELS / "nicu.urdf")))
    before, after = ([line.strip() for line in t.splitlines() if "<origin" in line] for t in (text.decode(), again))
    assert [line.replace(" />", "/>") for line in after] == before


def test_a_corrected_file_moves_the_same_in_mujoco(tmp_path: Path) -> None:
    chain = loaded(MODELS / "nicu.urdf")
    corrected = wrong(linkage_of(chain), np.random.default_rng(5))
    path = tmp_path / "nicu.urdf"
    text = corrected_urdf((MODELS / "nicu.urdf").read_bytes(), "nicu", corrected)
    path.write_text(text.replace("</robot>", '<mujoco><compiler fusestatic="false"/></mujoco></robot>'))
    q = np.random.default_rng(6).uniform(np.asarray(chain.lower), np.asarray(chain.upper), (20, 4))
    np.testing.assert_allclose(mujoco_poses(path, chain.joints, q, "tip"), poses(corrected, q), atol=CLOSE)


def test_a_base_beside_the_way_is_refused() -> None:
    linkage = linkage_of(read_again("a", "hand"))
    with pytest.raises(BadInput, match="not on the way"):
        corrected_urdf(MIMIC, "own", linkage, base="hand", tip="a")
    with pytest.raises(BadInput, match="not those of the corrected arm"):
        corrected_urdf(MIMIC, "own", linkage)


def read_again(base: str, tip: str) -> Chain:
    from toddle.robots.markup import parse
    from toddle.robots.urdf import chain_of

    return chain_of(parse(MIMIC, "own"), "own", tip=tip, base=base, joints=None)
