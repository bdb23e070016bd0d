"""MJCF files: the kinematics of a MuJoCo model, read by MuJoCo itself from a copy that holds nothing else.

Defaults, frames, angles in degrees, anchors of joints and the many ways to write an orientation are MuJoCo's
to resolve. What it is given (`mjcf_strip`) has bodies, joints, sites and equalities between joints only: no
mesh, height field or skin is ever looked for, and nothing outside the model's own folder is opened.
"""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from xml.etree.ElementTree import Element

import mujoco
import numpy as np

from toddle.failures import BadInput
from toddle.robots.chain import Chain
from toddle.robots.frames import from_quaternion, inverse, transform, turning_z_to, z_motion
from toddle.robots.markup import parse, read_bytes
from toddle.robots.mjcf_strip import Stripped, stripped
from toddle.robots.tree import Follows, Joint, Kind, Motion, Tree, plant
from toddle.robots.walk import chain

_KINDS = {
    mujoco.mjtJoint.mjJNT_HINGE: Kind.TURNS,
    mujoco.mjtJoint.mjJNT_SLIDE: Kind.SLIDES,
    mujoco.mjtJoint.mjJNT_BALL: Kind.OTHER,
    mujoco.mjtJoint.mjJNT_FREE: Kind.OTHER,
}


def read_mjcf(
    path: Path, *, tip: str | None = None, base: str | None = None, joints: Sequence[str] | None = None
) -> Chain:
    """The chain of an MJCF file from a base to a tip.

    Args:
        path: the file.
        tip: the body or site whose position is reported; None: inferred, see `tips.infer_tip`.
        base: the body or site in whose frame it is reported; None: the world, or what floats in it.
        joints: names of the actuated joints; None: every joint that moves the tip.

    Returns:
        The chain. A hinge without limits turns by half a turn either way. Where one joint is held to another
        by an equality, the first follows the second. A keyframe named "home" gives the home.

    Raises:
        BadInput: the file can't be used, or a name is not in it.
    """
    return chain_of(parse(read_bytes(path), str(path)), path, tip=tip, base=base, joints=joints)


def chain_of(root: Element, path: Path, *, tip: str | None, base: str | None, joints: Sequence[str] | None) -> Chain:
    """The chain of an MJCF's root element; see `read_mjcf`."""
    copy = stripped(root, path)
    tree = _tree(_compiled(copy.text, str(path)), copy, str(path))
    return chain(tree, tip=tip, base=base, joints=joints)


def _compiled(text: str, where: str) -> mujoco.MjModel:
    with _silent():
        try:
            return mujoco.MjModel.from_xml_string(text)
        except ValueError as error:
            # Its line numbers are those of the copy, and lead nobody anywhere.
            reason = re.sub(r"^((XML )?Error: )+|, line \d+", "", " ".join(str(error).split()))
            raise BadInput(
                f"MuJoCo can't read it: {reason}",
                where=where,
                remedy="mend that element",
            ) from None


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """Keep MuJoCo's warnings off the terminal, and its MUJOCO_LOG.TXT out of the working folder."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def _tree(model: mujoco.MjModel, copy: Stripped, where: str) -> Tree:
    """Bodies and sites as links; a body with several joints as several links, one behind the other."""
    bodies = [_body_name(model, i) for i in range(model.nbody)]
    links, joints, behind = [bodies[0]], list[Joint](), set[str]()
    followers = _followers(model, where)
    for i in range(1, model.nbody):
        found = _body_joints(model, i, bodies, followers, where)
        joints += found
        links += [joint.child for joint in found]
        behind.update(joint.child for joint in found[:-1])
    holders = {model.body_parentid[i] for i in range(1, model.nbody)}
    for i in range(model.nsite):
        name = model.site(i).name
        if not name:
            continue
        link = name if name not in links else f"site:{name}"
        origin = transform(from_quaternion(model.site_quat[i]), model.site_pos[i])
        holder = bodies[model.site_bodyid[i]]
        joints.append(Joint(f"(site {name})", Kind.FIXED, holder, link, lambda origin=origin: Motion(origin, _Z)))
        links.append(link)
    tree = plant(copy.name or Path(where).stem, where, links, joints)
    ends = tuple(bodies[i] for i in range(1, model.nbody) if i not in holders)
    return Tree(tree.name, where, tree.links, tree.above, ends, _home(model, copy), hidden=frozenset(behind))


_Z = np.array([0.0, 0.0, 1.0])


def _body_name(model: mujoco.MjModel, i: int) -> str:
    return model.body(i).name or f"(body {i})"


def _joint_name(model: mujoco.MjModel, i: int) -> str:
    return model.joint(i).name or f"(joint {i})"


def _body_joints(
    model: mujoco.MjModel, body: int, bodies: list[str], followers: dict[int, int], where: str
) -> list[Joint]:
    """What lies between a body's parent and the body: its joints in their order, then the rest of its frame.

    A joint turns about an anchor, so its origin is shifted there, and the next one's is shifted back.
    """
    at = transform(from_quaternion(model.body_quat[body]), model.body_pos[body])
    parent, joints = bodies[model.body_parentid[body]], list[Joint]()
    first = model.body_jntadr[body]
    for i in range(first, first + model.body_jntnum[body]):
        anchor = transform(None, model.jnt_pos[i])
        name, child = _joint_name(model, i), f"({bodies[body]} beyond joint {i})"
        origin = at @ anchor

        def read(i: int = i, origin: np.ndarray = origin) -> Motion:
            return _motion(model, i, origin, followers, where)

        kind = Kind.FIXED if _is_locked(model, i, followers) else _KINDS[mujoco.mjtJoint(model.jnt_type[i])]
        joints.append(Joint(name, kind, parent, child, read))
        parent, at = child, inverse(anchor)
    joints.append(Joint(f"({bodies[body]})", Kind.FIXED, parent, bodies[body], lambda: Motion(at, _Z)))
    return joints


def _motion(model: mujoco.MjModel, i: int, origin: np.ndarray, followers: dict[int, int], where: str) -> Motion:
    reference = float(model.qpos0[model.jnt_qposadr[i]])
    axis, hinge = model.jnt_axis[i].copy(), model.jnt_type[i] == mujoco.mjtJoint.mjJNT_HINGE
    if _is_locked(model, i, followers):
        value = float(model.eq_data[followers[i], 0])
        turn = transform(turning_z_to(axis), np.zeros(3))
        return Motion(origin @ turn @ z_motion(value, slides=not hinge) @ turn.T, axis)
    lower, upper = (float(limit) for limit in model.jnt_range[i])
    limited = bool(model.jnt_limited[i]) or lower > upper  # MuJoCo takes limits in the wrong order for none
    endless = hinge and not limited
    turn = (reference - math.pi, reference + math.pi) if endless else None
    limits = (lower, upper) if limited else turn
    return Motion(origin, axis, limits, _follows(model, i, followers, where), reference, endless)


def _is_locked(model: mujoco.MjModel, i: int, followers: dict[int, int]) -> bool:
    """Whether an equality holds the joint to a constant."""
    return i in followers and int(model.eq_obj2id[followers[i]]) < 0


def _followers(model: mujoco.MjModel, where: str) -> dict[int, int]:
    """The equality that holds each joint which follows another."""
    rules: dict[int, int] = {}
    for i in range(model.neq):
        joint = int(model.eq_obj1id[i])
        if not model.eq_active0[i]:
            continue
        if joint in rules:
            raise BadInput(
                "two equalities hold it",
                where=f"{where}: joint {_joint_name(model, joint)!r}",
                remedy="keep one of them",
            )
        rules[joint] = i
    return rules


def _follows(model: mujoco.MjModel, i: int, followers: dict[int, int], where: str) -> Follows | None:
    """MuJoCo's rule ``y - y0 = polynomial(x - x0)``, where it is a straight line."""
    if i not in followers:
        return None
    rule = followers[i]
    constant, slope, *bent = (float(c) for c in model.eq_data[rule, :5])
    if any(bent):
        raise BadInput(
            "it follows another by a polynomial that is not a straight line",
            where=f"{where}: joint {_joint_name(model, i)!r}",
            remedy="set the last three numbers of the equality's polycoef to 0",
        )
    leader = int(model.eq_obj2id[rule])
    y0, x0 = (float(model.qpos0[model.jnt_qposadr[j]]) for j in (i, leader))
    return Follows(_joint_name(model, leader), slope, y0 + constant - slope * x0)


def _home(model: mujoco.MjModel, copy: Stripped) -> dict[str, float]:
    """The joint values of a keyframe named "home", where the file has one that fits."""
    if len(copy.home) != model.nq:
        return {}
    return {_joint_name(model, i): copy.home[model.jnt_qposadr[i]] for i in range(model.njnt)}
