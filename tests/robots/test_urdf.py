"""URDF chains against MuJoCo's own kinematics, on our arms, the iCub and random robots."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path

import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle import robots
from toddle.robots.catalogue import MODELS
from toddle.robots.chain import Chain
from toddle.robots.urdf import read_urdf

Pose = Callable[[mujoco.MjModel, str, str, Mapping[str, float]], np.ndarray]
MESH = '<visual><geometry><mesh filename="package://nowhere/missing.stl"/></geometry></visual>'
Answer = Callable[[Chain, np.ndarray], tuple[np.ndarray, np.ndarray]]
SINGLE = 5e-6  # [m] single precision, over ten transforms of about a metre


def _random_q(chain: Chain, rng: np.random.Generator, count: int) -> np.ndarray:
    lower, upper = np.asarray(chain.lower), np.asarray(chain.upper)
    return rng.uniform(lower, upper, (count, len(lower)))


def _unfused(path: Path) -> mujoco.MjModel:
    """MuJoCo's reading of the file, fixed links kept and nothing but kinematics in it."""
    spec = mujoco.MjSpec.from_file(str(path))
    spec.compiler.fusestatic = False
    for geom in list(spec.geoms):
        spec.delete(geom)
    for mesh in list(spec.meshes):
        spec.delete(mesh)
    return spec.compile()


@pytest.mark.parametrize(
    ("spec", "base", "tip"),
    [("nicu", "torso", "tip"), ("suralp", "torso", "tip"), ("icub_arm", "chest", "r_hand_dh_frame")],
)
def test_a_known_arm_agrees_with_mujoco(mujoco_pose: Pose, answer: Answer, spec: str, base: str, tip: str) -> None:
    chain = robots.load(spec)
    assert isinstance(chain, Chain)
    if spec == "icub_arm":
        import icub_models

        model = _unfused(Path(icub_models.get_model_file("iCubGazeboV2_5")))
    else:
        model = _unfused(MODELS / f"{spec}.urdf")
    q = _random_q(chain, np.random.default_rng(0), 50)
    x, pose = answer(chain, q)
    expected = np.array([mujoco_pose(model, base, tip, dict(zip(chain.joints, row, strict=True))) for row in q])
    np.testing.assert_allclose(pose, expected, atol=SINGLE)
    np.testing.assert_allclose(x, expected[:, :3, 3], atol=SINGLE)


def test_the_icub_can_start_at_its_root_or_at_its_other_hand(mujoco_pose: Pose, answer: Answer) -> None:
    import icub_models

    model = _unfused(Path(icub_models.get_model_file("iCubGazeboV2_5")))
    for base, joints in (("root_link", 10), ("l_hand", 14)):
        chain = robots.load("icub_arm", base=base)
        assert isinstance(chain, Chain)
        assert len(chain.joints) == joints
        q = _random_q(chain, np.random.default_rng(1), 3)
        values = [dict(zip(chain.joints, row, strict=True)) for row in q]
        expected = np.array([mujoco_pose(model, base, "r_hand_dh_frame", row) for row in values])
        np.testing.assert_allclose(answer(chain, q)[1], expected, atol=SINGLE)


def _random_urdf(rng: np.random.Generator) -> str:
    """A trunk that parts into two branches, joint types shuffled on each; the second has a mimic joint."""
    trunk, left, right = ["revolute", "fixed"], ["prismatic", "revolute", "fixed"], ["revolute", "prismatic"]
    right += ["continuous", "mimic"]
    lines, number = ['<link name="root"/>'], 0
    leaders: list[str] = []
    for branch, kinds in (("trunk", trunk), ("left", left), ("right", right)):
        parent = {"trunk": "root"}.get(branch, "trunk1")
        for i, kind in enumerate(rng.permutation(kinds)):
            link = f"{branch}{i}"
            lines.append(_link(link) + _joint(f"j{number}", str(kind), parent, link, leaders, rng))
            if kind == "revolute":
                leaders.append(f"j{number}")
            parent, number = link, number + 1
    return f'<robot name="random"><mujoco><compiler fusestatic="false"/></mujoco>{"".join(lines)}</robot>'


def _link(name: str) -> str:
    inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    return f'<link name="{name}"><inertial><mass value="1"/>{inertia}</inertial>{MESH}</link>'


def _joint(name: str, kind: str, parent: str, link: str, leaders: list[str], rng: np.random.Generator) -> str:
    def three(scale: float) -> str:
        return " ".join(f"{v:.12g}" for v in rng.uniform(-scale, scale, 3))

    ends = f'<parent link="{parent}"/><child link="{link}"/><origin xyz="{three(0.4)}" rpy="{three(3)}"/>'
    lower, upper = np.sort(rng.uniform(-2, 2, 2)) + np.array([-0.1, 0.1])
    limit = f'<limit lower="{lower}" upper="{upper}" effort="1" velocity="1"/>'
    if kind == "mimic":
        leader, (gain, offset) = rng.choice(leaders), rng.uniform(-1, 1, 2)
        limit += f'<mimic joint="{leader}" multiplier="{gain}" offset="{offset}"/>'
        kind = "revolute"
    moves = "" if kind == "fixed" else f'<axis xyz="{three(1)}"/>{limit}'
    return f'<joint name="{name}" type="{kind}">{ends}{moves}</joint>'


@given(st.integers(0, 10**6), st.sampled_from(["root", "left2"]))
def test_a_random_robot_agrees_with_mujoco_from_any_base(
    mujoco_pose: Pose, answer: Answer, tmp_path_factory: pytest.TempPathFactory, seed: int, base: str
) -> None:
    rng = np.random.default_rng(seed)
    path = tmp_path_factory.mktemp("random") / "robot.urdf"
    text = _random_urdf(rng)
    path.write_text(text)
    chain = read_urdf(path, base=base, tip="right3")
    q = _random_q(chain, rng, 2)
    model = mujoco.MjModel.from_xml_string(text.replace(MESH, ""))
    poses = [mujoco_pose(model, base, "right3", _with_mimic(text, chain, row)) for row in q]
    np.testing.assert_allclose(answer(chain, q)[1], poses, atol=SINGLE)


def _with_mimic(text: str, chain: Chain, q: np.ndarray) -> dict[str, float]:
    """The values of all joints, the follower's by the rule in the file."""
    values = dict(zip(chain.joints, (float(v) for v in q), strict=True))
    rule = r'<mimic joint="(j\d)" multiplier="(.*?)" offset="(.*?)"'
    found = re.search(r'name="(j\d)" type="revolute">(?:(?!</joint>).)*' + rule, text)
    assert found is not None
    follower, leader, gain, offset = found.groups()
    values[follower] = float(gain) * values.get(leader, 0.0) + float(offset)
    return values


def test_a_follower_of_a_follower_follows_the_first(tmp_path: Path) -> None:
    """Sliders along x: one = q; two = 2 q + .1; three = -3 two + .5 = -6 q + .2. Their sum is .3 - 3 q."""

    def slider(name: str, parent: str, child: str, mimic: str) -> str:
        ends = f'<parent link="{parent}"/><child link="{child}"/><limit lower="-1" upper="1"/>'
        return f'<link name="{child}"/><joint name="{name}" type="prismatic">{ends}{mimic}</joint>'

    path = tmp_path / "sliders.urdf"
    two = '<mimic joint="one" multiplier="2" offset=".1"/>'
    three = '<mimic joint="two" multiplier="-3" offset=".5"/>'
    joints = slider("three", "a", "b", three) + slider("two", "b", "c", two) + slider("one", "c", "d", "")
    path.write_text(f'<robot><link name="a"/>{joints}</robot>')
    chain = read_urdf(path)
    assert chain.joints == ("one",)
    for q in (0.0, 0.25):
        x = np.asarray(chain.pose(jnp.array([q])))[:3, 3]
        np.testing.assert_allclose(x, [0.3 - 3 * q, 0, 0], atol=1e-6)
