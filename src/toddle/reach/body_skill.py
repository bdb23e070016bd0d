"""A skill that knows its body: a forward model learned from a few movements, a solver on it, and how sure it is.

It is a value, like `toddle.reach.skill.Skill`: saved, loaded, compared, asked. Where it was learned with orientations,
it can be asked for whole poses.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.reach.body_config import BodyConfig
from toddle.reach.evaluate.expectation import Expectation
from toddle.reach.model.model import Fit, PoseModel
from toddle.reach.observe import Observe, observer
from toddle.reach.solve.looking import correct
from toddle.reach.solve.solver import Choice as Posture
from toddle.reach.solve.solver import Solver, solver_of
from toddle.reach.structures import part
from toddle.robots.body import Body, Plant
from toddle.robots.catalogue import Choice
from toddle.signals import Experience, Solution, Verdict

_AT_LIMIT = 1e-6  # a joint closer to its limit than this share of its range stands at it
_FARTHEST = 1e6  # [m]
_COARSE = 0.05  # what nobody would call reached, however coarse the model [m]
_SEEN = 0.005  # error up to which a target counts as reached where somebody looks [m]
Numbers = Sequence[float] | np.ndarray
_UNIT = 1e-3  # by which a quaternion's length may differ from one


@dataclass(frozen=True)
class BodySkill:
    """A body that was learned, and can be solved.

    Attributes:
        source: what `toddle.load` makes the body from.
        joints: names of the actuated joints, base first.
        lower: lower limits [rad or m].
        upper: upper limits [rad or m].
        home: where learning started [rad or m].
        config: how it was learned.
        why: why this structure was tried.
        fit: the model, and how it sits in the movements.
        sound: whether its structure fits: what it misses can't be told from noise.
        experience: the movements.
        targets: the fixed test set [m], never learned from.
        errors: open-loop error on each of its points [m]; empty where nobody could test.
        figures: how well it did.
    """

    source: Choice
    joints: tuple[str, ...]
    lower: Float[np.ndarray, " joints"]
    upper: Float[np.ndarray, " joints"]
    home: Float[np.ndarray, " joints"]
    config: BodyConfig
    why: str
    fit: Fit
    sound: bool
    experience: Experience
    targets: Float[np.ndarray, "points space"]
    errors: Float[np.ndarray, " tested"]
    figures: Mapping[str, object]

    @cached_property
    def solver(self) -> Solver:
        """What finds joint values on the model."""
        return solver_of(self.fit.model, self.lower, self.upper, self.experience)

    @cached_property
    def expectation(self) -> Expectation:
        """How far from the target its answers end."""
        shown, count, noise = len(self.fit.miss), len(self.experience.q), self.config.noise
        if shown < count:
            return Expectation.held_out(self.fit.model, part(self.experience, shown, count), sensor=noise)
        # where the structure fits, noise is what it was found to be: no chance excess of it is the body's
        sensor = max(noise or 0.0, self.fit.sensor) if self.sound else noise
        return Expectation.of(self.fit, self.experience, sensor=sensor)

    @cached_property
    def typical(self) -> float:
        """The error that its answers have typically [m]."""
        return float(np.mean(self.expectation.at(self.experience.q[:200])[0]))

    @property
    def doubt(self) -> float:
        """How far from a target its model must stay for that to be out of reach [m]: further than it may be wrong."""
        return max(0.002, 2 * self.typical)

    @property
    def turned(self) -> bool:
        """Whether it knows the tip's orientation."""
        return self.experience.turn is not None and isinstance(self.fit.model, PoseModel)

    def predict(
        self,
        targets: Float[np.ndarray, "batch space"],
        turns: Float[np.ndarray, "batch 3 3"] | None = None,
        *,
        near: Float[np.ndarray, "*batch joints"] | None = None,
    ) -> Float[np.ndarray, "batch joints"]:
        """Open-loop answers for targets [m], within the joint limits [rad or m]."""
        return self.solver.solve(np.asarray(targets, float), turns, near=near).q


def solve_body(
    skill: BodySkill,
    target: Numbers,
    *,
    orientation: Numbers | None = None,
    near: Numbers | None = None,
    choice: Posture | None = None,
    robot: Body | Plant | None = None,
    looks: int = 3,
    tolerance: float | None = None,
) -> Solution:
    """Joint values that bring the tip to a target; see `toddle.solve`."""
    aim, turn = _aim(skill, target), _turn(skill, orientation)
    present = None if near is None else posture_of(skill, near)
    way: Posture = choice or ("first" if present is None else "nearest")
    turns = None if turn is None else turn[None]
    answers = skill.solver.solve(aim[None], turns, near=present, choice=way)
    q = answers.q[0]
    if not answers.solved[0]:
        q, distance, angle = skill.solver.nearest(aim, turn)
        if distance > skill.doubt or angle > _least_angle(turn):
            return _out_of_reach(skill, q, distance, angle)
    if robot is not None and looks > 0:
        return _looked(skill, aim, q, observer(robot), looks, _SEEN if tolerance is None else tolerance)
    mean, most = (float(value[0]) for value in skill.expectation.at(q[None]))
    allowed = min(max(2 * skill.typical, 0.001), _COARSE) if tolerance is None else tolerance
    said = f"error to expect: {1000 * mean:.2f} mm, under {1000 * most:.2f} mm in nine of ten"
    return _judged(skill, q, (mean, most), 0, allowed, said)


def solutions(
    skill: BodySkill,
    target: Numbers,
    count: int,
    *,
    orientation: Numbers | None = None,
    near: Numbers | None = None,
) -> tuple[Solution, ...]:
    """Several clearly different postures that bring the tip to a target, the nearest to the present one first.

    Args:
        skill: what was learned.
        target: where the tip should go, in the base frame [m].
        count: how many, at most.
        orientation: how it should be turned: a unit quaternion (w, x, y, z).
        near: the present posture [rad or m]; None: home.

    Raises:
        BadInput: the target, the orientation or the posture can't be used.
    """
    aim, turn = _aim(skill, target), _turn(skill, orientation)
    present = skill.home if near is None else posture_of(skill, near)
    found = skill.solver.distinct(aim, turn, count, near=present)
    if not len(found):
        return ()
    mean, most = skill.expectation.at(found)
    said = "one of {} postures, {:.0f} % of the ranges away from the present one"
    away = 100 * np.max(np.abs(found - present) / (skill.upper - skill.lower), axis=1)
    return tuple(
        Solution(q, float(m), 0, Verdict.REACHED, said.format(len(found), far), float(e))
        for q, m, e, far in zip(found, mean, most, away, strict=True)
    )


def _looked(
    skill: BodySkill, aim: np.ndarray, q: np.ndarray, observe: Observe, looks: int, tolerance: float
) -> Solution:
    """The answer after looking where the tip went."""
    course = correct(
        skill.fit.model, skill.solver, observe, aim[None], q[None], looks, sensor=skill.config.look_noise,
        lower=skill.lower, upper=skill.upper,
    )  # fmt: skip
    error = float(course.expected[-1, 0])
    said = f"error after {looks} look{'s' * (looks > 1)}: {1000 * error:.2f} mm, allowed: {1000 * tolerance:.2f} mm"
    return _judged(skill, course.q[-1, 0], (error, float(course.expected_90[-1, 0])), looks, tolerance, said)


def _judged(
    skill: BodySkill, q: np.ndarray, errors: tuple[float, float], steps: int, tolerance: float, said: str
) -> Solution:
    """The answer with its verdict."""
    if errors[0] <= tolerance:
        return Solution(q, errors[0], steps, Verdict.REACHED, said, errors[1])
    held = at_limits(skill, q)
    if held:
        return Solution(q, errors[0], steps, Verdict.AT_JOINT_LIMIT, f"{said}; at its limit: {held}", errors[1])
    return Solution(q, errors[0], steps, Verdict.NOT_CONVERGED, said, errors[1])


def _out_of_reach(skill: BodySkill, q: np.ndarray, distance: float, angle: float) -> Solution:
    nearest = skill.fit.model.forward(q[None])[0]
    where = " ".join(f"{value:.4f}" for value in nearest)
    held = at_limits(skill, q)
    turned = f" and {1000 * angle:.0f} mrad" if angle > 0 else ""
    stands = f"; at its limit there: {held}" if held else ""
    reason = f"{1000 * distance:.1f} mm{turned} beyond its reach; the nearest it comes is {where}{stands}"
    mean, most = (float(value[0]) for value in skill.expectation.at(q[None]))
    return Solution(q, distance + mean, 0, Verdict.OUT_OF_REACH, reason, distance + most, nearest)


def at_limits(skill: BodySkill, q: Float[np.ndarray, " joints"]) -> str:
    """Names of the joints that stand at a limit."""
    share = (q - skill.lower) / (skill.upper - skill.lower)
    stands = np.minimum(share, 1 - share) < _AT_LIMIT
    return ", ".join(name for name, at in zip(skill.joints, stands, strict=True) if at)


def posture_of(skill: BodySkill, near: Numbers) -> Float[np.ndarray, " joints"]:
    """A posture that was given, within the limits [rad or m].

    Raises:
        BadInput: it isn't one finite number for each joint.
    """
    try:
        q = np.asarray(near, float)
    except (TypeError, ValueError):
        q = np.empty(0)
    if q.shape != (len(skill.joints),) or not np.all(np.isfinite(q)):
        names = ", ".join(skill.joints)
        raise BadInput(f"{near!r} is no posture", where="near", remedy=f"give a number for each of {names}")
    return np.clip(q, skill.lower, skill.upper)


def _aim(skill: BodySkill, target: Numbers) -> Float[np.ndarray, " space"]:
    try:
        aim = np.asarray(target, float)
    except (TypeError, ValueError):
        raise BadInput(f"{target!r} is not a position", where="target", remedy="give numbers [m]") from None
    space = skill.fit.model.space
    if aim.shape != (space,):
        got = "x".join(map(str, aim.shape)) or "one number"
        raise BadInput(f"it has {got}", where="target", remedy=f"give {space} coordinates [m]")
    if not np.all(np.abs(aim) < _FARTHEST):  # false for nan, too
        raise BadInput("a coordinate is no finite distance", where="target", remedy=f"give {space} numbers [m]")
    return aim


def _turn(skill: BodySkill, orientation: Numbers | None) -> Float[np.ndarray, "3 3"] | None:
    if orientation is None:
        return None
    if not skill.turned:
        raise BadInput("this skill knows no orientation", where="orientation", remedy="learn again with --pose")
    try:
        quaternion = np.asarray(orientation, float)
    except (TypeError, ValueError):
        quaternion = np.empty(0)
    if quaternion.shape != (4,) or not abs(np.linalg.norm(quaternion) - 1) < _UNIT:
        raise BadInput(f"{orientation!r} is no unit quaternion", where="orientation", remedy="give W X Y Z")
    return turn_of(quaternion / np.linalg.norm(quaternion))


def turn_of(quaternion: Sequence[float] | Float[np.ndarray, "4"]) -> Float[np.ndarray, "3 3"]:
    """The rotation of a unit quaternion (w, x, y, z)."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _least_angle(turn: np.ndarray | None) -> float:
    return np.inf if turn is None else 0.01
