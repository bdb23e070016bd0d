"""MJCF chains against MuJoCo's own kinematics of the same file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toddle import robots
from toddle.failures import BadInput
from toddle.robots import mjcf
from toddle.robots.chain import Chain
from toddle.robots.mjcf import read_mjcf

Pose = Callable[[mujoco.MjModel, str, str, Mapping[str, float]], np.ndarray]
Answer = Callable[[Chain, np.ndarray], tuple[np.ndarray, np.ndarray]]
SINGLE = 5e-6  # [m] single precision

ARM = """
<mujoco model="arm">
  <compiler angle="degree" eulerseq="zyx" meshdir="nowhere"/>
  <default>
    <joint type="hinge" axis="0 1 0" range="-90 120" damping="1"/>
    <default class="sliding"><joint type="slide" axis="1 1 0" range="-.1 .3"/></default>
    <default class="look"><geom type="sphere" size=".1" material="grey"/></default>
  </default>
  <asset>ASSETS</asset>
  <worldbody>
    <light pos="0 0 3"/>
    <body name="base" pos=".1 .2 .3" euler="10 20 30">
      <geom class="look"/>
      <body name="upper" pos="0 0 .2" axisangle="1 2 3 40">
        <joint name="yaw" axis="0 0 1" pos=".05 .02 0" ref="15"/>
        <joint name="pitch" pos="0 -.1 .03"/>
        <geom class="look"/>
        <frame pos="0 .1 0" euler="0 0 45">
          <body name="lower" pos=".3 0 0" xyaxes="0 1 0 -1 0 0" childclass="sliding">
            <joint name="extend" pos=".2 .1 0" ref=".05"/>
            <joint name="finger" class="sliding" axis="0 1 2"/>
            <geom class="look"/>
            <site name="grip" type="capsule" size=".01" fromto=".1 0 .05 .2 .1 .15" material="grey"/>
            <body name="held" pos="0 0 .1"><geom class="look"/></body>
          </body>
        </frame>
      </body>
    </body>
  </worldbody>
  <equality><joint joint1="finger" joint2="extend" polycoef=".01 -.5 0 0 0"/></equality>
  <actuator><position joint="yaw"/></actuator>
  <sensor><jointpos joint="yaw"/></sensor>
  <keyframe><key name="home" qpos=".3 .5 .1 0"/></keyframe>
</mujoco>
"""
MISSING = '<mesh name="hand" file="missing.stl"/><hfield name="h" file="missing.png" size="1 1 1 1"/>'


def _arm(folder: Path, text: str = ARM) -> Path:
    path = folder / "arm.xml"
    path.write_text(text.replace("ASSETS", MISSING))
    return path


def _values(chain: Chain, q: np.ndarray) -> dict[str, float]:
    """Joint values, the finger's by the equality: y = y0 + .01 - .5 (x - x0), with y0 = 0 and x0 = .05."""
    values = dict(zip(chain.joints, (float(v) for v in q), strict=True))
    return values | {"finger": 0.01 - 0.5 * (values["extend"] - 0.05)}


@given(st.integers(0, 10**6), st.sampled_from([("base", "held"), ("world", "grip"), ("grip", "base")]))
def test_a_model_agrees_with_mujoco(
    mujoco_pose: Pose,
    answer: Answer,
    tmp_path_factory: pytest.TempPathFactory,
    seed: int,
    ends: tuple[str, str],
) -> None:
    base, tip = ends
    chain = read_mjcf(_arm(tmp_path_factory.mktemp("arm")), base=base, tip=tip)
    assert set(chain.joints) == {"yaw", "pitch", "extend"}
    rng = np.random.default_rng(seed)
    q = rng.uniform(np.asarray(chain.lower), np.asarray(chain.upper), (1, 3))
    model = mujoco.MjModel.from_xml_string(ARM.replace("ASSETS", '<material name="grey"/>'))
    pose = mujoco_pose(model, base, tip, _values(chain, q[0]))
    x, poses = answer(chain, q)
    np.testing.assert_allclose(poses[0], pose, atol=SINGLE)
    np.testing.assert_allclose(x[0], pose[:3, 3], atol=SINGLE)


def test_limits_are_in_radians_and_the_home_is_the_keyframe(tmp_path: Path) -> None:
    chain = read_mjcf(_arm(tmp_path))
    assert chain.name == "arm"
    assert chain.joints == ("yaw", "pitch", "extend")
    np.testing.assert_allclose(np.asarray(chain.lower), [-np.pi / 2, -np.pi / 2, -0.1], rtol=1e-6)
    np.testing.assert_allclose(np.asarray(chain.upper), [np.radians(120), np.radians(120), 0.3], rtol=1e-6)
    np.testing.assert_allclose(np.asarray(chain.home), [0.3, 0.5, 0.1], rtol=1e-6)


def test_an_included_file_of_the_same_folder_is_read(tmp_path: Path) -> None:
    head, body = ARM.split("<worldbody>")
    body, tail = body.split("</worldbody>")
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "body.xml").write_text(f"<mujocoinclude>{body}</mujocoinclude>")
    included = f'{head}<worldbody><include file="parts/body.xml"/></worldbody>{tail}'
    chain, whole = read_mjcf(_arm(tmp_path, included)), read_mjcf(_arm(tmp_path))
    np.testing.assert_array_equal(np.asarray(chain.before), np.asarray(whole.before))


def test_an_equality_with_nothing_holds_a_joint_still(mujoco_pose: Pose, answer: Answer, tmp_path: Path) -> None:
    text = ARM.replace("</equality>", '<joint joint1="pitch" polycoef=".4 0 0 0 0"/></equality>')
    chain = read_mjcf(_arm(tmp_path, text))
    assert chain.joints == ("yaw", "extend")
    model = mujoco.MjModel.from_xml_string(text.replace("ASSETS", '<material name="grey"/>'))
    values = _values(chain, np.asarray(chain.home)) | {"pitch": 0.4}
    pose = mujoco_pose(model, "world", "held", values)
    np.testing.assert_allclose(answer(chain, np.asarray(chain.home)[None])[1][0], pose, atol=SINGLE)


def test_a_curved_equality_matters_only_where_it_is_on_the_chain(tmp_path: Path) -> None:
    path = _arm(tmp_path, ARM.replace(".01 -.5 0 0 0", ".01 -.5 .3 0 0"))
    assert robots.load(path, tip="upper").joints == ("yaw", "pitch")
    with pytest.raises(BadInput, match=r"joint 'finger': .*polynomial.*polycoef"):
        robots.load(path)


def test_an_unlimited_hinge_turns_half_a_turn_either_way(tmp_path: Path) -> None:
    path = tmp_path / "free.xml"
    path.write_text('<mujoco><worldbody><body><joint/><body name="b" pos="1 0 0"/></body></worldbody></mujoco>')
    chain = read_mjcf(path)
    np.testing.assert_allclose([chain.lower[0], chain.upper[0]], [-np.pi, np.pi], rtol=1e-6)


def test_nothing_is_printed_and_no_log_is_left(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = _arm(tmp_path)
    for text in (ARM, ARM.replace(".3 0 0", "nan 0 0"), ARM.replace('pos="0 0 .2"', 'pos="0 0"')):
        _arm(tmp_path, text)
        try:
            robots.load(path)
        except BadInput:
            assert text != ARM
    assert capfd.readouterr() == ("", "")
    assert [p.name for p in tmp_path.iterdir()] == ["arm.xml"]


def test_a_warning_of_mujocos_is_kept_off_the_terminal_and_its_handler_put_back(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    before = mujoco.get_mju_user_warning()
    with mjcf._silent():  # a NaN is what MuJoCo warns of; a file with one never gets so far
        mujoco.MjModel.from_xml_string('<mujoco><worldbody><site pos="nan 0 0"/></worldbody></mujoco>')
    assert capfd.readouterr() == ("", "")
    assert not list(tmp_path.iterdir())
    assert mujoco.get_mju_user_warning() is before
