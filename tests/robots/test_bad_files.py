"""Files that can't be used: each is answered by one line with the file, the element and the remedy."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from toddle import robots
from toddle.failures import BadInput


def _joint(name: str, parent: str, child: str, *, kind: str = "revolute", inside: str | None = None) -> str:
    inside = '<limit lower="-1" upper="1"/>' if inside is None else inside
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{inside}</joint>'


def _robot(*joints: str, links: str = "abc") -> str:
    return f'<robot name="r">{"".join(f"<link name={link!r}/>" for link in links)}{"".join(joints)}</robot>'


FIRST = _joint("one", "a", "b")
LIMIT = '<limit lower="-1" upper="1"/>'


def _two(inside: str, kind: str = "revolute") -> str:
    """A sound joint, and a second one with this inside."""
    return _robot(FIRST, _joint("two", "b", "c", kind=kind, inside=inside))


BOMB = '<?xml version="1.0"?><!DOCTYPE r [<!ENTITY a "ha"><!ENTITY b "&a;&a;">]><robot name="&b;"/>'
STRANGER = '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="r"><link name="&x;"/></robot>'

URDF: dict[str, tuple[str | bytes, dict[str, Any], str]] = {
    # name: file, arguments, what the message must say
    "empty": ("", {}, "empty.*name a URDF"),
    "blank": (" \n ", {}, "empty"),
    "not xml": ("hello", {}, "not XML"),
    "cut off": ("<robot><link name='a'>", {}, "not XML"),
    "binary": (b"\x89PNG\r\n\x1a\n\x00\x00", {}, "not XML"),
    "not utf-8": (b"<?xml version='1.0' encoding='utf-8'?><robot name='\xff\xfe'/>", {}, "not XML"),
    "odd encoding": (b"<?xml version='1.0' encoding='klingon'?><robot/>", {}, "not XML"),
    "bomb": (BOMB, {}, "entities, which are refused.*DOCTYPE"),
    "document type": ("<!DOCTYPE robot><robot/>", {}, "document type or entities, which are refused"),
    "foreign entity": (STRANGER, {}, "entities, which are refused"),
    "another root": ("<sdf/>", {}, "<sdf>, neither <robot>.*nor <mujoco>"),
    "xacro": (
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="x"/></robot>',
        {},
        "xacro.*expand it",
    ),
    "no links": ("<robot name='r'/>", {}, "no link"),
    "no joints": (_robot(links="a"), {}, "no joint moves 'a' with respect to 'a'"),
    "nameless link": ("<robot><link/></robot>", {}, "<link> has no name"),
    "nameless joint": ("<robot><link name='a'/><joint type='fixed'/></robot>", {}, "<joint> has no name"),
    "twin links": (_robot(links="aa"), {}, "2 links are named 'a'"),
    "twin joints": (_robot(FIRST, _joint("one", "b", "c")), {}, "2 joints are named 'one'"),
    "no type": ('<robot><link name="a"/><joint name="one"/></robot>', {}, "joint 'one': no joint type"),
    "odd type": (
        _robot(_joint("one", "a", "b", kind="revolut"), links="ab"),
        {},
        "joint 'one'.*'revolut'.*mean revolute",
    ),
    "no parent": (
        '<robot><link name="a"/><joint name="one" type="fixed"><child link="a"/></joint></robot>',
        {},
        "joint 'one'.*no parent link.*<parent link=\"...\"/>",
    ),
    "no child": (
        '<robot><link name="a"/><joint name="one" type="fixed"><parent link="a"/></joint></robot>',
        {},
        "joint 'one'.*no child link",
    ),
    "unknown parent": (
        _robot(_joint("one", "z", "b"), links="ab"),
        {},
        "'one', its parent: no link named 'z'",
    ),
    "unknown child": (_robot(_joint("one", "a", "z"), links="ab"), {}, "'one', its child: no link named 'z'"),
    "two parents": (
        _robot(FIRST, _joint("two", "a", "c"), _joint("three", "c", "b")),
        {},
        "'b' has two parents, by joints 'one' and 'three': a loop.*remove",
    ),
    "ring": (_robot(FIRST, _joint("two", "b", "a"), links="ab"), {}, "form a loop"),
    "ring beside": (
        _robot(_joint("x", "b", "c"), _joint("y", "c", "b")),
        {},
        "links b -> c -> b form a loop",
    ),
    "own parent": (_robot(_joint("one", "a", "a"), links="a"), {}, "a -> a form a loop"),
    "two roots": (_robot(FIRST), {}, "'a' and 'c' are both roots"),
    "unknown tip": (_robot(FIRST, links="ab"), {"tip": "hand"}, "no link named 'hand'; known: a, b"),
    "nearly a tip": (
        '<robot><link name="left_hand"/></robot>',
        {"tip": "left_hnad"},
        "did you mean left_hand",
    ),
    "unknown base": (_robot(FIRST, links="ab"), {"base": "chest"}, "no link named 'chest'"),
    "which tip": (_robot(FIRST, _joint("two", "a", "c")), {}, "2 ends and no tip was named; name one: b, c"),
    "nothing moves": (
        _robot(_joint("one", "a", "b", kind="fixed"), links="ab"),
        {},
        "no joint moves 'b' with respect to 'a'",
    ),
    "tip is base": (_robot(FIRST, links="ab"), {"tip": "a"}, "no joint moves 'a'"),
    "unknown joint": (_two(LIMIT), {"joints": ["one", "tow"]}, "no joint named 'tow'; did you mean two"),
    "joint off the chain": (
        _two(LIMIT),
        {"joints": ["two"], "tip": "b"},
        "joint 'two' does not move the tip; known: one",
    ),
    "no chosen joints": (_two(LIMIT), {"joints": []}, "list of joints is empty; known: one, two"),
    "joint chosen twice": (_two(LIMIT), {"joints": ["one", "one"]}, "'one' is named twice"),
    "follower chosen": (
        _two(LIMIT + '<mimic joint="one"/>'),
        {"joints": ["two"]},
        "joint 'two' follows 'one'; known: one",
    ),
    "no limits": (_two(""), {}, "joint 'two': it has no limits; give it"),
    "empty limits": (_two('<limit effort="3"/>'), {}, "joint 'two': it has no limits"),
    "slider without limits": (_two("", "prismatic"), {}, "joint 'two': it has no limits"),
    "limits swapped": (_two('<limit lower="1" upper="-1"/>'), {}, "'two'.*lower limit 1 is not below.* -1"),
    "limits equal": (_two('<limit lower="1" upper="1"/>'), {}, "is not below"),
    "only a lower limit above zero": (_two('<limit lower="1"/>'), {}, "lower limit 1 is not below.* 0"),
    "limit nan": (
        _two('<limit lower="nan" upper="1"/>'),
        {},
        "joint 'two', <limit>, lower='nan': 'nan' is not a",
    ),
    "limit infinite": (_two('<limit lower="-1" upper="1e999"/>'), {}, "upper='1e999'.*finite"),
    "limit without end": (_two('<limit lower="-1" upper="3e38"/>'), {}, "upper='3e38': '3e38' is too large"),
    "limit a word": (_two('<limit lower="low" upper="1"/>'), {}, "'low' is not a finite number"),
    "origin nan": (_two(LIMIT + '<origin xyz="0 NaN 0"/>'), {}, "<origin>, xyz='0 NaN 0': 'NaN'"),
    "origin a word": (
        _two(LIMIT + '<origin rpy="0 pi 0"/>'),
        {},
        "<origin>, rpy.*'pi' is not a finite number",
    ),
    "origin too short": (_two(LIMIT + '<origin xyz="0 1"/>'), {}, "it has 2 numbers; give 3"),
    "origin too long": (_two(LIMIT + '<origin rpy="0 1 2 3"/>'), {}, "it has 4 numbers; give 3"),
    "fixed joint infinite": (
        _two('<origin xyz="inf 0 0"/>', "fixed"),
        {},
        "'two'.*'inf' is not a finite number",
    ),
    "axis zero": (_two(LIMIT + '<axis xyz="0 0 0"/>'), {}, "joint 'two', <axis>: its axis has no direction"),
    "axis too short": (_two(LIMIT + '<axis xyz="1 0"/>'), {}, "<axis>, xyz='1 0': it has 2 numbers"),
    "planar": (_two("", "planar"), {}, "joint 'two': it lies between base 'a' and tip 'c'.*neither"),
    "floating base": (
        _robot(_joint("one", "a", "b", kind="floating"), _joint("two", "b", "c")),
        {"base": "a"},
        "joint 'one'.*name a base beyond it, such as 'b'",
    ),
    "mimic of nobody": (_two(LIMIT + "<mimic/>"), {}, "joint 'two': its <mimic> names no joint"),
    "mimic of a stranger": (
        _two(LIMIT + '<mimic joint="on"/>'),
        {},
        "'two', its mimic: no joint named 'on'; did",
    ),
    "mimic of itself": (_two(LIMIT + '<mimic joint="two"/>'), {}, "circle: two -> two"),
    "mimic circle": (
        _robot(
            _joint("one", "a", "b", inside=LIMIT + '<mimic joint="two"/>'),
            _joint("two", "b", "c", inside=LIMIT + '<mimic joint="one"/>'),
        ),
        {},
        "circle: one -> two -> one; let one move by itself",
    ),
    "mimic of a fixed joint": (
        _robot(_joint("one", "a", "b", kind="fixed"), _joint("two", "b", "c", inside='<mimic joint="one"/>')),
        {},
        "it mimics 'one', which is not a joint of one axis",
    ),
    "mimic times a word": (_two('<mimic joint="one" multiplier="x"/>'), {}, "<mimic>, multiplier='x': 'x'"),
    "mimic nan": (_two('<mimic joint="one" offset="nan"/>'), {}, "<mimic>, offset='nan'"),
}


def _body(inside: str, beside: str = "") -> str:
    return f'<mujoco><worldbody><body name="a">{inside}</body></worldbody>{beside}</mujoco>'


HINGE = '<joint name="one" range="-90 90"/>'

MJCF: dict[str, tuple[str | bytes, dict[str, Any], str]] = {
    "no world": ("<mujoco/>", {}, "no <worldbody>"),
    "empty world": ("<mujoco><worldbody/></mujoco>", {}, "no joint moves 'world'"),
    "bomb": (BOMB.replace("robot", "mujoco"), {}, "entities, which are refused"),
    "unknown tip": (_body(HINGE), {"tip": "b"}, "no link named 'b'"),
    "which tip": (_body(HINGE + '<body name="b"/><body name="c"/>'), {}, "2 ends.*name one: b, c"),
    "unknown joint": (_body(HINGE), {"joints": ["two"]}, "no joint named 'two'"),
    "ball": (
        _body('<joint name="one" type="ball"/>'),
        {},
        "joint 'one': it lies between base 'world' and tip 'a'",
    ),
    "free": (
        _body('<freejoint name="one"/><body name="b">' + HINGE.replace("one", "two") + "</body>"),
        {"base": "world"},
        "joint 'one': it lies.*name a base beyond it, such as 'a'",
    ),
    "slider without range": (_body('<joint name="one" type="slide"/>'), {}, "joint 'one': it has no limits"),
    "range nan": (_body('<joint name="one" range="nan 1"/>'), {}, "<joint name='one'>, range='nan 1': 'nan'"),
    "range swapped": (
        _body('<joint name="one" range="2 1"/>'),
        {},
        "joint 'one': its lower limit .* is not below",
    ),
    "axis zero": (_body('<joint name="one" axis="0 0 0"/>'), {}, "MuJoCo can't read it: axis too small"),
    "anchor infinite": (_body('<joint name="one" pos="inf 0 0"/>'), {}, "'inf' is not a finite number"),
    "position a word": ('<mujoco><worldbody><body pos="here"/></worldbody></mujoco>', {}, "'here' is not a"),
    "position too short": (
        '<mujoco><worldbody><body pos="1 2"/></worldbody></mujoco>',
        {},
        "MuJoCo can't read it.*pos",
    ),
    "twin bodies": (_body('<body name="a"/>' + HINGE), {}, "MuJoCo can't read it: repeated name 'a'"),
    "twin joints": (_body(HINGE + HINGE), {}, "repeated name 'one'"),
    "unknown class": (_body('<joint class="zz"/>'), {}, "MuJoCo can't read it: unknown default.*zz"),
    "equality to a stranger": (
        _body(HINGE, '<equality><joint joint1="one" joint2="zz"/></equality>'),
        {},
        "MuJoCo can't read it.*zz",
    ),
    "two equalities": (
        _body(HINGE, '<equality><joint joint1="one"/><joint joint1="one"/></equality>'),
        {},
        "joint 'one': two equalities hold it",
    ),
    "circle of equalities": (
        _body(
            HINGE + HINGE.replace("one", "two"),
            '<equality><joint joint1="one" joint2="two"/><joint joint1="two" joint2="one"/></equality>',
        ),
        {},
        "circle: one -> two -> one",
    ),
    "include outside": (
        '<mujoco><include file="../other.xml"/></mujoco>',
        {},
        "<include file='../other.xml'>: it lies outside",
    ),
    "include by full path": (
        '<mujoco><include file="/etc/passwd"/></mujoco>',
        {},
        "outside the model's own folder",
    ),
    "include missing": ('<mujoco><include file="part.xml"/></mujoco>', {}, "part.xml: no such file"),
    "include nameless": ("<mujoco><include/></mujoco>", {}, "it names no file; write"),
    "include itself": ('<mujoco><include file="robot.urdf"/></mujoco>', {}, "included twice"),
    "attach": (_body(HINGE + '<attach model="m"/>'), {}, "<attach> is not read.*mj_saveLastXML"),
    "replicate": (_body(HINGE + '<replicate count="99999999"/>'), {}, "<replicate> is not read"),
    "too deep": (_body("<body>" * 600 + "</body>" * 600), {}, "nested more than 150 deep"),
}


def _message(call: Callable[[], object]) -> str:
    with pytest.raises(BadInput) as caught:
        call()
    message = str(caught.value)
    assert "\n" not in message
    assert caught.value.remedy
    assert len(message) < 600
    return message


FAULTS = [*(("urdf", name) for name in URDF), *(("mjcf", name) for name in MJCF)]


@pytest.mark.parametrize("fault", FAULTS, ids=" ".join)
def test_a_bad_file_is_answered_by_one_line(
    tmp_path: Path, fault: tuple[str, str], capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    text, chosen, says = (URDF if fault[0] == "urdf" else MJCF)[fault[1]]
    path = tmp_path / "robot.urdf"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    monkeypatch.chdir(tmp_path)  # where MuJoCo would leave its log
    message = _message(lambda: robots.load(path, **chosen))
    assert re.search(says, message), message
    assert str(tmp_path) in message
    assert capfd.readouterr() == ("", "")
    assert list(tmp_path.iterdir()) == [path]


def test_no_file(tmp_path: Path) -> None:
    assert "no such file; check the path" in _message(lambda: robots.load(tmp_path / "none.urdf"))
    assert "this is a folder" in _message(lambda: robots.load(tmp_path))
    assert "no such file" in _message(lambda: robots.load("arm\0.urdf"))
    assert "can't be read" in _message(lambda: robots.load("a" * 300 + ".urdf"))


def test_a_file_that_is_too_large_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "huge.urdf"
    with path.open("wb") as file:
        file.truncate(10**12)
    assert "1000000 MB, more than 20" in _message(lambda: robots.load(path))


def test_an_include_that_leads_outside_by_a_link_is_refused(tmp_path: Path) -> None:
    (tmp_path / "secret.xml").write_text("<mujocoinclude/>")
    (tmp_path / "model").mkdir()
    (tmp_path / "model" / "part.xml").symlink_to(tmp_path / "secret.xml")
    path = tmp_path / "model" / "arm.xml"
    path.write_text('<mujoco><include file="part.xml"/></mujoco>')
    assert "outside the model's own folder" in _message(lambda: robots.load(path))


def test_files_that_include_each_other_are_refused(tmp_path: Path) -> None:
    for name, other in (("a.xml", "b.xml"), ("b.xml", "c.xml"), ("c.xml", "b.xml")):
        (tmp_path / name).write_text(f'<mujoco><include file="{other}"/></mujoco>')
    assert "included twice" in _message(lambda: robots.load(tmp_path / "a.xml"))


def test_a_fault_that_does_not_move_the_tip_stands_in_nobodys_way(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(_two('<limit lower="nan"/><origin xyz="x"/>'))
    assert robots.load(path, tip="b").joints == ("one",)


def test_a_deep_or_long_robot_is_read_in_time(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    count = 600
    links = "".join(f'<link name="l{i}"/>' for i in range(count + 1))
    joints = "".join(_joint(f"j{i}", f"l{i}", f"l{i + 1}", kind="fixed") for i in range(count - 1))
    last = _joint("last", f"l{count - 1}", f"l{count}")
    path.write_text(f"<robot>{links}{joints}{last}</robot>")
    assert robots.load(path).joints == ("last",)
    path.write_text("<robot>" + "<link>" * 10**5 + "</link>" * 10**5 + "</robot>")
    assert "<link> has no name" in _message(lambda: robots.load(path))
