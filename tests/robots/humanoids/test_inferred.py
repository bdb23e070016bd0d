"""A robot nobody named is understood from its description alone."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from robots.humanoids.made import AXES, Order, rotation, text, urdf

from toddle.failures import BadInput
from toddle.robots.gait import Gait
from toddle.robots.humanoid import Humanoid
from toddle.robots.humanoids import load_humanoid

ORDERS = st.builds(
    Order,
    forward=st.sampled_from(sorted(AXES)),
    names=st.sampled_from((("left", "right"), ("l", "r"), ("LeftLeg", "RightLeg"), ("one", "two"), ("beta", "alpha"))),
    scale=st.floats(0.5, 2.0),
    hips=st.floats(0.12, 0.24),
    thigh=st.floats(0.2, 0.3),
    shank=st.floats(0.2, 0.3),
    sole=st.tuples(st.floats(0.15, 0.24), st.floats(0.06, 0.1)),
    ahead=st.floats(0.01, 0.05),
    mass=st.floats(5, 120),
)


def load(folder: Path, order: Order) -> Humanoid:
    file = folder / "made.urdf"
    file.write_text(text(urdf(order)))
    return load_humanoid(str(file))


def drawn_in(hips: float, gait: Gait) -> float:
    """The feet are as far apart as the hips, unless a narrower stance is stepped with more easily [m]."""
    return min(hips, max(0.28 * gait.com_height, gait.foot_width + 0.02))


@given(ORDERS)
@settings(max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_made_humanoid_is_found_again(tmp_path: Path, order: Order) -> None:
    human = load(tmp_path, order)
    gait, size = human.gait, order.scale
    assert gait.foot_distance == pytest.approx(drawn_in(order.hips * size, gait))
    assert gait.foot_length == pytest.approx(order.sole[0] * size)
    assert gait.foot_width == pytest.approx(order.sole[1] * size)
    assert gait.foot_ahead == pytest.approx(order.ahead * size)
    assert human.mass == pytest.approx(order.mass)
    left = human.tree.joint[human.soles[0].body]
    assert human.joints[left] == f"{order.names[0]}_ankle_roll"
    np.testing.assert_allclose(human.waist.rotation, rotation(order), atol=1e-12)
    scale = gait.com_height / 0.465
    assert gait.step_time == pytest.approx(0.6 * np.sqrt(scale), abs=0.006)
    moving = [joint for joint, moves in zip(human.joints, human.moves, strict=True) if moves]
    assert len(moving) == 12
    assert "waist_yaw" not in moving


def test_feet_that_are_near_already_are_not_moved_apart(tmp_path: Path) -> None:
    human = load(tmp_path, Order(scale=0.5, hips=0.15, thigh=0.2, shank=0.2, sole=(0.2, 0.12)))
    assert human.gait.foot_distance == pytest.approx(0.075)


@given(ORDERS)
@settings(max_examples=10, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_its_home_stands_in_mujoco(tmp_path: Path, order: Order) -> None:
    human = load(tmp_path, order)
    model = human.spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = human.home
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.site("left_sole").xpos, [0, human.gait.foot_distance / 2, 0], atol=1e-5)
    np.testing.assert_allclose(data.site("right_sole").xmat.reshape(3, 3), np.eye(3), atol=1e-5)
    np.testing.assert_allclose(data.subtree_com[1], [0, 0, human.gait.com_height], atol=1e-5)
    for side in ("left", "right"):
        box = data.geom(f"{side}_sole")
        bottom = box.xpos[2] - model.geom(f"{side}_sole").size[2]
        assert bottom == pytest.approx(0, abs=1e-5)
    knees = [angle for joint, angle in zip(human.joints, human.home[7:], strict=True) if "knee" in joint]
    assert min(knees) > 0.3


def test_stiff_ankles_stand_straighter(tmp_path: Path) -> None:
    robot = urdf(Order())
    for joint in robot.findall("joint"):
        if "ankle_pitch" in joint.get("name", ""):
            joint.findall("limit")[0].set("lower", "-0.3")
    file = tmp_path / "stiff.urdf"
    file.write_text(text(robot))
    stiff = load_humanoid(str(file))
    assert stiff.gait.com_height > load(tmp_path, Order()).gait.com_height + 0.005
    assert (stiff.home[7:] >= stiff.lower).all()


def test_what_was_inferred_is_said(tmp_path: Path) -> None:
    notes = "\n".join(load(tmp_path, Order(names=("one", "two"))).notes)
    for part in ("soles", "foot_distance", "com_height", "step_time", "hull", "stiffness", "imu", "toes"):
        assert part in notes


def test_toes_fingers_and_endless_joints_are_welded_and_links_without_mass_between_hinges_are_no_bodies(
    tmp_path: Path,
) -> None:
    robot = urdf(Order())
    virtual = next(link for link in robot.findall("link") if link.get("name") == "left_hip_yaw_link")
    mass = float(virtual.find("inertial/mass").get("value", "0"))  # type: ignore[union-attr]
    for part in list(virtual):
        virtual.remove(part)
    waist = next(joint for joint in robot.findall("joint") if joint.get("name") == "waist_yaw")
    waist.set("type", "continuous")
    file = tmp_path / "made.urdf"
    file.write_text(text(robot))
    human = load_humanoid(str(file))
    assert "waist_yaw" not in human.joints
    assert any("waist_yaw" in note for note in human.notes)
    assert {"left_hip_yaw", "left_hip_roll"} <= set(human.joints)
    assert human.mass == pytest.approx(30 - mass)
    data = mujoco.MjData(human.spec.compile())
    assert human.spec.compile().body("left_hip_roll_link").jntnum == 2
    data.qpos[:] = human.home
    assert data.qpos.shape == human.home.shape


MJCF = """
<mujoco><worldbody><geom type="plane" size="1 1 .1"/><body name="pelvis" pos="0 0 .6"><freejoint/>
  <geom type="box" size=".05 .1 .1" mass="10"/>{legs}</body></worldbody></mujoco>
"""
LEG = """
<body name="{side}_thigh" pos="0 {y} 0">
  <joint name="{side}_hip_z" axis="0 0 1" range="-40 40"/><joint name="{side}_hip_x" axis="1 0 0" range="-30 30"/>
  <joint name="{side}_hip_y" axis="0 1 0" range="-100 40"/>
  <geom type="capsule" fromto="0 0 0 0 0 -.25" size=".03" mass="2"/>
  <body name="{side}_shin" pos="0 0 -.25"><joint name="{side}_knee" axis="0 -1 0" range="-130 0"/>
    <geom type="capsule" fromto="0 0 0 0 0 -.25" size=".03" mass="1"/>
    <body name="{side}_foot" pos="0 0 -.25">
      <joint name="{side}_ankle_y" axis="0 1 0" range="-50 50"/>
      <joint name="{side}_ankle_x" axis="1 0 0" range="-30 30"/>
      <geom type="box" size=".1 .05 .01" pos=".03 0 -.05" mass=".8"/></body></body></body>
"""


def test_an_mjcf_with_a_closed_chain_is_refused(tmp_path: Path) -> None:
    legs = LEG.format(side="left", y=0.08) + LEG.format(side="right", y=-0.08)
    loop = "<equality><connect body1='left_shin' body2='left_foot' anchor='0 0 0'/></equality></mujoco>"
    file = tmp_path / "loop.xml"
    file.write_text(MJCF.format(legs=legs).replace("</mujoco>", loop))
    with pytest.raises(BadInput, match="open chains"):
        load_humanoid(str(file))


def test_an_mjcf_with_several_hinges_a_body(tmp_path: Path) -> None:
    file = tmp_path / "biped.xml"
    file.write_text(MJCF.format(legs=LEG.format(side="left", y=0.08) + LEG.format(side="right", y=-0.08)))
    human = load_humanoid(str(file))
    assert human.mass == pytest.approx(17.6)
    assert len(human.joints) == 12
    assert human.gait.foot_length == pytest.approx(0.2)
    assert human.gait.foot_distance == pytest.approx(drawn_in(0.16, human.gait))
    assert any("drawn in" in note for note in human.notes)
    knee = human.joints.index("left_knee")
    assert human.home[7 + knee] == pytest.approx(-0.8, abs=0.1)
    tree = human.tree
    assert len(tree.parent) == 13
    assert tree.mass[tree.joint == human.joints.index("left_hip_z")] == 0
