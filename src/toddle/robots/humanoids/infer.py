"""From a skeleton and what is said of it to a `Humanoid`; what is not said is inferred, and noted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from toddle.failures import BadInput, unknown_name
from toddle.robots.gait import GRAVITY
from toddle.robots.humanoid import LEFT, RIGHT, Humanoid
from toddle.robots.humanoids.anatomy import Anatomy, anatomy_of, check_masses, trimmed
from toddle.robots.humanoids.physics import Place, Places, Servos, describe
from toddle.robots.humanoids.settings import Settings
from toddle.robots.humanoids.skeleton import Skeleton, hinges, locate, poses
from toddle.robots.humanoids.soles import Sole, cloud, sole_of
from toddle.robots.humanoids.stance import stance
from toddle.robots.humanoids.tree import frame, tree_of

_PLAUSIBLE = 20.0  # torques beyond so many m g h stand for none
_STIFFNESS, _DAMPING, _REFLECTED = 25.0, 0.02, 1 / 60000  # of m g h; of the stiffness [s]; of the stiffness [s^2]


def humanoid(skeleton: Skeleton, settings: Settings, where: str) -> Humanoid:
    """The humanoid of a skeleton.

    Args:
        skeleton: every link of the robot.
        settings: what is known of it.
        where: the file, for messages.

    Raises:
        BadInput: the robot can't walk so; the line says why.
    """
    notes: list[str] = []
    body = trimmed(skeleton, settings, where, notes)
    anatomy = anatomy_of(body, settings, where, notes)
    check_masses(skeleton, body, anatomy, where)
    sole = _sole(body, anatomy, settings, where, notes)
    places = _places(body, anatomy, sole, settings, where, notes)
    tree, bodies = tree_of(body)
    name, mass, joints = settings.name or body[0].name, float(tree.mass.sum()), hinges(body)
    bare = tuple(replace(link, shapes=()) for link in body)
    model = describe(name, bare, places, sole, _servos(body, settings, mass, 1.0, [])).compile()
    gait, home = stance(model, body, anatomy.legs, anatomy.axes, anatomy.ankles, sole, settings, where, notes)
    servos = _servos(body, settings, mass, gait.com_height, notes)
    return Humanoid(
        name=name,
        tree=tree,
        joints=tuple(hinge.name for hinge in joints),
        lower=np.array([hinge.lower for hinge in joints]),
        upper=np.array([hinge.upper for hinge in joints]),
        effort=servos.effort,
        stiffness=servos.stiffness,
        damping=servos.damping,
        moves=_moves(body, anatomy, settings),
        home=home,
        soles=(frame(bodies, *places.soles[LEFT]), frame(bodies, *places.soles[RIGHT])),
        waist=frame(bodies, *places.waist),
        chest=frame(bodies, *places.chest),
        imu=frame(bodies, *places.imu),
        gait=gait,
        spec=describe(name, body, places, sole, servos),
        notes=tuple(notes),
    )


def _sole(body: Skeleton, anatomy: Anatomy, settings: Settings, where: str, notes: list[str]) -> Sole:
    """Both soles: what is said of them, and the rest from the smaller one's geometry."""
    gait = settings.gait
    said = (gait.foot_length, gait.foot_width, gait.foot_ahead) if gait else (None, None, None)
    given = (
        settings.sole_depth,
        settings.sole_length or said[0],
        settings.sole_width or said[1],
        settings.sole_ahead if settings.sole_ahead is not None else said[2],
    )
    if None not in given:
        return Sole(*(float(number) for number in given if number is not None))
    found = []
    for side, foot in enumerate(anatomy.legs.feet):
        at, turn = poses(body)[foot]
        seen = sole_of(body[foot], turn.T @ (anatomy.ankles[side] - at), turn.T @ anatomy.axes)
        if seen is None:
            raise BadInput(
                f"the foot {body[foot].name!r} has no geometry under its ankle",
                where=where,
                remedy="give sole_length, sole_width, sole_ahead and sole_depth in a configuration file",
            )
        found.append(seen)
    (left, solid), (right, _) = found
    guess = (
        (left.depth + right.depth) / 2,
        min(left.length, right.length),
        min(left.width, right.width),
        (left.ahead + right.ahead) / 2,
    )
    sole = Sole(*(own if own is not None else other for own, other in zip(given, guess, strict=True)))
    kind = "colliding" if solid else "visible"
    notes.append(
        f"soles (from the feet's {kind} geometry, what is not given): {sole.length:.3f} x {sole.width:.3f} m, "
        f"middle {100 * sole.ahead:.1f} cm ahead of the ankle, {100 * sole.depth:.1f} cm under it"
    )
    return sole


def _places(body: Skeleton, anatomy: Anatomy, sole: Sole, settings: Settings, where: str, notes: list[str]) -> Places:
    zero = poses(body)

    def upright(link: int, point: Float[np.ndarray, "3"]) -> Place:
        at, turn = zero[link]
        return Place(link, (turn.T @ (point - at), turn.T @ anatomy.axes))

    def named(key: str, name: str | None, otherwise: int) -> Place:
        if name is None:
            return upright(otherwise, zero[otherwise][0])
        found = locate(body, name)
        if found is None:
            raise unknown_name(
                "frame", name, [known for link in body for known in link.frames], where=f"{where}: {key}"
            )
        link, (position, _) = found
        at, turn = zero[link]
        return upright(link, at + turn @ position)

    down, feet = sole.depth * anatomy.axes[:, 2], anatomy.legs.feet
    waist = named("waist", settings.waist, anatomy.legs.fork)
    chest = named("chest", settings.chest, anatomy.chest)
    imu = settings.imu or _imu(body, waist.link, chest.link)
    if settings.imu is None:
        notes.append(f"imu: the frame {imu!r}" if imu else "imu: no frame has that name, taken to sit in the waist")
    return Places(
        soles=(upright(feet[LEFT], anatomy.ankles[LEFT] - down), upright(feet[RIGHT], anatomy.ankles[RIGHT] - down)),
        waist=waist,
        chest=chest,
        imu=named("imu", imu, waist.link),
        eyes=_eyes(body, chest),
    )


def _imu(body: Skeleton, *links: int) -> str | None:
    names = [name for link in links for name in body[link].frames]
    return next((name for name in names if "imu" in name.lower()), None)


def _eyes(body: Skeleton, chest: Place) -> Place:
    """A point in front of the chest, four fifths of its way up, and the robot's axes."""
    axes = chest.pose[1]
    seen = cloud(body[chest.link], solid=False) @ axes
    if len(seen) == 0:
        return chest
    low, high = seen.min(axis=0), seen.max(axis=0)
    middle = float((chest.pose[0] @ axes)[1])
    point = np.array([high[0] + 0.01, middle, low[2] + 0.8 * (high[2] - low[2])])
    return Place(chest.link, (axes @ point, axes))


def _moves(body: Skeleton, anatomy: Anatomy, settings: Settings) -> Bool[np.ndarray, " joints"]:
    walking = {link for chain in anatomy.legs.chains for link in chain}
    return np.array(
        [number in walking or hinge.name in settings.moves for number, link in enumerate(body) for hinge in link.hinges]
    )


def _servos(body: Skeleton, settings: Settings, mass: float, height: float, notes: list[str]) -> Servos:
    """Servos in proportion to the robot's weight and height, where nothing is said of them."""
    joints, weight = hinges(body), mass * GRAVITY * height
    stiffness = settings.stiffness or _STIFFNESS * weight
    damping = settings.damping if settings.damping is not None else _DAMPING * stiffness
    reflected = settings.reflected if settings.reflected is not None else _REFLECTED * stiffness
    usable = [hinge.effort for hinge in joints if 0 < hinge.effort < _PLAUSIBLE * weight]
    stand_in = settings.effort or (max(usable) if usable else 0.5 * weight)
    strange = [hinge.name for hinge in joints if not 0 < hinge.effort < _PLAUSIBLE * weight]
    if strange:
        notes.append(f"effort taken as {stand_in:.3g} N m, for none that is plausible is given: {', '.join(strange)}")
    if settings.stiffness is None:
        notes.append(f"stiffness {stiffness:.0f} N m/rad and damping {damping:.0f} N m s/rad, from weight and height")
    return Servos(
        np.full(len(joints), stiffness),
        np.full(len(joints), damping),
        np.array([stand_in if hinge.name in strange else hinge.effort for hinge in joints]),
        np.array([hinge.reflected if hinge.reflected > 0 else reflected for hinge in joints]),
    )
