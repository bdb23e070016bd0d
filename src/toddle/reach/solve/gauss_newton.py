"""Joint values for targets, on any learned model: damped Gauss-Newton for a batch of targets from many starts at once.

Each step solves  dq = J' (J J' + lambda I)^-1 e  (Levenberg 1944; for arms Wampler 1986), in joints scaled by their
range, with lambda = damping |e|^2, raised after steps that fail (Marquardt). Joints that stand at a limit and that the
step would push beyond it are left out of J (active set), so that the others make up for them. Of several solutions the
one is taken that is farthest from being stuck: smallest singular value of J times distance to the limits.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from toddle.failures import BadInput
from toddle.reach.model.model import Model, PoseModel
from toddle.reach.solve.answers import Answers

TOLERANCE = 1e-6  # [m]: what the model is solved to
SOLVED, TURN_SOLVED = 1e-4, 1e-3  # [m], [rad]: what counts as solved
LEVER = 0.3  # [m]: one radian of wrong orientation counts as this much of wrong position
_DAMPING, _STEP = 1e-3, 0.25  # lambda of |e|^2; the largest step, of a joint's range

Miss = Callable[
    [Int[np.ndarray, " rows"], Float[np.ndarray, "rows joints"]],
    tuple[Float[np.ndarray, "rows space"], Float[np.ndarray, "rows space joints"]],
]


class Descent(NamedTuple):
    """Where Gauss-Newton ended, row by row.

    Attributes:
        q: joint values within the limits [rad or m].
        miss: what is still missing at them [m].
        slope: how the modelled tip moves there [m/rad or m/m].
    """

    q: Float[np.ndarray, "rows joints"]
    miss: Float[np.ndarray, "rows space"]
    slope: Float[np.ndarray, "rows space joints"]


def descend(
    miss: Miss,
    q: Float[np.ndarray, "rows joints"],
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    *,
    iterations: int = 30,
    tolerance: float = TOLERANCE,
) -> Descent:
    """Bring a batch of postures to where nothing is missing, within the limits.

    Args:
        miss: for the numbers of some rows and joint values for them: what is missing there [m], and how the tip moves.
        q: where to start from [rad or m].
        lower, upper: the joints' limits [rad or m].
        iterations: steps at most.
        tolerance: length of what is missing at which a row is done [m].
    """
    span = np.where(upper > lower, upper - lower, 1.0)
    q = np.clip(q, lower, upper)
    error, slope = miss(np.arange(len(q)), q)
    best, damping, lost = Descent(q, error, slope), np.full(len(q), _DAMPING), np.zeros(len(q), int)
    for _ in range(iterations):
        rows = np.flatnonzero((_length(best.miss) > tolerance) & (lost < 6))
        if not len(rows):
            break
        step = _step(best, rows, damping[rows], lower, upper, span)
        tried = np.clip(best.q[rows] + step, lower, upper)
        error, slope = miss(rows, tried)
        better = _length(error) < _length(best.miss[rows])
        damping[rows] = np.where(better, np.maximum(damping[rows] * 0.3, 1e-6), damping[rows] * 8)
        lost[rows] = np.where(better, 0, lost[rows] + 1)
        won = rows[better]
        best.q[won], best.miss[won], best.slope[won] = tried[better], error[better], slope[better]
    return best


def solve_model(
    model: Model,
    targets: Float[np.ndarray, "batch space"],
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    *,
    memory: tuple[Float[np.ndarray, "movements joints"], Float[np.ndarray, "movements space"]],
    turns: Float[np.ndarray, "batch 3 3"] | None = None,
    near: Float[np.ndarray, "*batch joints"] | None = None,
    central: bool = False,
    starts: int = 5,
    iterations: int = 30,
) -> Answers:
    """Joint values that bring a model's tip to targets.

    Args:
        model: the learned body.
        targets: where the tip should be [m].
        lower, upper: the joints' limits [rad or m].
        memory: joint values and tips of movements to start from: for each target those that came nearest.
        turns: orientations asked for; the model is to be a `PoseModel` then.
        near: a posture to stay near to [rad or m], one for all or one each: the nearest solution is taken.
        central: the solution nearest to the middle of the ranges is taken. Without either it is the freest one.
        starts: movements tried for each target.
        iterations: steps at most, for each start.

    Raises:
        BadInput: an orientation is asked of a model that knows none.
    """
    if turns is not None and not isinstance(model, PoseModel):
        raise BadInput("an orientation is asked for", remedy="learn the body as screws, or leave the orientation out")
    near = None if near is None else np.broadcast_to(near, (len(targets), len(lower)))
    begin = _starts(memory, targets, near, starts)
    batch, tries, joints = begin.shape
    owner = np.repeat(np.arange(batch), tries)

    def miss(rows: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if turns is None or not isinstance(model, PoseModel):
            x, slope = model.slope(q)
            return targets[owner[rows]] - x, slope
        return _pose_miss(model, targets[owner[rows]], turns[owner[rows]], q)

    found = descend(miss, begin.reshape(-1, joints), lower, upper, iterations=iterations)
    aim = np.broadcast_to((lower + upper) / 2, (batch, joints)) if central and near is None else near
    merit = (
        _freest(found, model, lower, upper) if aim is None else _nearest(found, np.repeat(aim, tries, 0), lower, upper)
    )
    chosen = np.arange(batch) * tries + _choice(found, merit, tries)
    return _answers(Descent(*(values[chosen] for values in found)), lower, upper, targets.shape[1])


def freedom(
    slope: Float[np.ndarray, "rows space joints"],
    q: Float[np.ndarray, "rows joints"],
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
) -> Float[np.ndarray, " rows"]:
    """How far postures are from being stuck: smallest singular value (joints scaled by range) x distance to limits.

    The distance counts 1 from a tenth of a joint's range inwards.
    """
    span = np.where(upper > lower, upper - lower, 1.0)
    scaled = slope * span
    smallest = np.sqrt(np.maximum(np.linalg.eigvalsh(scaled @ scaled.transpose(0, 2, 1))[:, 0], 0.0))
    margin = np.min(np.minimum(q - lower, upper - q) / span, axis=1)
    return smallest * np.clip(margin / 0.1, 0.02, 1.0)


def _step(
    best: Descent,
    rows: Int[np.ndarray, " rows"],
    damping: Float[np.ndarray, " rows"],
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    span: Float[np.ndarray, " joints"],
) -> Float[np.ndarray, "rows joints"]:
    """The damped step, without the joints that it would push beyond their limits."""
    q, error = best.q[rows], best.miss[rows]
    scaled = best.slope[rows] * span
    ridge = (damping * np.sum(error**2, axis=1) + 1e-12)[:, None, None] * np.eye(error.shape[1])
    out, step = np.zeros(q.shape, bool), np.zeros(q.shape)
    for _ in range(3):  # leaving out a joint may turn the step of another one against its limit
        free = np.where(out[:, None, :], 0.0, scaled)
        pull = np.linalg.solve(free @ free.transpose(0, 2, 1) + ridge, error[:, :, None])
        step = (free.transpose(0, 2, 1) @ pull)[:, :, 0]
        out |= ((q <= lower) & (step < 0)) | ((q >= upper) & (step > 0))
    step = np.where(out, 0.0, step)
    longest = np.max(np.abs(step), axis=1, keepdims=True)
    return span * step * np.minimum(1.0, _STEP / np.maximum(longest, 1e-300))


def _starts(
    memory: tuple[Float[np.ndarray, "movements joints"], Float[np.ndarray, "movements space"]],
    targets: Float[np.ndarray, "batch space"],
    near: Float[np.ndarray, "batch joints"] | None,
    starts: int,
) -> Float[np.ndarray, "batch starts joints"]:
    """For each target the postures whose tips were nearest, and the one to stay near to."""
    count = min(starts, len(memory[0]))
    chosen = KDTree(memory[1]).query(targets, count)[1].reshape(len(targets), count)
    begin = memory[0][chosen]
    return begin if near is None else np.concatenate([near[:, None], begin], axis=1)


def _freest(
    found: Descent, model: Model, lower: Float[np.ndarray, " joints"], upper: Float[np.ndarray, " joints"]
) -> Float[np.ndarray, " rows"]:
    """How well postures can be trusted: their freedom, the more the surer the model is of them."""
    doubt = np.sqrt(np.trace(model.spread(found.q), axis1=1, axis2=2)) + 1e-6
    return freedom(found.slope, found.q, lower, upper) / doubt


def _nearest(
    found: Descent,
    aim: Float[np.ndarray, "rows joints"],
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
) -> Float[np.ndarray, " rows"]:
    return -np.sum(((found.q - aim) / np.maximum(upper - lower, 1e-12)) ** 2, axis=1)


def _choice(found: Descent, merit: Float[np.ndarray, " rows"], tries: int) -> Int[np.ndarray, " batch"]:
    """Which try to take for each target: among those that arrived the one of most merit, else the closest."""
    distance = _length(found.miss).reshape(-1, tries)
    arrived = distance <= np.maximum(SOLVED, 1.001 * distance.min(axis=1, keepdims=True))
    return np.argmax(np.where(arrived, merit.reshape(-1, tries), -np.inf), axis=1)


def _answers(
    found: Descent, lower: Float[np.ndarray, " joints"], upper: Float[np.ndarray, " joints"], space: int
) -> Answers:
    distance = _length(found.miss[:, :space])
    angle = _length(found.miss[:, space:]) / LEVER
    solved = (distance <= SOLVED) & (angle <= TURN_SOLVED)
    return Answers(found.q, distance, angle, solved, (found.q <= lower) | (found.q >= upper))


def _pose_miss(
    model: PoseModel,
    targets: Float[np.ndarray, "rows 3"],
    turns: Float[np.ndarray, "rows 3 3"],
    q: Float[np.ndarray, "rows joints"],
) -> tuple[Float[np.ndarray, "rows 6"], Float[np.ndarray, "rows 6 joints"]]:
    pose, slope = model.pose_slope(q)
    turn = Rotation.from_matrix(turns @ pose[:, :3, :3].transpose(0, 2, 1)).as_rotvec()
    error = np.concatenate([targets - pose[:, :3, 3], LEVER * turn], axis=1)
    return error, slope * np.array([1, 1, 1, LEVER, LEVER, LEVER])[:, None]


def _length(vectors: Float[np.ndarray, "rows _"]) -> Float[np.ndarray, " rows"]:
    return np.sqrt(np.sum(vectors**2, axis=1))
