"""From a skeleton and what is said of it to a `Humanoid`; what is not said is inferred, and noted.

The scale of a robot is its centre of mass' height while walking: times go with its square root, lengths with
itself, both measured against the iCub on which the gait was tuned (0.465 m).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from toddle.failures import BadInput, unknown_name
from toddle.robots.gait import GRAVITY, Gait
from toddle.robots.humanoid import LEFT, RIGHT, Humanoid
from toddle.robots.humanoids.description import quaternion
from toddle.robots.humanoids.home import Stand, stand
from toddle.robots.humanoids.limbs import Legs, ahead, find_chest, find_legs
from toddle.robots.humanoids.physics import Place, Places, Servos, describe
from toddle.robots.humanoids.settings import Settings
from toddle.robots.humanoids.skeleton import Hinge, Skeleton, hinges, locate, poses, weld
from toddle.robots.humanoids.soles import Sole, cloud, sole_of
from toddle.robots.humanoids.tree import frame, tree_of
from toddle.signals import Velocity

ICUB_HEIGHT = 0.465  # [m]
BENT = {"hip": -0.4, "knee": 0.8, "ankle": -0.4}  # about the axis to the left [rad]
_LIGHT = 0.01  # a joint besides the legs that carries a smaller share of the mass is welded
_PLAUSIBLE = 20.0  # torques beyond so many m g h stand for none [1]
_CLOSE = 1e-6  # [m, rad]


@dataclass(frozen=True)
class Anatomy:
    """What was found in a skeleton: legs, chest, the axes ahead, left, up (columns) in the base, ankles in the base."""

    legs: Legs
    chest: int
    axes: Float[np.ndarray, "3 3"]
    ankles: Float[np.ndarray, "2 3"]


def humanoid(skeleton: Skeleton, settings: Settings, where: str) -> Humanoid:
    """The humanoid of a skeleton.

    Args:
        skeleton: every link of the robot.
        settings: what is known of it.
        where: the file, for messages.

    Raises:
        BadInput: the robot can't walk so.
    """
    notes: list[str] = []
    body, anatomy = _trimmed(skeleton, settings, where, notes)
    sole = _sole(body, anatomy, settings, where, notes)
    places = _places(body, anatomy, sole, settings, where, notes)
    moves = _moves(body, anatomy, settings, where)
    tree, bodies = tree_of(body)
    mass = float(tree.mass.sum())
    name = settings.name or body[0].name
    rough = _servos(body, settings, mass, ICUB_HEIGHT, [])
    model = describe(name, _bare(body), places, sole, rough).compile()
    gait, home = _stance(model, body, anatomy, sole, settings, where, notes)
    servos = _servos(body, settings, mass, gait.com_height, notes)
    joints = hinges(body)
    return Humanoid(
        name=name,
        tree=tree,
        joints=tuple(hinge.name for hinge in joints),
        lower=np.array([hinge.lower for hinge in joints]),
        upper=np.array([hinge.upper for hinge in joints]),
        effort=servos.effort,
        stiffness=servos.stiffness,
        damping=servos.damping,
        moves=moves,
        home=home,
        soles=(frame(bodies, *places.soles[LEFT]), frame(bodies, *places.soles[RIGHT])),
        waist=frame(bodies, *places.waist),
        chest=frame(bodies, *places.chest),
        imu=frame(bodies, *places.imu),
        gait=gait,
        spec=describe(name, body, places, sole, servos),
        notes=tuple(notes),
    )


def _bare(body: Skeleton) -> Skeleton:
    """Without geometry: quick to compile, the same to stand with."""
    return tuple(replace(link, shapes=()) for link in body)


def _trimmed(skeleton: Skeleton, settings: Settings, where: str, notes: list[str]) -> tuple[Skeleton, Anatomy]:
    """The skeleton with only the joints of legs and torso, and those that carry something."""
    everything = weld(skeleton, [hinge.name for hinge in hinges(skeleton)])
    named = settings.left_foot, settings.right_foot
    legs, _ = find_legs(everything, named, where)
    chest = find_chest(everything, legs)
    keep = _kept(everything, legs, chest, settings, notes)
    body = weld(skeleton, keep)
    feet = [everything[foot].name for foot in legs.feet]
    legs, sided = find_legs(body, (feet[LEFT], feet[RIGHT]), where)
    chest = find_chest(body, legs)
    ankles = np.array([_ankle(body, foot) for foot in legs.feet])
    axes = ahead(ankles[LEFT] - ankles[RIGHT])
    return body, Anatomy(legs, chest, axes, ankles)


def _kept(body: Skeleton, legs: Legs, chest: int, settings: Settings, notes: list[str]) -> list[str]:
    weights = [link.mass for link in body]
    for link in range(len(body) - 1, 0, -1):
        weights[body[link].parent] += weights[link]
    needed = {link for chain in legs.chains for link in chain}
    link = chest
    while link > 0 and link != legs.fork:
        needed.add(link)
        link = body[link].parent
    keep, light = [], []
    for number, part in enumerate(body):
        for hinge in part.hinges:
            if hinge.name in settings.welded:
                continue
            if number in needed or weights[number] > _LIGHT * weights[0]:
                keep.append(hinge.name)
            else:
                light.append(hinge.name)
    if light:
        notes.append(f"welded at zero, for they carry under {_LIGHT:.0%} of the mass: {', '.join(light)}")
    return keep


def _ankle(body: Skeleton, foot: int) -> Float[np.ndarray, "3"]:
    """The foot's last axis, in the base's frame."""
    at, turn = poses(body)[foot]
    return at + turn @ body[foot].hinges[-1].anchor


def _sole(body: Skeleton, anatomy: Anatomy, settings: Settings, where: str, notes: list[str]) -> Sole:
    found = []
    for side, foot in enumerate(anatomy.legs.feet):
        at, turn = poses(body)[foot]
        found.append(sole_of(body[foot], turn.T @ (anatomy.ankles[side] - at), turn.T @ anatomy.axes))
    given = (settings.sole_depth, settings.sole_length, settings.sole_width, settings.sole_ahead)
    if None not in given:
        return Sole(*(float(number) for number in given if number is not None))
    if found[LEFT] is None or found[RIGHT] is None:
        raise BadInput(
            f"the foot {body[anatomy.legs.feet[LEFT]].name!r} has no geometry that can be read",
            where=where,
            remedy="give sole_length, sole_width, sole_ahead and sole_depth",
        )
    (left, solid), (right, _) = found[LEFT], found[RIGHT]
    sole = Sole(
        (left.depth + right.depth) / 2,
        min(left.length, right.length),
        min(left.width, right.width),
        (left.ahead + right.ahead) / 2,
    )
    sole = Sole(*(own if own is not None else guess for own, guess in zip(given, sole, strict=True)))
    notes.append(
        f"soles, from the feet's {'colliding' if solid else 'visible'} geometry: {sole.length:.3f} x {sole.width:.3f} m, "
        f"middle {100 * sole.ahead:.1f} cm ahead of the ankle, {100 * sole.depth:.1f} cm under it"
    )
    return sole


def _places(body: Skeleton, anatomy: Anatomy, sole: Sole, settings: Settings, where: str, notes: list[str]) -> Places:
    stance = poses(body)

    def upright(link: int, point: Float[np.ndarray, "3"]) -> Place:
        at, turn = stance[link]
        return Place(link, (turn.T @ (point - at), turn.T @ anatomy.axes))

    def named(name: str | None, otherwise: int) -> Place:
        if name is None:
            return upright(otherwise, stance[otherwise][0])
        found = locate(body, name)
        if found is None:
            raise unknown_name("frame", name, [known for link in body for known in link.frames], where=where)
        link, (position, _) = found
        at, turn = stance[link]
        return upright(link, at + turn @ position)

    down = sole.depth * anatomy.axes[:, 2]
    feet = anatomy.legs.feet
    waist, chest = named(settings.waist, anatomy.legs.fork), named(settings.chest, anatomy.chest)
    return Places(
        soles=(upright(feet[LEFT], anatomy.ankles[LEFT] - down), upright(feet[RIGHT], anatomy.ankles[RIGHT] - down)),
        waist=waist,
        chest=chest,
        imu=named(settings.imu, anatomy.legs.fork) if settings.imu else _imu(body, waist, chest, named, notes),
        eyes=_eyes(body, chest, anatomy, stance),
    )


def _imu(body: Skeleton, waist: Place, chest: Place, named: Any, notes: list[str]) -> Place:
    for link in (waist.link, chest.link):
        for name in body[link].frames:
            if "imu" in name.lower():
                notes.append(f"imu: frame {name!r}")
                return named(name, link)
    notes.append("imu: none is named, taken to sit in the waist")
    return waist


def _eyes(body: Skeleton, chest: Place, anatomy: Anatomy, stance: Any) -> Place:
    """A point in front of the chest, four fifths of its way up, and the robot's axes."""
    axes = chest.pose[1]
    seen = cloud(body[chest.link], solid=False)
    if len(seen) == 0:
        return chest
    local = seen @ axes
    low, high = local.min(axis=0), local.max(axis=0)
    middle = float((chest.pose[0] @ axes)[1])
    point = np.array([high[0] + 0.01, middle, low[2] + 0.8 * (high[2] - low[2])])
    return Place(chest.link, (axes @ point, axes))


def _moves(body: Skeleton, anatomy: Anatomy, settings: Settings, where: str) -> Bool[np.ndarray, " joints"]:
    walking = {link for chain in anatomy.legs.chains for link in chain}
    known = [hinge.name for hinge in hinges(body)]
    for name in settings.moves:
        if name not in known:
            raise unknown_name("joint", name, known, where=where)
    return np.array(
        [number in walking or hinge.name in settings.moves for number, link in enumerate(body) for hinge in link.hinges]
    )


def _servos(body: Skeleton, settings: Settings, mass: float, height: float, notes: list[str]) -> Servos:
    joints = hinges(body)
    weight = mass * GRAVITY * height
    stiffness = settings.stiffness if settings.stiffness is not None else 25 * weight
    damping = settings.damping if settings.damping is not None else 0.02 * stiffness
    reflected = settings.reflected if settings.reflected is not None else stiffness / 60000
    usable = [hinge.effort for hinge in joints if 0 < hinge.effort < _PLAUSIBLE * weight]
    stand_in = settings.effort or (max(usable) if usable else 0.5 * weight)
    strange = [hinge.name for hinge in joints if not 0 < hinge.effort < _PLAUSIBLE * weight]
    if strange:
        notes.append(f"effort taken as {stand_in:.3g} N m, for none that is plausible is given: {', '.join(strange)}")
    return Servos(
        np.full(len(joints), stiffness),
        np.full(len(joints), damping),
        np.array([stand_in if hinge.name in strange else hinge.effort for hinge in joints]),
        np.array([hinge.reflected if hinge.reflected > 0 else reflected for hinge in joints]),
    )


def _stance(
    model: Any, body: Skeleton, anatomy: Anatomy, sole: Sole, settings: Settings, where: str, notes: list[str]
) -> tuple[Gait, Float[np.ndarray, " positions"]]:
    distance = settings.foot_distance
    if distance is None:
        distance = float((anatomy.ankles[LEFT] - anatomy.ankles[RIGHT]) @ anatomy.axes[:, 1])
        notes.append(f"foot_distance, from the zero posture: {distance:.3f} m")
    bent = _bent(body, anatomy)
    height = settings.com_height
    if height is None:
        height = _height(model, body, anatomy, sole, bent)
        notes.append(f"com_height, with hips, knees and ankles bent by 0.4, 0.8 and 0.4 rad: {height:.3f} m")
    scale = height / ICUB_HEIGHT
    gait = Gait(
        com_height=height,
        foot_distance=distance,
        foot_length=sole.length,
        foot_width=sole.width,
        foot_ahead=sole.ahead,
        step_time=settings.step_time or 0.6 * np.sqrt(scale),
        double_support=settings.double_support if settings.double_support is not None else 0.12 * np.sqrt(scale),
        step_height=settings.step_height if settings.step_height is not None else 0.02 * scale,
        margin=settings.margin or (0.1 * sole.length, 0.2 * sole.width),
        hull=settings.hull or _hull(distance, scale),
        fastest=Velocity(*(settings.fastest or (0.3 * np.sqrt(scale), 0.1 * np.sqrt(scale), 0.3))),
    )
    found = _standing(model, anatomy, bent, height, distance)
    if found.residual > _CLOSE:
        raise BadInput(
            f"a centre of mass at {height:g} m is out of reach",
            where=f"{where}: com_height",
            remedy="give a lower one, or a smaller foot_distance",
        )
    return gait, found.q


def _hull(distance: float, scale: float) -> tuple[tuple[float, float], ...]:
    """Corners where the left sole may land: a little closer than standing, up to a long step aside."""
    ahead_, inner, outer = 0.24 * scale, distance - 0.02 * scale, distance + 0.16 * scale
    return ((-ahead_, inner), (-ahead_, outer), (ahead_, outer), (ahead_, inner))


def _bent(body: Skeleton, anatomy: Anatomy) -> Float[np.ndarray, " positions"]:
    """A configuration with bent legs: the axes nearest to the left one are hip, knee and ankle."""
    joints = hinges(body)
    q = np.clip(np.zeros(len(joints)), [h.lower for h in joints], [h.upper for h in joints])
    stance, names = poses(body), [hinge.name for hinge in joints]
    for chain in anatomy.legs.chains:
        pitching: list[tuple[Hinge, float]] = []
        for link in chain:
            for hinge in body[link].hinges:
                along = float((stance[link][1] @ hinge.axis) @ anatomy.axes[:, 1])
                if abs(along) > 0.8:
                    pitching.append((hinge, np.sign(along)))
        for (hinge, sign), angle in zip(pitching, BENT.values(), strict=False):
            q[names.index(hinge.name)] = np.clip(sign * angle, hinge.lower, hinge.upper)
    facing = quaternion(anatomy.axes.T)
    return np.concatenate([np.zeros(3), facing, q])


def _height(model: Any, body: Skeleton, anatomy: Anatomy, sole: Sole, bent: Float[np.ndarray, " positions"]) -> float:
    import mujoco

    data = mujoco.MjData(model)
    data.qpos[:] = bent
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    floor = np.mean([data.site(f"{side}_sole").xpos[2] for side in ("left", "right")])
    return float(data.subtree_com[1][2] - floor)


def _standing(
    model: Any, anatomy: Anatomy, bent: Float[np.ndarray, " positions"], height: float, distance: float
) -> Stand:
    walking = {model.joint(i).name: i - 1 for i in range(1, model.njnt)}
    links = {link for chain in anatomy.legs.chains for link in chain}
    free = [number for number in walking.values() if _of(model, number + 1) in links]
    soles = np.array([[0.0, distance / 2, 0.0], [0.0, -distance / 2, 0.0]])
    start = bent.copy()
    start[2] = height
    return stand(model, start, free, np.array([0.0, 0.0, height]), soles)


def _of(model: Any, joint: int) -> int:
    """The skeleton's link of a joint: MuJoCo's bodies less the world and the soles before it."""
    body = int(model.jnt_bodyid[joint])
    return body - 1 - sum(model.body(i).name in ("left_sole", "right_sole") for i in range(1, body))
