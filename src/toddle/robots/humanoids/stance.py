"""How a humanoid steps, from its proportions, and how it stands; what is out of its legs' reach is refused.

The scale of a robot is its centre of mass' height while walking, against the iCub's on which the gait was tuned:
lengths go with it, times and speeds with its square root (the pendulum's own scaling).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.robots.gait import Gait
from toddle.robots.humanoid import LEFT, RIGHT
from toddle.robots.humanoids.description import quaternion
from toddle.robots.humanoids.home import Stand, stand
from toddle.robots.humanoids.limbs import Legs
from toddle.robots.humanoids.settings import GAIT_KEYS, Settings
from toddle.robots.humanoids.skeleton import Hinge, Skeleton, hinges, poses
from toddle.robots.humanoids.soles import Sole
from toddle.signals import Velocity

ICUB_HEIGHT = 0.465  # [m]
BENT = (-0.4, 0.8, -0.4)  # hip, knee, ankle about the axis to the left [rad]
_LEFTWARD = 0.8  # cosine; an axis nearer to the left one bends the leg forwards
_CLOSE = 1e-6  # [m, rad]
_CLOSE_FIVE = 2e-3  # without an ankle roll, both soles are only that flat [m, rad]
_EASY = 0.28  # feet farther apart than this share of the centre of mass' height aren't stepped with
_BETWEEN = 0.02  # left between two soles that stand side by side [m]
_WIDEST = 0.8  # feet further apart than that share of the centre of mass' height are no feet
_STRETCHES = (0.0, 0.25, 0.5, 0.75, -0.5, -1.0)  # heights tried where none is given: 0 bent legs, 1 straight ones
_MARGIN = (0.1, 0.2)  # of the sole's length and width

Legs3 = tuple[tuple[tuple[int, Hinge, float], ...], ...]


def stance(
    model: Any,
    body: Skeleton,
    legs: Legs,
    axes: Float[np.ndarray, "3 3"],
    ankles: Float[np.ndarray, "2 3"],
    sole: Sole,
    settings: Settings,
    where: str,
    notes: list[str],
) -> tuple[Gait, Float[np.ndarray, " positions"]]:
    """The gait, and a configuration that stands as the gait begins.

    Args:
        model: MuJoCo's, with the sites of `toddle.robots.humanoids.physics`.
        body: the same robot.
        legs: of it.
        axes: ahead, left, up in the base's frame.
        ankles: in the base's frame [m].
        sole: both soles.
        settings: what is known.
        where: the file, for messages.
        notes: what is inferred is added to them.

    Raises:
        BadInput: the gait is no use, or the legs can't reach so far.
    """
    bends = tuple(_bends(body, chain, axes) for chain in legs.chains)
    if any(len(bend) < 3 for bend in bends):
        raise BadInput(
            "a leg has no hip, knee and ankle that bend forwards with the joints at zero",
            where=where,
            remedy="name the feet with left_foot and right_foot; the zero posture must be upright",
        )
    joints = hinges(body)
    straight = _configuration(joints, axes, ())
    bent = _configuration(joints, axes, bends)
    walking = {hinge.name for chain in legs.chains for link in chain for hinge in body[link].hinges}
    free = [number for number, hinge in enumerate(joints) if hinge.name in walking]
    close = _CLOSE if len(free) == 12 else _CLOSE_FIVE
    known = settings.com_height is not None or settings.gait is not None
    low, high = _height(model, bent), _height(model, straight)
    tried = list(_STRETCHES)
    while True:
        said: list[str] = []
        guess = low + tried.pop(0) * (high - low)
        gait = _gait(settings, sole, axes, ankles, guess, where, said)
        found = _standing(model, bent, free, gait)
        if found.residual <= close or known or not tried:
            break
    notes += said
    if found.residual > close:
        raise BadInput(
            f"with its centre of mass {gait.com_height:.3f} m high and its feet {gait.foot_distance:.3f} m apart "
            "it can't stand flat",
            where=f"{where}: com_height",
            remedy=f"with straight legs it is {high:.3f} m high, with bent ones {low:.3f} m: give com_height in "
            f"between, and foot_distance near the hips' width{_stuck(joints, found.q)}",
        )
    if settings.hull is None and settings.gait is None:
        gait = _shrunk(model, gait, bends, found.q, notes)
    _check_hull(model, gait, bends, found.q, where)
    return gait, found.q


def _stuck(joints: tuple[Hinge, ...], q: Float[np.ndarray, " positions"]) -> str:
    """Names the joints that are at their limits, and bind."""
    bent = zip(joints, q[7:], strict=True)
    found = [hinge.name for hinge, angle in bent if not hinge.lower < angle < hinge.upper]
    return f" (at their limits: {', '.join(found[:6])})" if found else ""


def _standing(model: Any, bent: Float[np.ndarray, " positions"], free: list[int], gait: Gait) -> Stand:
    """The posture in which the gait begins."""
    half = gait.foot_distance / 2
    start = bent.copy()
    start[2] = gait.com_height
    com = np.array([0.0, 0.0, gait.com_height])
    return stand(model, start, free, com, np.array([[0.0, half, 0.0], [0.0, -half, 0.0]]))


def _bends(
    body: Skeleton, chain: tuple[int, ...], axes: Float[np.ndarray, "3 3"]
) -> tuple[tuple[int, Hinge, float], ...]:
    """Hip, knee and ankle of a leg: number among the joints, hinge, and sign about the axis to the left."""
    zero, order = poses(body), [hinge.name for hinge in hinges(body)]
    found = []
    for link in chain:
        for hinge in body[link].hinges:
            along = float((zero[link][1] @ hinge.axis) @ axes[:, 1])
            if abs(along) > _LEFTWARD:
                found.append((order.index(hinge.name), hinge, float(np.sign(along))))
    return tuple(found[:3])


def _configuration(joints: tuple[Hinge, ...], axes: Float[np.ndarray, "3 3"], bends: Legs3) -> np.ndarray:
    q = np.array([np.clip(0.0, hinge.lower, hinge.upper) for hinge in joints])
    for bend in bends:
        for (number, hinge, sign), angle in zip(bend, BENT, strict=True):
            q[number] = np.clip(sign * angle, hinge.lower, hinge.upper)
    return np.concatenate([np.zeros(3), quaternion(axes.T), q])


def _height(model: Any, q: Float[np.ndarray, " positions"]) -> float:
    """The centre of mass over the soles [m]."""
    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    floor = np.mean([data.site(f"{side}_sole").xpos[2] for side in ("left", "right")])
    return float(data.subtree_com[1][2] - floor)


def _gait(
    settings: Settings,
    sole: Sole,
    axes: Float[np.ndarray, "3 3"],
    ankles: Float[np.ndarray, "2 3"],
    bent: float,
    where: str,
    notes: list[str],
) -> Gait:
    said = {key: getattr(settings, key) for key in GAIT_KEYS if getattr(settings, key) is not None}
    if settings.fastest is not None:
        said["fastest"] = Velocity(*settings.fastest)
    said |= {"foot_length": sole.length, "foot_width": sole.width, "foot_ahead": sole.ahead}
    if settings.gait is not None:
        return replace(settings.gait, **said)
    if "foot_distance" not in said:
        said["foot_distance"] = float((ankles[LEFT] - ankles[RIGHT]) @ axes[:, 1])
        notes.append(f"foot_distance, from the zero posture: {said['foot_distance']:.3f} m")
    if "com_height" not in said:
        said["com_height"] = bent
        notes.append(f"com_height, with hips, knees and ankles bent by about 0.4, 0.8 and 0.4 rad: {bent:.3f} m")
    distance, height = said["foot_distance"], said["com_height"]
    if distance > _WIDEST * max(height, bent):
        raise BadInput(
            f"its feet would be {distance:.2f} m apart under a centre of mass {max(height, bent):.2f} m high",
            where=where,
            remedy="name the feet with left_foot and right_foot, or give foot_distance and com_height",
        )
    easy = max(_EASY * height, sole.width + _BETWEEN)
    if settings.foot_distance is None and distance > easy:
        said["foot_distance"] = distance = easy
        notes.append(
            f"foot_distance drawn in to {distance:.3f} m: narrow soles can't take the weight over a wider stance"
        )
    scale = height / ICUB_HEIGHT
    pace = float(np.sqrt(scale))
    guess = {
        "step_time": round(0.6 * pace, 2),
        "double_support": round(0.12 * pace, 2),
        "step_height": 0.02 * scale,
        "margin": (_MARGIN[0] * sole.length, _MARGIN[1] * sole.width),
        "hull": _hull(distance, scale),
        "fastest": Velocity(0.3 * pace, 0.1 * pace, 0.3),
    }
    missing = [key for key in guess if key not in said]
    if missing:
        notes.append(f"in proportion to the iCub, {scale:.2f} times as high: {', '.join(missing)}")
    try:
        return Gait(**(guess | said))
    except BadInput as error:
        raise BadInput(error.what, where=f"{where}: {error.where}", remedy=error.remedy) from None


def _hull(distance: float, scale: float) -> tuple[tuple[float, float], ...]:
    """Corners where the left sole may land: a little closer than standing, up to a long step ahead and aside."""
    reach, inner, outer = 0.24 * scale, distance - 0.02 * scale, distance + 0.16 * scale
    return ((-reach, inner), (-reach, outer), (reach, outer), (reach, inner))


def _reach(
    model: Any, gait: Gait, bends: Legs3, home: Float[np.ndarray, " positions"]
) -> tuple[Float[np.ndarray, " corners"], float]:
    """The legs that each corner of the hull asks for, each leg taking half of the step, and the legs there are [m]."""
    data = mujoco.MjData(model)
    data.qpos[:] = home
    mujoco.mj_kinematics(model, data)
    hip, knee, ankle = (data.xanchor[number + 1] for number, _, _ in bends[LEFT])
    longest = float(np.linalg.norm(knee - hip) + np.linalg.norm(ankle - knee))
    steps = np.array([[x / 2, (y - gait.foot_distance) / 2, 0.0] for x, y in gait.hull])
    asked = [max(float(np.linalg.norm(ankle + sign * step - hip)) for sign in (1.0, -1.0)) for step in steps]
    return np.array(asked), longest


def _shrunk(model: Any, gait: Gait, bends: Legs3, home: Float[np.ndarray, " positions"], notes: list[str]) -> Gait:
    """The gait with its hull drawn together, around where the foot stands, until the legs can span it."""
    whole = np.array(gait.hull)
    middle = np.array([0.0, gait.foot_distance])
    percent = 100
    while percent > 30:
        corners = middle + percent / 100 * (whole - middle)
        gait = replace(gait, hull=tuple((float(x), float(y)) for x, y in corners))
        asked, longest = _reach(model, gait, bends, home)
        if asked.max() <= longest:
            break
        percent -= 5
    if percent < 100:
        notes.append(f"hull drawn together to {percent} %, which the legs can span")
    return gait


def _check_hull(model: Any, gait: Gait, bends: Legs3, home: Float[np.ndarray, " positions"], where: str) -> None:
    """Refuses a hull with a corner that the legs can't span.

    Raises:
        BadInput: there is one.
    """
    asked, longest = _reach(model, gait, bends, home)
    worst = int(asked.argmax())
    if asked[worst] > longest:
        x, y = gait.hull[worst]
        raise BadInput(
            f"its corner ({x:g}, {y:g}) m asks for legs of {asked[worst]:.3f} m, and they have {longest:.3f} m",
            where=f"{where}: hull",
            remedy="bring that corner nearer, or lower com_height",
        )
