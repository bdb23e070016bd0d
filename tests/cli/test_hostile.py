"""Hundreds of calls that can't be answered: each gets one line and exit code 2, and nothing is written.

Every call runs in one folder of bad things; a picture of that folder before and after tells whether it was touched.
"""

from __future__ import annotations

import os
import pickle
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
import tiny
from damage import DAMAGES, forged, forged_tensors

from toddle.cli import main

Call = tuple[tuple[str, ...], str]
"""The words after ``toddle``, and what the answer must say."""


def urdf(*joints: str, links: str = "abc") -> str:
    return f'<robot name="r">{"".join(f"<link name={link!r}/>" for link in links)}{"".join(joints)}</robot>'


def joint(
    name: str, parent: str, child: str, inside: str = '<limit lower="-1" upper="1"/>', kind: str = "revolute"
) -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{inside}</joint>'


def bent(inside: str, kind: str = "revolute") -> str:
    """A sound joint, and a second one with this inside."""
    return urdf(joint("one", "a", "b"), joint("two", "b", "c", inside, kind))


def mjcf(inside: str, *, more: str = "") -> str:
    """A hinge on the world, and a body with this inside on it."""
    hinge = '<joint name="one" range="-1 1" limited="true" axis="0 0 1"/>'
    return (
        f'<mujoco model="m"><worldbody><body name="a">{hinge}<body name="b" pos="1 0 0">{inside}</body></body>'
        f"</worldbody>{more}</mujoco>"
    )


LIMIT = '<limit lower="-1" upper="1"/>'
BOMB = (
    '<?xml version="1.0"?><!DOCTYPE r [<!ENTITY a "haha">'
    + "".join(f'<!ENTITY {b} "{10 * f"&{a};"}">' for a, b in zip("abcdefgh", "bcdefghi", strict=True))
    + ']><robot name="&i;"/>'
)
STRANGER = '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="&x;"/>'
RING = joint("one", "a", "b"), joint("two", "b", "c"), joint("three", "c", "a")

FILES: dict[str, tuple[str | bytes, str]] = {
    "empty.urdf": ("", "empty"),
    "blank.urdf": ("\n\t \n", "empty"),
    "prose.urdf": ("The robot is in another castle.", "not XML"),
    "json.urdf": ('{"robot": []}', "not XML"),
    "zeros.urdf": (bytes(4096), "not XML"),
    "bytes.urdf": (bytes(range(256)), "not XML"),
    "picture.urdf": (b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR", "not XML"),
    "pickle.urdf": (pickle.dumps({"robot": 1}), "not XML"),
    "cut.urdf": (tiny.ARM[:200], "not XML"),
    "twice.urdf": (2 * tiny.ARM, "not XML"),
    "klingon.urdf": (b"<?xml version='1.0' encoding='klingon'?><robot/>", "not XML"),
    "latin.urdf": (b"<?xml version='1.0' encoding='utf-8'?><robot name='\xff\xfe'/>", "not XML"),
    "unclosed.urdf": ("<robot><link name='a'></robot>", "not XML"),
    "bomb.urdf": (BOMB, "entities, which are refused"),
    "stranger.urdf": (STRANGER, "entities, which are refused"),
    "doctype.urdf": ("<!DOCTYPE robot><robot/>", "entities, which are refused"),
    "deep.urdf": ("<robot>" + 30_000 * "<link name='a'>" + 30_000 * "</link>" + "</robot>", ""),
    "html.urdf": ("<html><body>404</body></html>", "<html>"),
    "sdf.urdf": ("<sdf/>", "<sdf>"),
    "xacro.urdf": ('<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="x"/></robot>', "xacro"),
    "no-links.urdf": ("<robot name='r'/>", "no link"),
    "no-joints.urdf": (urdf(links="a"), "no joint moves"),
    "all-fixed.urdf": (urdf(joint("one", "a", "b", "", "fixed"), links="ab"), "no joint moves"),
    "nameless.urdf": ("<robot><link/></robot>", "no name"),
    "twin-links.urdf": (urdf(links="aa"), "2 links are named"),
    "twin-joints.urdf": (urdf(joint("one", "a", "b"), joint("one", "b", "c")), "2 joints are named"),
    "no-limits.urdf": (bent(""), "two"),
    "half-limits.urdf": (bent("<limit/>"), "two"),
    "equal-limits.urdf": (bent('<limit lower="1" upper="1"/>'), "two"),
    "turned-limits.urdf": (bent('<limit lower="1" upper="-1"/>'), "two"),
    "nan-limit.urdf": (bent('<limit lower="nan" upper="1"/>'), "not a finite number"),
    "inf-limit.urdf": (bent('<limit lower="-inf" upper="1"/>'), "not a finite number"),
    "huge-limit.urdf": (bent('<limit lower="-1e300" upper="1"/>'), "too large"),
    "word-limit.urdf": (bent('<limit lower="low" upper="1"/>'), "not a finite number"),
    "hex-limit.urdf": (bent('<limit lower="0x1" upper="1"/>'), "not a finite number"),
    "nan-origin.urdf": (bent(f'{LIMIT}<origin xyz="0 nan 0"/>'), "not a finite number"),
    "short-origin.urdf": (bent(f'{LIMIT}<origin xyz="0 0"/>'), "2 numbers"),
    "huge-origin.urdf": (bent(f'{LIMIT}<origin xyz="0 0 1e39"/>'), "too large"),
    "nan-turn.urdf": (bent(f'{LIMIT}<origin rpy="0 nan 0"/>'), "not a finite number"),
    "zero-axis.urdf": (bent(f'{LIMIT}<axis xyz="0 0 0"/>'), "no direction"),
    "nan-axis.urdf": (bent(f'{LIMIT}<axis xyz="nan 0 0"/>'), "not a finite number"),
    "long-axis.urdf": (bent(f'{LIMIT}<axis xyz="0 0 1 0"/>'), "4 numbers"),
    "unknown-parent.urdf": (urdf(joint("one", "z", "b")), "'z'"),
    "no-parent.urdf": (urdf('<joint name="one" type="fixed"><child link="b"/></joint>'), "no parent"),
    "no-child.urdf": (urdf('<joint name="one" type="fixed"><parent link="a"/></joint>'), "no child"),
    "odd-type.urdf": (bent(LIMIT, "revolut"), "did you mean revolute"),
    "floating.urdf": (bent(LIMIT, "floating"), "two"),
    "planar.urdf": (bent(LIMIT, "planar"), "two"),
    "ring.urdf": (urdf(*RING), "loop"),
    "own-parent.urdf": (urdf(joint("one", "a", "a")), "loop"),
    "two-parents.urdf": (urdf(joint("one", "a", "c"), joint("two", "b", "c")), "two parents"),
    "two-trees.urdf": (urdf(joint("one", "a", "b"), joint("two", "c", "d"), links="abcd"), "roots"),
    "two-ends.urdf": (urdf(joint("one", "a", "b"), joint("two", "a", "c")), "no tip was named"),
    "mimics-none.urdf": (bent(f"{LIMIT}<mimic/>"), "mimic"),
    "mimics-stranger.urdf": (bent(f'{LIMIT}<mimic joint="who"/>'), "who"),
    "mimics-itself.urdf": (bent(f'{LIMIT}<mimic joint="two"/>'), "two"),
    "mimics-nan.urdf": (bent(f'{LIMIT}<mimic joint="one" multiplier="nan"/>'), "not a finite number"),
    "still-tip.urdf": (bent(""), "two"),
    "empty.xml": ("<mujoco/>", ""),
    "cut.xml": ("<mujoco><worldbody>", "not XML"),
    "no-joint.xml": ('<mujoco><worldbody><body name="a"/></worldbody></mujoco>', "no joint moves"),
    "nan-range.xml": (mjcf('<joint name="two" range="nan 1" limited="true"/>'), ""),
    "nan-place.xml": (mjcf('<joint name="two" pos="0 nan 0"/>'), ""),
    "zero-axis.xml": (mjcf('<joint name="two" axis="0 0 0"/>'), ""),
    "odd-type.xml": (mjcf('<joint name="two" type="hing"/>'), "MuJoCo can't read it"),
    "ball.xml": (mjcf('<joint name="two" type="ball"/>'), "two"),
    "free-slide.xml": (mjcf('<joint name="two" type="slide"/>'), "two"),
    "twins.xml": (mjcf('<body name="a"/>'), ""),
    "includes.xml": (mjcf('<include file="/etc/passwd"/>'), ""),
    "includes-itself.xml": (mjcf('<include file="includes-itself.xml"/>'), ""),
    "includes-nothing.xml": (mjcf('<include file="nowhere.xml"/>'), ""),
    "bomb.xml": (BOMB.replace("robot", "mujoco"), "entities, which are refused"),
    "polynomial.xml": (
        mjcf(
            '<joint name="two" range="-1 1" limited="true"/>',
            more='<equality><joint joint1="two" joint2="one" polycoef="0 1 1 0 0"/></equality>',
        ),
        "straight line",
    ),
}

ROBOTS: dict[str, str] = {
    "nicoo": "nicu",
    "NICU": "no robot named",
    "planar": "N is ''",
    "planar:": "N is ''",
    "planar:0": "from 1 to",
    "planar:-3": "N is '-3'",
    "planar:x": "N is 'x'",
    "planar:3:4": "N is '3:4'",
    "planar:1e2": "N is '1e2'",
    "planar:３": "N is '３'",
    "planar:201": "from 1 to",
    "planar:99999999999999999999": "N is",
    "": "empty",
    " ": "empty",
    "a\0b": "NUL",
    "a\nb": "no robot named",
    "a\x1b[31mb\x07": "no robot named",
    "рука": "no robot named",
    "🤖": "no robot named",
    "\udcff.urdf": "no such file",
    "x" * 5000: "",
    "x" * 300 + ".urdf": "",
    "no/such/arm.urdf": "no such file",
    "arm.urdf/inside": "no such file",
    "https://example.org/arm.urdf": "no such file",
    "package://arm/arm.urdf": "no such file",
    ".": "folder",
    "..": "folder",
    "/": "folder",
    "folder.urdf": "folder",
    "pipe.urdf": "no such file",
    "loop.urdf": "no such file",
    "nowhere.urdf": "no such file",
    "large.urdf": "more than 20",
    "/dev/null": "no such file",
    "/dev/zero": "no such file",
    "/proc/self/mem": "",
}

NUMBERS = {
    "nan": "finite", "inf": "finite", "-inf": "finite", "1e999": "finite", "-1": "range", "0": "range",
    "1e9": "range", "": "not a number", "ten": "not a number", "1,5": "not a number", "0x10": "not a number",
}  # fmt: skip
COUNTS = {
    "nan": "finite", "inf": "finite", "-1": "range", "1e30": "range", "1.5": "not a whole number",
    "": "not a number", "many": "not a number", "1" * 5000: "finite",
}  # fmt: skip
OPTIONS: dict[str, dict[str, str]] = {
    "--learning-rate": NUMBERS,
    "--perturbation": NUMBERS,
    "--test-spacing": NUMBERS,
    "--samples": COUNTS | {"0": "range"},
    "--seed": COUNTS,
    "--per-cycle": COUNTS | {"0": "range"},
    "--test-points": COUNTS | {"0": "range"},
    "--hidden": {"nan": "finite", "-3": "range", "1.5": "whole", "": "not a number", "5000": "range", "two": "not a"},
    "--method": {"goal-and-motor-babling": "did you mean", "": "empty", "x\0y": "NUL", "magic": "no method"},
    "--learner": {"perceptrn": "did you mean perceptron", "": "empty", "magic": "no learner"},
    "--network": {"deep": "no choice", "": "no choice", "plian": "did you mean plain"},
    "--reading": {"loose": "no choice", "": "no choice"},
    "--plant": {"gazebo": "no choice", "": "no choice", "Physics": "did you mean physics"},
    "--tip": {"": "empty", "hand": "can't be chosen"},
    "--base": {"": "empty", "floor": "can't be chosen"},
    "--joints": {"": "empty", "joint_1": "can't be chosen"},
    "--out": {
        "": "empty", "arm.urdf": "no folder", "arm.urdf/run": "no folder", "run": "--resume run",
        "skill": "written over", "taken": "its error.png would be written over", "loop.urdf": "no folder",
        "nowhere.urdf": "no folder", "/dev/null": "no folder", "/proc/run": "no folder", "y" * 300: "no folder",
        "new/" + "y" * 300: "no folder", "/proc": "written into",
    },
}  # fmt: skip
NOISE = ("", "1", "mm", "-1mm", "1km", "nanmm", "inf", "1e3mm", "1 mm", "1mm2", "2m", "9" * 400 + "mm", "one mm")
TARGETS: dict[tuple[str, ...], str] = {
    ("nan", "0"): "finite",
    ("inf", "0"): "finite",
    ("0", "-inf"): "finite",
    ("1e999", "0"): "finite",
    ("1e300", "0"): "finite",
    ("1e7", "0"): "finite",
    ("1e5", "0"): "out of reach",
    ("5", "5"): "out of reach",
    ("-1", "0"): "out of reach",
    (): "needs a value",
    ("1",): "give 2 coordinates",
    ("1", "0", "0"): "give 2 coordinates",
    ("1", "0", "0", "0"): "give 2 coordinates",
    ("1",) * 500: "give 2 coordinates",
    ("",): "not a number",
    ("there",): "not a number",
    ("1,0",): "not a number",
    ("[1", "0]"): "not a number",
    ("1m", "0"): "not a number",
    ("0x1", "0"): "not a number",
}
ASK: tuple[str, ...] = ("--skill", "skill", "--target", "0.5", "0.5")
SETTLED = (
    ("--method", "motor-babbling"), ("--learner", "perceptron"), ("--seed", "1"), ("--hidden", "3"), ("--out", "new"),
    ("--learning-rate", "0.1"), ("--perturbation", "0.1"), ("--test-points", "5"), ("--test-spacing", "0.1"),
    ("--per-cycle", "5"), ("--network", "plain"), ("--reading", "literal"),
    ("--tip", "hand"), ("--base", "floor"), ("--joints", "turn"),
)  # fmt: skip

WORDS: dict[str, Call] = {
    "no robot": ((), "no robot is named"),
    "only --json": (("--json",), "no robot is named"),
    "two robots": (("planar:2", "planar:3"), "one word too many"),
    "misspelt option": (("planar:2", "--smaples", "5"), "did you mean --samples"),
    "British option": (("planar:2", "--colour", "red"), "no option named"),
    "capital option": (("planar:2", "--Samples", "5"), "no option named"),
    "underscored option": (("planar:2", "--learning_rate", "1"), "--learning-rate"),
    "short option": (("planar:2", "-s", "5"), "no option named"),
    "abbreviated option": (("planar:2", "--samp", "5"), "no option named"),
    "two dashes": (("planar:2", "--"), "no option named"),
    "three dashes": (("planar:2", "---samples", "5"), "no option named"),
    "an option twice": (("planar:2", "--seed", "1", "--seed", "1"), "given twice"),
    "a flag twice": (("planar:2", "--json", "--json"), "given twice"),
    "a flag with a value": (("planar:2", "--json=yes"), "takes no value"),
    "an option without its value": (("planar:2", "--samples", "--json"), "needs a value"),
    "the last option without its value": (("planar:2", "--out"), "needs a value"),
    "no joints": (("planar:2", "--joints"), "needs a value"),
    "nine layers": (("planar:2", "--hidden", *"123456789"), "8 or fewer"),
    "an empty layer": (("planar:2", "--hidden", "10", "0"), "range"),
    "unknown tip": (("arm.urdf", "--tip", "hnad"), "did you mean hand"),
    "unknown base": (("arm.urdf", "--base", "flor"), "did you mean floor"),
    "unknown joint": (("arm.urdf", "--joints", "trun"), "turn"),
    "a joint twice": (("arm.urdf", "--joints", "turn", "turn"), "twice"),
    "a fixed joint": (("arm.urdf", "--joints", "end"), "end"),
    "a tip that stands still": (("arm.urdf", "--tip", "floor"), "floor"),
    "a tip on its axis": (("arm.urdf", "--tip", "post"), "no joint moves"),
    "a soft arm in physics": (("bha", "--plant", "physics"), "no physics"),
    "noise without physics": (("planar:2", "--noise", "1mm", "--hidden", "4"), "only physics"),
    "noise in kinematics": (("planar:2", "--noise=1mm", "--hidden=4", "--plant", "kinematics"), "only physics"),
    "hidden layers of a map": (("planar:2", "--learner", "local-linear", "--hidden", "5"), "has no hidden layers"),
    "a robot and a skill": (("planar:2", *ASK), "exclude each other"),
    "a robot and a run": (("planar:2", "--resume", "run"), "exclude each other"),
    "a skill and a run": ((*ASK, "--resume", "run"), "exclude each other"),
    "a target of no skill": (("--target", "1", "0", "1"), "--skill is missing"),
    "a skill without target": (("--skill", "skill"), "--target is missing"),
    "a robot with a target": (("planar:2", "--target", "1", "0"), "--skill FOLDER"),
    "a robot with looks": (("planar:2", "--looks", "2"), "doesn't go with a robot"),
    "a robot with tolerance": (("planar:2", "--tolerance", "1"), "doesn't go with a robot"),
    "a run with a target": (("--resume", "run", "--target", "1", "0", "1"), "doesn't go with"),
    "a run with noise": (("--resume", "run", "--noise", "1mm"), "settled"),
    "a run in physics": (("--resume", "run", "--plant", "physics"), "settled"),
    "a skill with samples": ((*ASK, "--samples", "5"), "settled"),
    "noise of kinematics": ((*ASK, "--noise", "1mm"), "only physics"),
    "a finished run": (("--resume", "run"), "ask for more with --samples"),
    "a run that came further": (("--resume", "run", "--samples", "100"), "ask for more with --samples"),
    "a run to nowhere": (("--resume", "run", "--samples", "-1"), "range"),
    "a run to infinity": (("--resume", "run", "--samples", "inf"), "finite"),
    "a run of another arm": (("--resume", "arm-arm", "--samples", "500"), "does not fit this robot"),
    "a run of a lost arm": (("--resume", "lost-arm", "--samples", "500"), "no such file"),
    "a skill of another arm": (("--skill", "arm-arm", *ASK[2:]), "aren't those of the skill"),
    "a skill of a lost arm": (("--skill", "lost-arm", *ASK[2:]), "no such file"),
    "a run as a skill": (("--skill", "run-as-skill", *ASK[2:]), "it is a toddle run"),
    "a skill as a run": (("--resume", "skill-as-run"), "it is a toddle skill"),
    "tensors of another skill": (("--skill", "swapped", *ASK[2:]), "altered"),
}


def _folders() -> dict[str, Call]:
    """Skills and runs that are damaged, or are none."""
    calls: dict[str, Call] = {}
    for kind, flag, rest in (("skill", "--skill", ASK[2:]), ("run", "--resume", ())):
        places = {
            "": "empty", "nowhere": f"there is no {kind}", "arm.urdf": "it is no folder", "hollow": "there is no",
            "/dev/null": "it is no folder", "loop.urdf": "can't be read", "z" * 300: "can't be read",
            "\udcff": "there is no", "a\nb": "there is no", f"{kind}/{kind}.json": "it is no folder",
        }  # fmt: skip
        for place, says in places.items():
            calls[f"{flag} {place[:20]!r}"] = (flag, place, *rest), says
        for name, (_, says) in DAMAGES.items():
            calls[f"{flag}, {name}"] = (flag, f"damaged/{kind}, {name}", *rest), says
    return calls


def _calls() -> dict[str, Call]:
    calls: dict[str, Call] = {name: ((name,), says) for name, (_, says) in FILES.items()}
    calls |= {repr(spec[:20]): ((spec,), says) for spec, says in ROBOTS.items()}
    for flag, values in OPTIONS.items():
        robot = ("planar:2", "--test-points=20", "--hidden=4") if flag == "--out" else ("planar:2",)
        calls |= {f"{flag} {v[:20]!r}": ((*robot, flag, v), says) for v, says in values.items()}
    calls |= {f"--noise {v[:20]!r}": (("planar:2", "--plant=physics", "--noise", v), "--noise") for v in NOISE}
    for words, says in TARGETS.items():
        calls[f"--target {' '.join(words)[:30]!r}"] = (("--skill", "skill", "--target", *words), says)
    for value in ("nan", "inf", "-1", "0", "", "small", "1mm"):
        calls[f"--tolerance {value!r}"] = ((*ASK, "--tolerance", value), "--tolerance")
    for value in ("nan", "-1", "1.5", "1e9", "", "often"):
        calls[f"--looks {value!r}"] = ((*ASK, "--looks", value), "--looks")
    for flag, value in SETTLED:
        calls[f"--resume and {flag}"] = (("--resume", "run", flag, value), "settled")
        calls[f"--skill and {flag}"] = ((*ASK, flag, value), "settled")
    calls |= WORDS | _folders()
    return {name: (("reach", *words), says) for name, (words, says) in calls.items()}


CALLS = _calls()


@dataclass(frozen=True)
class Place:
    """The folder of bad things."""

    path: Path

    def picture(self) -> dict[str, tuple[int, int, int]]:
        """What lies in it: kind, size and time of each name."""
        found = {}
        for folder, folders, files in os.walk(self.path):
            for name in (*folders, *files):
                entry = os.lstat(os.path.join(folder, name))
                found[os.path.join(folder, name)] = entry.st_mode, entry.st_size, entry.st_mtime_ns
        return found


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Place:
    path = tmp_path_factory.mktemp("hostile")
    for name, (content, _) in FILES.items():
        (path / name).write_bytes(content.encode() if isinstance(content, str) else content)
    (path / "arm.urdf").write_text(tiny.ARM)
    (path / "folder.urdf").mkdir()
    (path / "hollow").mkdir()
    (path / "taken").mkdir()
    (path / "taken" / "error.png").touch()
    os.mkfifo(path / "pipe.urdf")
    (path / "loop.urdf").symlink_to("loop.urdf")
    (path / "nowhere.urdf").symlink_to("nothing-here")
    with (path / "large.urdf").open("wb") as file:
        file.truncate(30_000_000)
    _learn(path)
    return Place(path)


def _learn(path: Path) -> None:
    """One run, copied and then harmed in every way."""
    before = Path.cwd()
    os.chdir(path)
    try:
        sizes = ("--samples=400", "--per-cycle=100", "--hidden=4", "--test-points=20")
        assert main(["reach", "planar:2", *sizes, "--out", "run", "--json"]) == 0
    finally:
        os.chdir(before)
    for spec in ("arm", "lost"):
        shutil.copytree(path / "run", path / f"{spec}-arm")
        moved = {"spec": f"{spec}.urdf"}
        forged(lambda record, moved=moved: record["facts"]["source"].update(moved))(
            *_pair(path / f"{spec}-arm", "skill")
        )
        forged(lambda record, moved=moved: record["facts"]["source"]["choice"].update(moved))(
            *_pair(path / f"{spec}-arm", "run")
        )
    for kind in ("skill", "run"):
        for name, (harm, _) in DAMAGES.items():
            harm(*_copied(path / "run", kind, path / "damaged" / f"{kind}, {name}", kind))
    _copied(path / "run", "skill", path / "skill", "skill")
    _copied(path / "run", "run", path / "run-as-skill", "skill")
    _copied(path / "run", "skill", path / "skill-as-run", "run")
    pair = _copied(path / "run", "skill", path / "swapped", "skill")
    facts = pair[0].read_bytes()
    forged_tensors(lambda arrays: arrays.update(errors=arrays["errors"] + 1))(*pair)
    pair[0].write_bytes(facts)  # the facts of one skill, the tensors of the other


def _copied(source: Path, kind: str, target: Path, as_kind: str) -> tuple[Path, Path]:
    target.mkdir(parents=True)
    pair = _pair(target, as_kind)
    for old, new in zip(_pair(source, kind), pair, strict=True):
        shutil.copy(old, new)
    return pair


def _pair(folder: Path, kind: str) -> tuple[Path, Path]:
    return folder / f"{kind}.json", folder / f"{kind}.safetensors"


def test_there_are_two_hundred_and_more() -> None:
    assert len(CALLS) >= 200


@pytest.mark.usefixtures("unchecked")
@pytest.mark.parametrize("name", CALLS)
def test_a_hostile_call_is_answered_by_one_line(
    name: str, place: Place, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    words, says = CALLS[name]
    monkeypatch.chdir(place.path)
    before = place.picture()
    code = main(list(words))
    said = capfd.readouterr()
    _judge(code, said.out, said.err, says)
    assert place.picture() == before


def _judge(code: int, out: str, err: str, says: str) -> None:
    line = err.removesuffix("\n")
    assert code == 2, err
    assert out == ""
    assert line.startswith("toddle: ")
    assert line.isprintable(), line
    assert says in line
    assert "Traceback" not in line
    assert "fault of toddle" not in line


SAMPLE = (
    "bomb.urdf", "ring.urdf", "--samples 'nan'", "--target '5 5'", "--skill, tensors cut in half",
    "a robot and a run",
)  # fmt: skip


@pytest.mark.parametrize("name", SAMPLE)
def test_it_is_the_same_from_outside(name: str, place: Place) -> None:
    words, says = CALLS[name]
    before = place.picture()
    script = "import sys; from toddle.cli import main; sys.exit(main())"
    done = subprocess.run(
        [sys.executable, "-c", script, *words], cwd=place.path, capture_output=True, text=True, timeout=60, check=False
    )
    _judge(done.returncode, done.stdout, done.stderr, says)
    assert place.picture() == before


def test_a_sound_call_is_not_refused(place: Place, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The same arm, skill and run are accepted where nothing is wrong with them."""
    monkeypatch.chdir(place.path)
    assert main(["reach", *ASK]) in (0, 1)
    shutil.copytree("run", tmp_path / "run")
    assert main(["reach", "--resume", str(tmp_path / "run"), "--samples", "500"]) == 0
