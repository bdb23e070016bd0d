"""What cannot work is refused before anything moves: one line that names file, key and remedy."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

import numpy as np
import pytest
from robots.humanoids.made import Order, text, urdf

from toddle.failures import BadInput
from toddle.robots.humanoids import load_humanoid
from toddle.robots.humanoids.config import read_settings
from toddle.robots.humanoids.meshes import read_by_mujoco, vertices


def part(robot: Element, tag: str, name: str) -> Element:
    return next(element for element in robot.findall(tag) if element.get("name") == name)


def no_mesh(robot: Element) -> None:
    geometry = part(robot, "link", "left_knee_link").find("collision/geometry")
    assert geometry is not None
    geometry.clear()
    SubElement(geometry, "mesh", filename="package://made/meshes/knee.stl")


def no_limit(robot: Element) -> None:
    joint = part(robot, "joint", "left_knee")
    joint.remove(joint.findall("limit")[0])


def endless(robot: Element) -> None:
    part(robot, "joint", "right_knee").set("type", "continuous")


def exchanged(robot: Element) -> None:
    part(robot, "joint", "left_knee").findall("limit")[0].set("lower", "3")


def no_mass(robot: Element) -> None:
    part(robot, "link", "left_knee_link").findall("inertial/mass")[0].set("value", "0")


def negative_mass(robot: Element) -> None:
    part(robot, "link", "trunk").findall("inertial/mass")[0].set("value", "-1")


def no_number(robot: Element) -> None:
    part(robot, "link", "trunk").findall("inertial/mass")[0].set("value", "nan")


def no_link(robot: Element) -> None:
    part(robot, "joint", "left_knee").findall("child")[0].set("link", "left_kne_link")


def two_roots(robot: Element) -> None:
    SubElement(robot, "link", name="lonely")


def circle(robot: Element) -> None:
    part(robot, "joint", "waist_yaw").findall("parent")[0].set("link", "trunk")


def two_parents(robot: Element) -> None:
    part(robot, "joint", "left_knee").findall("child")[0].set("link", "trunk")


def twins(robot: Element) -> None:
    SubElement(robot, "link", name="trunk")


def one_foot(robot: Element) -> None:
    part(robot, "joint", "left_ankle_roll").set("type", "fixed")


def sliding(robot: Element) -> None:
    for side in ("left", "right"):
        part(robot, "joint", f"{side}_hip_yaw").set("type", "prismatic")


def no_feet(robot: Element) -> None:
    for link in robot.findall("link"):
        if "ankle" in link.get("name", ""):
            link.remove(link.findall("collision")[0])


@pytest.mark.parametrize(
    ("spoil", "parts"),
    [
        (no_mesh, ("left_knee_link", "knee.stl", "missing")),
        (no_limit, ("left_knee", "no limits", "<limit")),
        (endless, ("right_knee", "no limits")),
        (exchanged, ("left_knee", "above")),
        (no_mass, ("left_knee_link", "mass is 0", "positive")),
        (negative_mass, ("trunk", "mass is -1")),
        (no_number, ("trunk", "nan")),
        (no_link, ("left_knee", "left_kne_link", "did you mean left_knee_link")),
        (two_roots, ("2 links without a parent", "lonely")),
        (circle, ("circle", "trunk")),
        (two_parents, ("trunk", "two joints")),
        (twins, ("trunk", "twice")),
        (one_foot, ("left_foot", "right_foot")),
        (sliding, ("left_hip_yaw", "no hinge")),
        (no_feet, ("no geometry", "sole_length")),
    ],
)
def test_a_spoiled_description(tmp_path: Path, spoil: Callable[[Element], None], parts: tuple[str, ...]) -> None:
    robot = urdf(Order())
    spoil(robot)
    file = tmp_path / "spoiled.urdf"
    file.write_text(text(robot))
    with pytest.raises(BadInput) as failure:
        load_humanoid(str(file))
    for expected in ("spoiled.urdf", *parts):
        assert expected in failure.value.line
    assert "\n" not in failure.value.line


@pytest.mark.parametrize(
    ("said", "parts"),
    [
        ("com_heigth = 0.4", ("robot.toml", "com_heigth", "did you mean com_height")),
        ("com_height = 'high'", ("com_height", "'high'", "number")),
        ("com_height = nan", ("com_height", "nan")),
        ("com_height = true", ("com_height", "True")),
        ("com_height = -1", ("com_height", "above 0")),
        ("com_height = 2.0", ("com_height", "2.000", "can't stand", "straight")),
        ("com_height = 0.1", ("com_height", "can't stand", "at their limits", "left_knee")),
        ("foot_distance = 0.9", ("apart", "foot_distance")),
        ("hull = [[-0.9, 0.1], [-0.9, 0.3], [0.9, 0.3], [0.9, 0.1]]", ("hull", "-0.9", "legs")),
        ("hull = [[-0.1, 0.1], [0.1, 0.1], [0.1, 0.3]]", ("hull", "clockwise")),
        ("hull = [1, 2, 3]", ("hull",)),
        ("margin = [0.02]", ("margin", "2 numbers")),
        ("margin = [0.2, 0.02]", ("margin", "sole")),
        ("double_support = 3", ("double_support", "step_time")),
        ("preview = 2.5", ("preview", "whole")),
        (
            "left_foot = 'left_ankle_roll_lnk'\nright_foot = 'right_ankle_roll_link'",
            ("left_foot", "left_ankle_roll_link"),
        ),
        ("left_foot = 'left_ankle_roll_link'", ("right_foot",)),
        ("left_foot = 'trunk'\nright_foot = 'right_ankle_roll_link'", ("legs", "1 and 6")),
        ("left_foot = 3", ("left_foot", "quotes")),
        ("imu = 'imu_link'", ("imu", "imu_link")),
        ("waist = 'hip'", ("waist", "hip")),
        ("moves = ['waist_yw']", ("moves", "did you mean waist_yaw")),
        ("moves = 'waist_yaw'", ("moves", "brackets")),
        ("without = ['tail']", ("without", "tail")),
        ("base = 'root'", ("base", "root")),
        ("forward = '-x'", ("forward", "exchange")),
        ("forward = 'north'", ("forward", "north")),
        ("com_height 0.4", ("robot.toml", "TOML")),
    ],
)
def test_a_wrong_configuration(tmp_path: Path, said: str, parts: tuple[str, ...]) -> None:
    (tmp_path / "made.urdf").write_text(text(urdf(Order())))
    config = tmp_path / "robot.toml"
    config.write_text(said)
    with pytest.raises(BadInput) as failure:
        load_humanoid(str(tmp_path / "made.urdf"), config)
    for expected in ("robot.toml", *parts):
        assert expected in failure.value.line
    assert "\n" not in failure.value.line


def test_a_configuration_says_it_all(tmp_path: Path) -> None:
    (tmp_path / "made.urdf").write_text(text(urdf(Order())))
    config = tmp_path / "robot.toml"
    config.write_text(
        "model = 'made.urdf'\nname = 'mine'\nsole_length = 0.15\nsole_ahead = 0\ncom_height = 0.54\nstep_time = 0.7\n"
        "moves = ['waist_yaw']\nchest = 'trunk'\nforward = 'x'\nfastest = [0.2, 0.05, 0.1]\n"
        "stiffness = 1000\nsteps = 2\n"
        "hull = [[-0.1, 0.14], [-0.1, 0.2], [0.1, 0.2], [0.1, 0.14]]\nmargin = [0.01, 0.01]\ndouble_support = 0.2\n"
    )
    human = load_humanoid(str(config))
    gait = human.gait
    assert (human.name, gait.foot_length, gait.foot_ahead, gait.com_height) == ("mine", 0.15, 0, 0.54)
    assert (gait.step_time, gait.steps, gait.double_support, gait.fastest.vx) == (0.7, 2, 0.2, 0.2)
    assert gait.hull[0] == (-0.1, 0.14)
    assert human.moves.all()
    assert (human.stiffness == 1000).all()
    assert (human.damping == 20).all()


def test_a_configuration_goes_before_the_catalogue(tmp_path: Path) -> None:
    config = tmp_path / "slow.toml"
    config.write_text("step_time = 0.9\n")
    slow, usual = load_humanoid("heicub", config), load_humanoid("heicub")
    assert (slow.gait.step_time, slow.gait.hull) == (0.9, usual.gait.hull)
    assert slow.joints == usual.joints


@pytest.mark.parametrize("spec", ["heicup", "nowhere.urdf", "nowhere.toml", "hrp2"])
def test_no_such_humanoid(spec: str) -> None:
    with pytest.raises(BadInput) as failure:
        load_humanoid(spec)
    assert spec in failure.value.line


def test_an_arm_is_no_humanoid() -> None:
    from toddle.robots.catalogue import MODELS

    with pytest.raises(BadInput, match="feet are not found"):
        load_humanoid(str(MODELS / "nicu.urdf"))


def test_a_configuration_needs_a_model(tmp_path: Path) -> None:
    (tmp_path / "robot.toml").write_text("name = 'x'\n")
    with pytest.raises(BadInput, match="'model' is missing"):
        load_humanoid(str(tmp_path / "robot.toml"))
    assert read_settings(tmp_path / "robot.toml")[1].name == "x"


CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 2.0)])
DAE = """<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="0.1"/><up_axis>{up}</up_axis></asset><library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="24">{numbers}</float_array></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><translate>5 0 0</translate><rotate>0 0 1 90</rotate>
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes></COLLADA>"""


@pytest.mark.parametrize(
    ("up", "low", "high"),
    [("Z_UP", (0.4, 0, 0), (0.5, 0.1, 0.2)), ("Y_UP", (0.4, -0.2, 0), (0.5, 0, 0.1))],
)
def test_collada_is_placed_scaled_and_set_upright(
    tmp_path: Path, up: str, low: tuple[float, ...], high: tuple[float, ...]
) -> None:
    file = tmp_path / "cube.dae"
    file.write_text(DAE.format(up=up, numbers=" ".join(str(number) for number in CUBE.ravel())))
    found = vertices(file, "here")
    np.testing.assert_allclose(found.min(axis=0), low, atol=1e-12)
    np.testing.assert_allclose(found.max(axis=0), high, atol=1e-12)
    assert not read_by_mujoco(file)


def test_stl_as_text_and_as_bytes(tmp_path: Path) -> None:
    faces = [CUBE[[0, 1, 2]], CUBE[[1, 2, 7]]]
    words = tmp_path / "text.stl"
    lines = [f"vertex {p[0]} {p[1]} {p[2]}" for face in faces for p in face]
    words.write_text("solid cube\nfacet normal 0 0 1\nouter loop\n" + "\n".join(lines) + "\nendsolid\n")
    binary = tmp_path / "binary.stl"
    records = b"".join(struct.pack("<12fH", 0, 0, 1, *face.ravel(), 0) for face in faces)
    binary.write_bytes(b"\0" * 80 + struct.pack("<I", len(faces)) + records)
    np.testing.assert_array_equal(vertices(words, ""), vertices(binary, ""))
    assert read_by_mujoco(binary)
    assert not read_by_mujoco(words)


def test_a_broken_mesh(tmp_path: Path) -> None:
    for name in ("broken.dae", "broken.stl", "broken.ply"):
        (tmp_path / name).write_text("nonsense")
        with pytest.raises(BadInput, match=r"broken|ply"):
            vertices(tmp_path / name, "here")
