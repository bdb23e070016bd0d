"""A skill: what learning leaves. Learner state, solver, the body's names and limits, and how well it did.

It is a value: it can be saved, loaded, compared and shown. It answers alone (one shot), or with somebody who looks
where the tip went (observed correction).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from toddle.failures import BadInput
from toddle.reach.config import ReachConfig
from toddle.reach.learn.learner import Learner
from toddle.reach.observe import Observe, observer
from toddle.reach.solve.closed_loop import reach_for
from toddle.reach.solve.memory import Memory
from toddle.reach.unit_box import UnitBox
from toddle.robots.body import Body, Plant
from toddle.robots.catalogue import Choice
from toddle.signals import Solution, Verdict

_NEIGHBOURS = 5  # held-out errors averaged for the error to expect
_BATCH = 512  # targets answered at once: a memory compares each with all that it holds
_COARSE = 0.05  # what nobody would call reached, however coarse the skill [m]
_AT_LIMIT = 1e-3  # a joint closer to its limit than this share of its range stands at it
_FARTHEST = 1e6  # [m]
_GAP = 3.0  # a target this many typical gaps away from everything visited is out of reach


@dataclass(frozen=True)
class Skill:
    """An inverse kinematics that was learned.

    Attributes:
        source: what `toddle.load` makes the body from.
        joints: names of the actuated joints.
        home: joint values that learning started from [rad or m].
        config: how it was learned.
        hidden: hidden layers of its perceptron.
        box: the unit box it works in (and with it, the joint limits).
        learner: the learner.
        state: what it learned.
        seen: a uniform sample of the positions visited while learning [m].
        postures: the joint values that led there [rad or m].
        targets: the fixed test set [m], never learned from.
        errors: open-loop error on each of its points [m].
        figures: how well it did (see `toddle.reach.evaluate.figures`).
    """

    source: Choice
    joints: tuple[str, ...]
    home: Float[np.ndarray, " joints"]
    config: ReachConfig
    hidden: tuple[int, ...]
    box: UnitBox
    learner: Learner
    state: object
    seen: Float[np.ndarray, "kept space"]
    postures: Float[np.ndarray, "kept joints"]
    targets: Float[np.ndarray, "points space"]
    errors: Float[np.ndarray, " points"]
    figures: Mapping[str, object]

    def predict(self, targets: Float[np.ndarray, "batch space"]) -> Float[np.ndarray, "batch joints"]:
        """One-shot answers for targets [m], within the joint limits [rad or m]."""
        return np.asarray(_predict(self.box, self.learner, self.state, jnp.asarray(targets, jnp.float32)))

    def reach_for(
        self, observe: Observe, targets: Float[np.ndarray, "batch space"], looks: int
    ) -> tuple[Float[np.ndarray, "batch joints"], Float[np.ndarray, "answers batch"]]:
        """Answers for targets [m], corrected by looking; and the best error after 0, 1, ... looks [m]."""
        q, x = (jnp.asarray(values, jnp.float32) for values in (self.postures, self.seen))
        memory = Memory(self.box.q_to_unit(q), self.box.x_to_unit(x))
        return reach_for(self.box, self.learner, self.state, observe, targets, looks, memory)

    def expected_error(self, target: Float[np.ndarray, " space"]) -> float:
        """The open-loop error to expect at a target [m]: the mean over the nearest held-out test targets."""
        near = np.argsort(np.sum((self.targets - target) ** 2, axis=1))[:_NEIGHBOURS]
        return float(self.errors[near].mean())

    def reach(self, target: Float[np.ndarray, " space"]) -> tuple[np.ndarray, float, float]:
        """The nearest visited position, its distance, and the distance up to which a target is reachable [m]."""
        squared = np.sum((self.seen - target) ** 2, axis=1)
        nearest = int(np.argmin(squared))
        return self.seen[nearest], float(np.sqrt(squared[nearest])), _GAP * _typical_gap(self.seen)


@eqx.filter_jit
def _predict(box: UnitBox, learner: Learner, state: object, targets: Array) -> Array:
    units = jax.lax.map(lambda x: learner.answer(state, x), box.x_to_unit(targets), batch_size=_BATCH)
    return box.q_from_unit(jnp.clip(units, 0.0, 1.0))


def _typical_gap(seen: Float[np.ndarray, "kept space"]) -> float:
    """How far apart visited positions lie: the 95th percentile of the distance to the nearest other one [m]."""
    some = seen[:: max(1, len(seen) // 256)]
    squared = np.sum((some[:, None] - seen[None]) ** 2, axis=2)
    squared[squared == 0] = np.inf
    nearest = np.sqrt(squared.min(axis=1))
    finite = nearest[np.isfinite(nearest)]
    return float(np.percentile(finite, 95)) if len(finite) else 0.0


def solve_inverse(
    skill: Skill,
    target: Sequence[float] | Float[np.ndarray, " space"],
    *,
    robot: Body | Plant | None = None,
    looks: int = 3,
    tolerance: float | None = None,
) -> Solution:
    """Joint values that bring the tip to a target; see `toddle.solve`.

    For a target out of reach it is the answer for the nearest position that was ever visited.
    """
    aim = _checked_target(skill, target)
    nearest, distance, reachable_within = skill.reach(aim)
    if distance > reachable_within:
        q = skill.predict(nearest[None])[0]
        where = " ".join(f"{value:.3f}" for value in nearest)
        reason = f"{1000 * distance:.0f} mm from anything it ever reached; the nearest such position is {where}"
        error = distance + skill.expected_error(nearest)
        return Solution(q, error, 0, Verdict.OUT_OF_REACH, reason, nearest=nearest)
    if robot is None:
        q = skill.predict(aim[None])[0]
        allowed = min(2 * float(skill.errors.mean()), _COARSE) if tolerance is None else tolerance
        return _judged(skill, q, skill.expected_error(aim), 0, allowed)
    q, errors = skill.reach_for(observer(robot), aim[None], looks)
    return _judged(skill, q[0], float(errors[-1, 0]), looks, 0.005 if tolerance is None else tolerance)


def _judged(skill: Skill, q: np.ndarray, error: float, steps: int, tolerance: float) -> Solution:
    """The answer with its verdict."""
    how = "seen" if steps else "to expect"
    said = f"error {how}: {1000 * error:.1f} mm, allowed: {1000 * tolerance:.1f} mm"
    if error <= tolerance:
        return Solution(q, error, steps, Verdict.REACHED, said)
    unit = np.asarray(skill.box.q_to_unit(jnp.asarray(q, jnp.float32)))
    held = [name for name, u in zip(skill.joints, unit, strict=True) if min(u, 1 - u) < _AT_LIMIT]
    if held:
        return Solution(q, error, steps, Verdict.AT_JOINT_LIMIT, f"{said}; at its limit: {', '.join(held)}")
    return Solution(q, error, steps, Verdict.NOT_CONVERGED, said)


def _checked_target(skill: Skill, target: Sequence[float] | np.ndarray) -> Float[np.ndarray, " space"]:
    try:
        aim = np.asarray(target, float)
    except (TypeError, ValueError):
        raise BadInput(f"{target!r} is not a position", where="target", remedy="give numbers [m]") from None
    space = skill.seen.shape[1]
    if aim.shape != (space,):
        got = "x".join(map(str, aim.shape)) or "one number"
        raise BadInput(f"it has {got}", where="target", remedy=f"give {space} coordinates [m]")
    if not np.all(np.abs(aim) < _FARTHEST):  # false for nan, too
        raise BadInput("a coordinate is no finite distance", where="target", remedy=f"give {space} numbers [m]")
    return aim
