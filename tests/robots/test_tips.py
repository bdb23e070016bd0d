"""The tip that is taken where none is named: on robots of other people, and on small ones made for one rule each."""

from __future__ import annotations

import importlib.metadata
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle import robots
from toddle.failures import BadInput
from toddle.robots.chain import Chain
from toddle.robots.tip_names import twins, words

FILES = "cmeel.prefix/share/example-robot-data/robots"
LIMIT = '<limit lower="-1" upper="1"/>'

ARMS = {
    # file: tip, its twin, joints (counted by hand in the files: those above the hand that are no mimics)
    "panda_description/urdf/panda.urdf": ("panda_hand_tcp", "", 7),
    "ur_description/urdf/ur5_robot.urdf": ("tool0", "", 6),
    "kinova_description/robots/kinova.urdf": ("j2s6s200_end_effector", "", 6),
    "so_arm_description/urdf/so101.urdf": ("gripper_frame_link", "", 5),
    "b1_description/urdf/b1-z1.urdf": ("gripperStator", "", 6),
    "tiago_description/robots/tiago.urdf": ("hand_grasping_frame", "", 8),
    "tiago_description/robots/tiago_no_hand.urdf": ("wrist_ft_tool_link", "", 8),
    "tiago_pro_description/robots/tiago_pro.urdf": ("gripper_right_base_link", "gripper_left_base_link", 8),
    "talos_data/robots/talos_full_v2.urdf": ("gripper_right_base_link", "gripper_left_base_link", 9),
    "talos_data/robots/talos_left_arm.urdf": ("gripper_left_base_link", "", 6),
    "baxter_description/urdf/baxter.urdf": ("right_gripper", "left_gripper", 7),
    "pr2_description/urdf/pr2.urdf": ("r_gripper_tool_frame", "l_gripper_tool_frame", 8),
    "romeo_description/urdf/romeo.urdf": ("r_gripper", "l_gripper", 8),
    "romeo_description/urdf/romeo_laas_small.urdf": ("RArm_effector", "LArm_effector", 8),
    "human_description/robots/human.urdf": ("right_hand", "left_hand", 13),
    "simple_humanoid_description/urdf/simple_humanoid.urdf": ("r_wrist", "l_wrist", 10),
    "g1_description/urdf/g1_29dof_with_hand_rev_1_0.urdf": ("right_hand_palm_link", "left_hand_palm_link", 10),
    "icub_description/robots/icub.urdf": ("r_gripper", "l_gripper", 10),
}
NO_ARMS = {
    # file: the first end that is offered
    "allegro_hand_description/urdf/allegro_right_hand.urdf": "link_3.0_tip",
    "b1_description/urdf/b1.urdf": "FR_foot",
    "bolt_description/robots/bolt.urdf": "FL_FOOT",
    "anymal_c_simple_description/urdf/anymal.urdf": "LF_FOOT",
    "centauro_description/urdf/centauro.urdf": "ball1_tip",  # two arms of equal right: no left, no right
    "iris_description/robots/iris.urdf": "iris__rotor_0",
}


def _described(name: str) -> str:
    return str(importlib.metadata.distribution("example-robot-data").locate_file(f"{FILES}/{name}"))


def _load(path: Path | str, **choice: object) -> Chain:
    body = robots.load(path, **choice)  # type: ignore[arg-type]
    assert isinstance(body, Chain)
    return body


@pytest.mark.parametrize("name", ARMS)
def test_the_hand_of_somebody_elses_robot_is_found_and_told(name: str) -> None:
    tip, twin, count = ARMS[name]
    found = _load(_described(name))
    aside = f" (not its left twin {twin})" if twin else ""
    assert found.notes[0] == f"no tip was named: took {tip}{aside}, moved by {count} joints; name another with --tip"
    named = _load(_described(name), tip=tip)
    assert found.joints == named.joints
    assert len(found.joints) == count
    np.testing.assert_array_equal(np.asarray(found.tip), np.asarray(named.tip))
    assert not any("no tip" in note for note in named.notes)


@pytest.mark.parametrize("name", NO_ARMS)
def test_a_robot_without_one_best_arm_is_refused_and_its_ends_are_offered(name: str) -> None:
    with pytest.raises(BadInput, match=rf"no tip was named; name one: {NO_ARMS[name]}, "):
        robots.load(_described(name))


def _urdf(folder: Path, *joints: str) -> Path:
    """A robot of joints written as "kind name parent child inside"."""
    links, text = dict[str, None](), ""
    for joint in joints:
        kind, name, parent, child, inside = [*joint.split(maxsplit=4), LIMIT][:5]
        links |= {parent: None, child: None}
        ends = f'<parent link="{parent}"/><child link="{child}"/><origin xyz=".1 .2 .3"/>'
        text += f'<joint name="{name}" type="{kind}">{ends}{inside}</joint>'
    path = folder / "robot.urdf"
    path.write_text(f'<robot name="r">{"".join(f"<link name={link!r}/>" for link in links)}{text}</robot>')
    return path


def _arm(side: str = "", root: str = "base", joints: int = 4) -> list[str]:
    """An arm of revolute joints from the root to a link called <side>arm<joints>."""
    links = [root, *(f"{side}arm{i + 1}" for i in range(joints))]
    return [f"revolute {side}j{i} {links[i]} {links[i + 1]}" for i in range(joints)]


RULES = {
    # joints: the tip that is taken
    "two fingers without a name hang on the palm": (
        [*_arm(), "fixed f arm4 mount", "prismatic a mount x", "prismatic b mount y"],
        "mount",
    ),
    "one jaw beside a frame that is a tool's": ([*_arm(), "fixed f arm4 tcp", "prismatic a arm4 x"], "tcp"),
    "a camera on the wrist": ([*_arm(), "fixed f arm4 wrist_camera", "fixed g base world_camera"], "arm4"),
    "a flange": ([*_arm(), "fixed f arm4 flange", "fixed g arm4 bracket", "fixed h base plate"], "flange"),
    "a tool before a hand": ([*_arm(), "fixed f arm4 hand", "fixed g arm4 tool0"], "tool0"),
    "a wheel": ([*_arm(), "continuous w base wheel_left <axis/>", "continuous v base roll <axis/>"], "arm4"),
    "a head": ([*_arm(), *_arm("head_", joints=6)], "arm4"),
    "legs": ([*_arm(), *_arm("left_leg_", joints=6), *_arm("right_leg_", joints=6)], "arm4"),
    "the arm with more joints": ([*_arm(joints=5), *_arm("x")], "arm5"),
    "left and right": ([*_arm("left_"), *_arm("right_")], "right_arm4"),
    "l and r": ([*_arm("l_"), *_arm("r_")], "r_arm4"),
    "a torso that moves": (["revolute t base chest", *_arm("L", "chest"), *_arm("R", "chest")], "Rarm4"),
    "a mimic joint counts with the one it follows": (
        [*_arm(), f'revolute m arm4 a5 {LIMIT}<mimic joint="j0"/>', *_arm("x", joints=5)],
        "xarm5",
    ),
}


@pytest.mark.parametrize("rule", RULES)
def test_each_rule(rule: str, tmp_path: Path) -> None:
    joints, tip = RULES[rule]
    assert f"took {tip}" in _load(_urdf(tmp_path, *joints)).notes[0].replace(",", "").replace("(", "")


def test_the_base_and_the_joints_that_are_named_decide_between_arms(tmp_path: Path) -> None:
    path = _urdf(tmp_path, "fixed s base stand", "revolute t stand chest", *_arm("left_", "chest"), *_arm("x", "base"))
    assert _load(path).notes[0].startswith("no tip was named: took left_arm4, moved by 5 ")
    assert _load(path, base="stand").notes[0].startswith("no tip was named: took left_arm4, moved by 5 ")
    assert _load(path, joints=["xj1"]).notes[0].startswith("no tip was named: took xarm4, moved by 4 ")
    assert _load(path, base="xarm1").joints == ("xj1", "xj2", "xj3")


def test_a_fault_beside_the_arm_is_not_looked_at(tmp_path: Path) -> None:
    path = _urdf(tmp_path, *_arm(), 'revolute x base y <limit lower="nan" upper="1"/>', "fixed f arm4 tcp")
    assert _load(path).joints == ("j0", "j1", "j2", "j3")


def test_a_floating_base_is_left_behind_and_told(tmp_path: Path) -> None:
    chain = _load(_urdf(tmp_path, "floating free world trunk", *_arm(root="trunk")))
    assert chain.joints == ("j0", "j1", "j2", "j3")
    assert chain.notes == ("no base was named: took trunk, for joint 'free' above it can't be commanded",)


def test_an_endless_joint_is_told_and_a_slide_without_limits_is_refused(tmp_path: Path) -> None:
    chain = _load(_urdf(tmp_path, "continuous a base b <axis/>", "revolute c b d"))
    assert chain.notes == ("a turns without limits: took half a turn either way",)
    np.testing.assert_allclose([chain.lower[0], chain.upper[0]], [-np.pi, np.pi], rtol=1e-6)
    with pytest.raises(BadInput, match="joint 'a': it has no limits"):
        robots.load(_urdf(tmp_path, "prismatic a base b <axis/>"))


def test_a_joint_with_both_limits_at_zero_stands_still(tmp_path: Path) -> None:
    zero = '<limit lower="0" upper="0"/>'
    path = _urdf(tmp_path, "revolute a base b", f"revolute z b c {zero}", "revolute d c e")
    chain = _load(path)
    assert chain.joints == ("a", "d")
    assert chain.notes == ("z has the limits 0 to 0: held at 0",)
    fixed = _load(_urdf(tmp_path, "revolute a base b", "fixed z b c", "revolute d c e"))
    q = jnp.array([0.3, -0.4], dtype=jnp.float32)
    np.testing.assert_allclose(chain.forward(q), fixed.forward(q), atol=1e-6)
    path = _urdf(tmp_path, "revolute a base b", f"revolute z b c {zero}", "revolute d c e")
    with pytest.raises(BadInput, match="joint 'z' has the limits 0 to 0; known: a, d"):
        robots.load(path, joints=["a", "z"])
    with pytest.raises(BadInput, match=r"joint 'a': every joint .* has the limits 0 to 0; give them ranges"):
        robots.load(_urdf(tmp_path, f"revolute a base b {zero}", f"revolute z b c {zero}"))


def _mjcf(folder: Path, inside: str, beside: str = "") -> Path:
    """Four hinges one behind the other, the last body with this inside, and something beside the arm."""
    text = inside
    for i in (3, 2, 1, 0):
        text = f'<body name="link{i}" pos=".1 0 .2"><joint name="j{i}" axis="0 {i % 2} 1" range="-1 1"/>{text}</body>'
    path = folder / "robot.xml"
    path.write_text(f'<mujoco><compiler angle="radian"/><worldbody>{text}{beside}</worldbody></mujoco>')
    return path


SLIDE = '<joint name="{0}" type="slide" range="0 .04"/>'
FINGERS = "".join(f'<body name="{side}_pad">{SLIDE.format(side)}</body>' for side in ("left", "right"))
MODELS = {
    # what the last body holds, what is beside the arm: the tip
    "a site that is a tool's": ('<site name="imu"/><site name="attachment_site" pos=".1 0 0"/>', "", "attachment_site"),
    "fingers on a hand": (f'<body name="hand" pos="0 0 .1">{FINGERS}</body>', "", "hand"),
    "fingers, and a pinch site": (f'<site name="pinch" pos=".1 0 0"/>{FINGERS}', "", "pinch"),
    "a table beside the arm": ("", '<body name="table"/>', "link3"),
    "a thing to grasp": ("", '<body name="cube"><freejoint/></body>', "link3"),
    "a thing that slides": ('<site name="mark"/>', f'<body name="goal">{SLIDE.format("x")}</body>', "link3"),
}


@pytest.mark.parametrize("name", MODELS)
def test_a_tip_of_a_mujoco_model(name: str, tmp_path: Path) -> None:
    inside, beside, tip = MODELS[name]
    chain = _load(_mjcf(tmp_path, inside, beside))
    assert chain.notes == (f"no tip was named: took {tip}, moved by 4 joints; name another with --tip",)
    assert chain.joints == ("j0", "j1", "j2", "j3")


def test_an_only_end_is_taken_without_a_word(tmp_path: Path) -> None:
    assert _load(_mjcf(tmp_path, '<site name="mark"/>')).notes == ()


def test_an_only_end_behind_a_gripper_tells_of_its_joint() -> None:
    chain = _load(_described("so_arm_description/urdf/so100.urdf"))
    assert len(chain.joints) == 6
    assert chain.notes == (
        "no tip was named: took jaw, the only end; the gripper's joint gripper counts as the arm's, "
        "leave it out with --joints",
    )


def test_words_of_names() -> None:
    assert words("RFinger13_link") == ("r", "finger", "13", "link")
    assert words("LEFT_FOOT/imu-Frame") == ("left", "foot", "imu", "frame")
    assert words("RightSakePalmLink") == ("right", "sake", "palm", "link")


@given(st.text("abcLR_ ", max_size=6), st.sampled_from([("left", "right"), ("Left", "Right"), ("l_", "r_")]))
def test_twins_are_found_in_any_order_and_nothing_is_its_own_twin(rest: str, sides: tuple[str, str]) -> None:
    left, right = (f"{side}_{rest}" for side in sides)
    assert twins(left, right) == twins(right, left) == (left, right)
    assert twins(left, left) is None
    assert twins(left, f"{right}x_y") is None
