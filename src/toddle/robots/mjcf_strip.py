"""A copy of an MJCF document with nothing in it but kinematics, its included files put in their places.

Elements and attributes that are not listed here are dropped, so that no asset is ever needed. Every body gets
a mass and every joint an inertia, for MuJoCo compiles nothing that moves without; kinematics depends on
neither.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, tostring

from toddle.failures import BadInput
from toddle.robots.markup import parse, read_bytes, values

_ORIENTED = {"pos", "quat", "axisangle", "xyaxes", "zaxis", "euler"}
_KEPT = {
    "mujoco": {"model"},
    "compiler": {"angle", "coordinate", "eulerseq", "autolimits"},
    "default": {"class"},
    "worldbody": set[str](),
    "body": {"name", "childclass", *_ORIENTED},
    "frame": {"name", "childclass", *_ORIENTED},
    "joint": {"name", "class", "type", "pos", "axis", "range", "limited", "ref"},
    "freejoint": {"name"},
    "site": {"name", "class", "type", "size", "fromto", *_ORIENTED},
    "equality": set[str](),
}
_IN_EQUALITY = {"name", "class", "joint1", "joint2", "polycoef", "active"}
_NUMBERS = {"axis", "range", "ref", "fromto", "polycoef", *_ORIENTED}
_DEEPEST, _MOST_FILES = 150, 100


@dataclass(frozen=True)
class Stripped:
    """What is left of a document.

    Attributes:
        text: the kinematics, as XML.
        name: the model's name.
        home: joint positions of the keyframe named "home"; empty where there is none.
    """

    text: str
    name: str
    home: tuple[float, ...]


@dataclass
class _Source:
    """The files of one model: which may be opened, and which have been."""

    path: Path
    opened: list[Path] = field(default_factory=list)
    home: tuple[float, ...] = ()

    @property
    def where(self) -> str:
        return str(self.path)

    def remember_home(self, keyframes: Element) -> None:
        """Keep the joint positions of the keyframe named "home", if it is here."""
        for key in keyframes.findall("key"):
            if key.get("name") == "home":
                self.home = values(key, "qpos", f"{self.where}: <key name='home'>")

    def included(self, element: Element) -> Element:
        """The root element of an included file.

        Raises:
            BadInput: it lies outside the model's folder, is included twice, or can't be read.
        """
        name = element.get("file") or ""
        where = f"{self.where}: <include file={name!r}>"
        if not name:
            raise BadInput("it names no file", where=where, remedy='write <include file="..."/>')
        folder = self.path.resolve().parent
        file = (folder / name).resolve()
        if not file.is_relative_to(folder):
            raise BadInput(
                "it lies outside the model's own folder",
                where=where,
                remedy="copy the file there and include that",
            )
        if file in self.opened or file == self.path.resolve():
            raise BadInput("the file is included twice", where=where, remedy="include each file once")
        if len(self.opened) >= _MOST_FILES:
            raise BadInput(f"more than {_MOST_FILES} files are included", where=where, remedy="join some of them")
        self.opened.append(file)
        shown = self.path.parent / name
        return parse(read_bytes(shown), str(shown))


def stripped(root: Element, path: Path) -> Stripped:
    """The kinematics of an MJCF document.

    Raises:
        BadInput: it is no MJCF, an included file can't be used, a number is not one, or another model is
            attached.
    """
    source = _Source(path)
    if root.tag != "mujoco":
        raise BadInput(
            f"its root element is <{root.tag}>, not <mujoco>", where=source.where, remedy="name an MJCF file"
        )
    copy = Element("mujoco")
    _copy_children(root, copy, source, depth=0)
    if copy.find("worldbody") is None:
        raise BadInput("the model has no <worldbody>", where=source.where, remedy="name a file with bodies in it")
    return Stripped(tostring(copy, encoding="unicode"), root.get("model", ""), source.home)


def _copy_children(old: Element, new: Element, source: _Source, *, depth: int) -> None:
    if depth > _DEEPEST:
        raise BadInput(
            f"its elements are nested more than {_DEEPEST} deep",
            where=source.where,
            remedy="describe a simpler robot",
        )
    for child in old:
        if child.tag == "include":
            _copy_children(source.included(child), new, source, depth=depth + 1)
        elif child.tag == "keyframe":
            source.remember_home(child)
        elif child.tag in ("attach", "replicate"):
            raise BadInput(
                f"<{child.tag}> is not read",
                where=source.where,
                remedy="let MuJoCo write the model out (mj_saveLastXML) and name that file",
            )
        elif child.tag in _KEPT and (new.tag != "equality" or child.tag == "joint"):
            kept = SubElement(new, child.tag, _attributes(child, new.tag, source.where))
            _copy_children(child, kept, source, depth=depth + 1)
            if child.tag == "body":
                SubElement(kept, "inertial", pos="0 0 0", mass="1", diaginertia="1 1 1")
            elif child.tag == "joint" and new.tag == "body":
                kept.set("armature", "1")


def _attributes(element: Element, inside: str, where: str) -> dict[str, str]:
    """The attributes that kinematics needs, their numbers checked: MuJoCo takes NaN for a number."""
    names = _IN_EQUALITY if inside == "equality" else _KEPT[element.tag]
    called = f" name={element.get('name')!r}" if element.get("name") else ""
    spot = f"{where}: <{element.tag}{called}>"
    for name in names & _NUMBERS & set(element.keys()):
        values(element, name, spot)
    return {name: text for name, text in element.items() if name in names}
