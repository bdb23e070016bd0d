"""URDF and MJCF files of humanoids, through MuJoCo's own parsers, as a `Skeleton`.

MuJoCo welds the root link of a URDF to the world and drops its mass without a word, so a world link and a floating
joint are put above it; fixed links are kept apart (``fusestatic``) so that every frame keeps its name; mesh paths
(``package://``) are made absolute; meshes that MuJoCo can't read (.dae) become their vertices' convex hull.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import mujoco
import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.robots.humanoids.skeleton import Hinge, Link, Pose, Shape, Skeleton
from toddle.robots.markup import parse, read_bytes

_LEAST_MASS, _LEAST_INERTIA = 1e-9, 1e-12  # lets MuJoCo compile frames that weigh nothing; zeroed again [kg, kg m^2]
_READ_BY_MUJOCO = (".stl", ".obj", ".msh")


def read(path: Path, without: Sequence[str] = ()) -> Skeleton:
    """The whole robot of a URDF or MJCF file.

    Args:
        path: the file.
        without: links of a URDF that are left out, with all that hangs on them.

    Raises:
        BadInput: the file can't be used; the line says which element and what mends it.
    """
    root = parse(read_bytes(path), str(path))
    if root.tag == "robot":
        return _skeleton(_compiled(_urdf(root, path, without), path), path)
    if root.tag == "mujoco":
        return _skeleton(_compiled(mujoco.MjSpec.from_file(str(path)), path), path)
    raise BadInput(f"its root element is <{root.tag}>", where=str(path), remedy="name a URDF or MJCF file")


def _urdf(root: Element, path: Path, without: Sequence[str]) -> Any:
    robot = Element("robot", name=root.get("name") or path.stem)
    kept = _kept(root, without)
    _compiler(robot)
    parents = {joint.find("child").get("link") for joint in root.findall("joint")}  # type: ignore[union-attr]
    for link in root.findall("link"):
        if link.get("name") in kept:
            robot.append(_ready(link, path))
    for joint in root.findall("joint"):
        if joint.find("child").get("link") in kept:  # type: ignore[union-attr]
            robot.append(joint)
    base = next(link.get("name") for link in root.findall("link") if link.get("name") not in parents)
    SubElement(robot, "link", name="world")
    floating = SubElement(robot, "joint", name="floating_base", type="floating")
    SubElement(floating, "parent", link="world")
    SubElement(floating, "child", link=str(base))
    return mujoco.MjSpec.from_string(ElementTree.tostring(robot, encoding="unicode"))


def _compiler(robot: Element) -> None:
    extension = SubElement(robot, "mujoco")
    SubElement(
        extension,
        "compiler",
        fusestatic="false",
        discardvisual="false",
        strippath="false",
        boundmass=str(_LEAST_MASS),
        boundinertia=str(_LEAST_INERTIA),
        balanceinertia="true",
    )


def _kept(root: Element, without: Sequence[str]) -> set[str]:
    child = {j.find("child").get("link"): j.find("parent").get("link") for j in root.findall("joint")}  # type: ignore[union-attr]
    kept = set()
    for link in root.findall("link"):
        name: str | None = link.get("name")
        above = name
        while above is not None and above not in without:
            above = child.get(above)
        if above is None and name:
            kept.add(name)
    return kept


def _ready(link: Element, path: Path) -> Element:
    link = deepcopy(link)
    shown = {mesh.get("filename") for mesh in link.findall("visual/geometry/mesh")}
    for shape in [*link.findall("visual"), *link.findall("collision")]:
        mesh = shape.find("geometry/mesh")
        if mesh is None:
            continue
        if shape.tag == "collision" and mesh.get("filename") in shown:
            link.remove(shape)
            continue
        found = _mesh_path(mesh.get("filename", ""), path)
        if found is None:
            raise BadInput(
                f"the mesh {mesh.get('filename')!r} is missing",
                where=f"{path}: link {link.get('name')!r}",
                remedy="put the file there, or remove the element that names it",
            )
        if found.suffix.lower() not in _READ_BY_MUJOCO:
            link.remove(shape)
            continue
        mesh.set("filename", str(found))
    return link


def _mesh_path(name: str, path: Path) -> Path | None:
    """Where a mesh lies: ``package://`` is looked for in the folders above the file, the nearest first."""
    _, package, rest = name.rpartition("://")
    if not package:
        found = path.parent / rest
        return found.resolve() if found.is_file() else None
    short = rest.partition("/")[2]
    for folder in path.resolve().parents:
        for found in (folder / rest, folder / short):
            if found.is_file():
                return found
    found = Path("/" + rest.lstrip("/"))
    return found if found.is_file() else None


def _compiled(spec: Any, path: Path) -> Any:
    for mesh in spec.meshes:
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    for geom in spec.geoms:
        geom.contype, geom.conaffinity = geom.contype and 1, geom.conaffinity and 1
    try:
        return spec.compile()
    except ValueError as error:
        raise BadInput(f"MuJoCo can't read it: {error}", where=str(path), remedy="mend that element") from None


def _skeleton(model: Any, path: Path) -> Skeleton:
    root = _root(model)
    order = [i for i in range(1, model.nbody) if model.body_rootid[i] == model.body_rootid[root] and i >= root]
    index = {body: place for place, body in enumerate(order)}
    return tuple(_link(model, body, index.get(int(model.body_parentid[body]), -1)) for body in order)


def _root(model: Any) -> int:
    """The floating body; without one, the world's heaviest child."""
    for joint in range(model.njnt):
        if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE:
            return int(model.jnt_bodyid[joint])
    children = [i for i in range(1, model.nbody) if model.body_parentid[i] == 0]
    return max(children, key=lambda i: float(model.body_subtreemass[i]))


def _link(model: Any, body: int, parent: int) -> Link:
    rotation = matrix(model.body_iquat[body])
    light = model.body_mass[body] <= 2 * _LEAST_MASS
    return Link(
        name=model.body(body).name or f"body{body}",
        parent=parent,
        position=model.body_pos[body].copy(),
        rotation=matrix(model.body_quat[body]),
        mass=0.0 if light else float(model.body_mass[body]),
        centre=model.body_ipos[body].copy(),
        inertia=rotation @ np.diag(0.0 * model.body_inertia[body] if light else model.body_inertia[body]) @ rotation.T,
        hinges=_hinges(model, body),
        shapes=_shapes(model, body),
        frames=_sites(model, body),
    )


def _sites(model: Any, body: int) -> dict[str, Pose]:
    return {
        model.site(i).name: (model.site_pos[i].copy(), matrix(model.site_quat[i]))
        for i in range(model.nsite)
        if model.site_bodyid[i] == body and model.site(i).name
    }


def _hinges(model: Any, body: int) -> tuple[Hinge, ...]:
    first = int(model.body_jntadr[body])
    found = []
    for joint in range(first, first + int(model.body_jntnum[body])):
        if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE:
            low, high = model.jnt_range[joint] if model.jnt_limited[joint] else (-np.inf, np.inf)
            dof, zero = int(model.jnt_dofadr[joint]), float(model.qpos0[model.jnt_qposadr[joint]])
            found.append(
                Hinge(
                    name=model.joint(joint).name or f"joint{joint}",
                    axis=model.jnt_axis[joint].copy(),
                    anchor=model.jnt_pos[joint].copy(),
                    lower=float(low) - zero,
                    upper=float(high) - zero,
                    effort=_effort(model, joint),
                    reflected=float(model.dof_armature[dof]),
                )
            )
    return tuple(found)


def _effort(model: Any, joint: int) -> float:
    """The greatest torque that a description allows a joint [N m]; 0: it says nothing."""
    if model.jnt_actfrclimited[joint]:
        return float(np.abs(model.jnt_actfrcrange[joint]).max())
    for i in range(model.nu):
        if model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_JOINT and model.actuator_trnid[i, 0] == joint:
            gear = abs(float(model.actuator_gear[i, 0]))
            if model.actuator_forcelimited[i]:
                return gear * float(np.abs(model.actuator_forcerange[i]).max())
            motor = model.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_NONE
            if motor and model.actuator_ctrllimited[i]:
                gain = abs(float(model.actuator_gainprm[i, 0]))
                return gear * gain * float(np.abs(model.actuator_ctrlrange[i]).max())
    return 0.0


def _shapes(model: Any, body: int) -> tuple[Shape, ...]:
    first = int(model.body_geomadr[body])
    return tuple(_shape(model, geom) for geom in range(first, first + int(model.body_geomnum[body])))


def _shape(model: Any, geom: int) -> Shape:
    vertices = faces = None
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom])
        at, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        vertices = np.asarray(model.mesh_vert[at : at + count], float)
        at, count = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
        faces = np.asarray(model.mesh_face[at : at + count], np.int64)
    material = int(model.geom_matid[geom])
    return Shape(
        type=int(model.geom_type[geom]),
        size=np.asarray(model.geom_size[geom], float).copy(),
        position=model.geom_pos[geom].copy(),
        rotation=matrix(model.geom_quat[geom]),
        rgba=np.asarray(model.geom_rgba[geom] if material < 0 else model.mat_rgba[material], float).copy(),
        solid=bool(model.geom_contype[geom] or model.geom_conaffinity[geom]),
        vertices=vertices,
        faces=faces,
    )


def matrix(quaternion: Float[np.ndarray, "4"]) -> Float[np.ndarray, "3 3"]:
    """The rotation of a unit quaternion (w, x, y, z)."""
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, np.asarray(quaternion, float))
    return flat.reshape(3, 3)


def quaternion(rotation: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "4"]:
    """The unit quaternion (w, x, y, z) of a rotation."""
    found = np.zeros(4)
    mujoco.mju_mat2Quat(found, np.ascontiguousarray(rotation, float).ravel())
    return found
