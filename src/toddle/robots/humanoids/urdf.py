"""A URDF made ready for MuJoCo: what is wrong in it is said, what MuJoCo would lose is kept.

MuJoCo welds the root link to the world and drops its mass without a word, so a world link and a floating joint are
put above it; fixed links are kept apart (``fusestatic``) so that every frame keeps its name; mesh paths
(``package://``) are made absolute; meshes that MuJoCo can't read are handed back as vertices.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import mujoco
import numpy as np

from toddle.failures import BadInput, unknown_name
from toddle.robots.frames import from_rpy
from toddle.robots.humanoids.meshes import read_by_mujoco, vertices
from toddle.robots.humanoids.skeleton import Shape
from toddle.robots.markup import number, numbers

LEAST_MASS, _LEAST_INERTIA = 1e-9, 1e-12  # lets MuJoCo compile links that weigh nothing [kg, kg m^2]
_GREY = np.array([0.5, 0.5, 0.5, 1.0])


class Ready(NamedTuple):
    """What MuJoCo is given, and what it can't be given.

    Attributes:
        text: the description.
        clouds: shapes of links that MuJoCo can't read, by the link's name.
        weightless: links with geometry whose mass is said to be 0.
    """

    text: str
    clouds: dict[str, tuple[Shape, ...]]
    weightless: frozenset[str]


def ready(root: Element, path: Path, base: str | None, without: Sequence[str], where: str) -> Ready:
    """The robot of a URDF's root element, for MuJoCo.

    Args:
        root: of the file.
        path: the file, for its meshes and for messages.
        base: link that floats; what is above it is left out. None: the root of the tree.
        without: links that are left out, with all that hangs on them.
        where: whatever names base and without, for messages.

    Raises:
        BadInput: the file can't be used; the line says which element and what mends it.
    """
    links = _once([(_name(link, path), link) for link in root.findall("link")], "is there twice", path)
    children = [(_end(joint, "child", links, path), joint) for joint in root.findall("joint")]
    joints = _once(children, "is the child of two joints", path)
    above = {child: _end(joint, "parent", links, path) for child, joint in joints.items()}
    for joint in joints.values():
        _check_limits(joint, path)
    kept = _kept(links, above, _base(links, above, base, path, where), without, where)
    robot = Element("robot", name=root.get("name") or path.stem)
    _compiler(robot)
    clouds: dict[str, tuple[Shape, ...]] = {}
    for name in kept:
        robot.append(_link(links[name], path, clouds))
    for name in kept[1:]:
        robot.append(_joint(joints[name]))
    SubElement(robot, "link", name="world")
    floating = SubElement(robot, "joint", name="floating_base", type="floating")
    SubElement(floating, "parent", link="world")
    SubElement(floating, "child", link=kept[0])
    weightless = frozenset(name for name in kept if _weightless(links[name], path))
    return Ready(ElementTree.tostring(robot, encoding="unicode"), clouds, weightless)


def _name(element: Element, path: Path) -> str:
    name = element.get("name")
    if not name:
        raise BadInput(f"a <{element.tag}> has no name", where=str(path), remedy="give it a name")
    return name


def _once(named: list[tuple[str, Element]], fault: str, path: Path) -> dict[str, Element]:
    found: dict[str, Element] = {}
    for name, element in named:
        if name in found:
            raise BadInput(f"the link {name!r} {fault}", where=str(path), remedy="a robot is a tree: keep one of them")
        found[name] = element
    return found


def _end(joint: Element, tag: str, links: dict[str, Element], path: Path) -> str:
    where = f"{path}: joint {_name(joint, path)!r}, <{tag}>"
    element = joint.find(tag)
    name = "" if element is None else element.get("link", "")
    if name not in links:
        raise unknown_name("link", name, links, where=where)
    return name


def _check_limits(joint: Element, path: Path) -> None:
    if joint.get("type") not in ("revolute", "prismatic"):
        return
    where = f"{path}: joint {joint.get('name')!r}, <limit>"
    limit = joint.find("limit")
    if limit is None or limit.get("lower") is None or limit.get("upper") is None:
        raise BadInput(
            "the joint has no limits", where=where, remedy="give it <limit lower= upper= effort=> in radians"
        )
    lower, upper = number(limit, "lower", 0.0, where), number(limit, "upper", 0.0, where)
    if lower > upper:
        raise BadInput(f"lower {lower:g} is above upper {upper:g}", where=where, remedy="exchange them")


def _base(links: dict[str, Element], above: dict[str, str], base: str | None, path: Path, where: str) -> str:
    if base is not None:
        if base not in links:
            raise unknown_name("link", base, links, where=f"{where}: base")
        return base
    roots = [name for name in links if name not in above]
    if len(roots) != 1:
        raise BadInput(
            f"it has {len(roots)} links without a parent" + (f": {', '.join(roots[:4])}" if roots else ""),
            where=str(path),
            remedy="join all links into one tree, or name the link that floats with base",
        )
    root = roots[0]
    for name in links:
        chain = {name}
        while name in above:
            name = above[name]
            if name in chain:
                raise BadInput(f"its joints form a circle at {name!r}", where=str(path), remedy="make them a tree")
            chain.add(name)
    children = [child for child, parent in above.items() if parent == root]
    if root == "world" and len(children) == 1 and links[root].find("inertial") is None:
        return children[0]
    return root


def _kept(links: dict[str, Element], above: dict[str, str], base: str, without: Sequence[str], where: str) -> list[str]:
    """The base and every link under it, the base first."""
    for name in without:
        if name not in links:
            raise unknown_name("link", name, links, where=f"{where}: without")
    below: dict[str, list[str]] = {}
    for child, parent in above.items():
        below.setdefault(parent, []).append(child)
    kept, front = [], [base]
    while front:
        name = front.pop(0)
        if name in without:
            continue
        kept.append(name)
        front += below.get(name, [])
    return kept


def _compiler(robot: Element) -> None:
    SubElement(
        SubElement(robot, "mujoco"),
        "compiler",
        fusestatic="false",
        discardvisual="false",
        strippath="false",
        boundmass=str(LEAST_MASS),
        boundinertia=str(_LEAST_INERTIA),
        balanceinertia="true",
    )


def _joint(joint: Element) -> Element:
    joint = deepcopy(joint)
    for mimic in joint.findall("mimic"):
        joint.remove(mimic)
    return joint


def _weightless(link: Element, path: Path) -> bool:
    mass = link.find("inertial/mass")
    if mass is None:
        return False
    where = f"{path}: link {link.get('name')!r}, <mass>"
    value = number(mass, "value", 0.0, where)
    if value < 0:
        raise BadInput(f"its mass is {value:g} kg", where=where, remedy="give it a positive mass")
    return value == 0 and (link.find("visual") is not None or link.find("collision") is not None)


def _link(link: Element, path: Path, clouds: dict[str, tuple[Shape, ...]]) -> Element:
    link = deepcopy(link)
    where = f"{path}: link {link.get('name')!r}"
    shown = {mesh.get("filename") for mesh in link.findall("visual/geometry/mesh")}
    own: list[Shape] = []
    for shape in [*link.findall("visual"), *link.findall("collision")]:
        shape.attrib.pop("name", None)
        mesh = shape.find("geometry/mesh")
        if mesh is None:
            continue
        found = _mesh_path(mesh.get("filename", ""), path)
        if found is None:
            raise BadInput(
                f"the mesh {mesh.get('filename')!r} is missing",
                where=where,
                remedy="put the file there, or remove the element that names it",
            )
        if shape.tag == "collision" and mesh.get("filename") in shown:
            link.remove(shape)
        elif read_by_mujoco(found):
            mesh.set("filename", str(found))
        else:
            link.remove(shape)
            own.append(_cloud(shape, mesh, found, where))
    if own:
        clouds[str(link.get("name"))] = tuple(own)
    return link


def _cloud(shape: Element, mesh: Element, file: Path, where: str) -> Shape:
    origin = shape.find("origin")
    origin = Element("origin") if origin is None else origin
    turn = from_rpy(np.array(numbers(origin, "rpy", (0.0, 0.0, 0.0), where)))
    scale = np.array(numbers(mesh, "scale", (1.0, 1.0, 1.0), where))
    return Shape(
        type=int(mujoco.mjtGeom.mjGEOM_MESH),
        size=np.zeros(3),
        position=np.array(numbers(origin, "xyz", (0.0, 0.0, 0.0), where)),
        rotation=turn,
        rgba=_GREY,
        solid=shape.tag == "collision",
        vertices=vertices(file, where) * scale,
    )


def _mesh_path(name: str, path: Path) -> Path | None:
    """Where a mesh lies: ``package://`` is looked for in the folders above the file, the nearest first."""
    scheme, package, rest = name.rpartition("://")
    if not package:
        found = path.parent / rest
        return found.resolve() if found.is_file() else None
    if scheme == "file":
        found = Path("/" + rest.lstrip("/"))
        return found if found.is_file() else None
    inside = rest.partition("/")[2]
    for folder in path.resolve().parents:
        for found in (folder / rest, folder / inside):
            if inside and found.is_file():
                return found
    return None
