"""URDF and MJCF files of humanoids, through MuJoCo's own parsers, as a `Skeleton`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput, unknown_name
from toddle.robots.humanoids.skeleton import Hinge, Link, Pose, Shape, Skeleton
from toddle.robots.humanoids.urdf import LEAST_MASS, ready
from toddle.robots.markup import parse, read_bytes


def read(path: Path, base: str | None = None, without: Sequence[str] = (), where: str | None = None) -> Skeleton:
    """The whole robot of a URDF or MJCF file.

    Args:
        path: the file.
        base: link that floats; what is above it is left out. None: the one that does, or the root.
        without: links that are left out, with all that hangs on them.
        where: whatever names base and without, for messages; None: the file.

    Raises:
        BadInput: the file can't be used; the line says which element and what mends it.
    """
    root = parse(read_bytes(path), str(path))
    if root.tag == "robot":
        told = ready(root, path, base, without, where or str(path))
        skeleton = _skeleton(_compiled(mujoco.MjSpec.from_string, told.text, path), None, str(path))
        return tuple(
            replace(
                link,
                shapes=(*link.shapes, *told.clouds.get(link.name, ())),
                weightless=link.name in told.weightless,
            )
            for link in skeleton
        )
    if root.tag == "mujoco":
        skeleton = _skeleton(_compiled(mujoco.MjSpec.from_file, str(path), path), base, where or str(path))
        known = [link.name for link in skeleton]
        for name in without:
            if name not in known:
                raise unknown_name("body", name, known, where=f"{where or path}: without")
        return _pruned(skeleton, without)
    raise BadInput(f"its root element is <{root.tag}>", where=str(path), remedy="name a URDF or MJCF file")


def _compiled(parser: Any, source: str, path: Path) -> Any:
    try:
        spec = parser(source)
        for mesh in spec.meshes:
            mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        model = spec.compile()
    except ValueError as error:
        raise BadInput(f"MuJoCo can't read it: {error}", where=str(path), remedy="mend that element") from None
    loops = int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD)
    if any(int(kind) in loops for kind in model.eq_type):
        raise BadInput(
            "its chains are closed by <equality> constraints",
            where=str(path),
            remedy="remove the <connect> and <weld> elements: only open chains are walked with",
        )
    return model


def _pruned(skeleton: Skeleton, without: Sequence[str]) -> Skeleton:
    """Without some links and all that hangs on them."""
    place: dict[int, int] = {-1: -1}
    kept: list[Link] = []
    for index, link in enumerate(skeleton):
        if link.name not in without and link.parent in place:
            place[index] = len(kept)
            kept.append(replace(link, parent=place[link.parent]))
    return tuple(kept)


def _skeleton(model: Any, base: str | None, where: str) -> Skeleton:
    names = [model.body(body).name for body in range(model.nbody)]
    if base is not None and base not in names[1:]:
        raise unknown_name("body", base, [name for name in names[1:] if name], where=f"{where}: base")
    if model.nbody < 2:
        raise BadInput("it has no body", where=where, remedy="name the description of a robot")
    root = _root(model) if base is None else names.index(base)
    index = {root: 0}
    for body in range(root + 1, model.nbody):
        if int(model.body_parentid[body]) in index:
            index[body] = len(index)
    return tuple(_link(model, body, index.get(int(model.body_parentid[body]), -1)) for body in index)


def _root(model: Any) -> int:
    """The floating body; without one, the world's heaviest child."""
    for joint in range(model.njnt):
        if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE:
            return int(model.jnt_bodyid[joint])
    children = [i for i in range(1, model.nbody) if model.body_parentid[i] == 0]
    return max(children, key=lambda i: float(model.body_subtreemass[i]))


def _link(model: Any, body: int, parent: int) -> Link:
    rotation = matrix(model.body_iquat[body])
    light = model.body_mass[body] <= 2 * LEAST_MASS
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
        others=_others(model, body),
    )


def _others(model: Any, body: int) -> tuple[str, ...]:
    """Names of the body's joints that are no hinges, but for what makes it float."""
    first = int(model.body_jntadr[body])
    kinds = int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_BALL)
    return tuple(
        model.joint(joint).name or f"joint{joint}"
        for joint in range(first, first + int(model.body_jntnum[body]))
        if int(model.jnt_type[joint]) in kinds
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
