"""Which movements to make next: those that leave the least doubt about where the tip is, over the whole workspace.

Greedy I-optimal design (Atkinson, Donev and Tobias 2007, Optimum Experimental Designs, section 10.6): of many postures
the one is taken whose sight shrinks the mean variance of the modelled tip most. With ``C`` the covariance of the arm's
numbers, ``J`` their slope at a posture and ``R`` the noise of looking, a look leaves ``C - C J' (J C J' + R)^-1 J C``.
Numbers are counted in a root of ``C``, so that the first ``C`` is one, and looks in units of their noise.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.reach.model.rigid import Rigid, number_slopes

_CANDIDATES, _PROBES = 1000, 300  # more of either changed nothing that could be measured

Looks = Float[np.ndarray, "looks rows numbers"]


def propose(
    model: Rigid,
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    count: int,
    *,
    sensor: float = 0.001,
    turn_sensor: float | None = None,
    done: Float[np.ndarray, "done joints"] | None = None,
    candidates: Float[np.ndarray, "candidates joints"] | None = None,
    seed: int = 0,
) -> Float[np.ndarray, "count joints"]:
    """The most informative movements, the most informative first.

    Args:
        model: the arm with its covariance: before any movement `toddle.reach.model.corrected.assumed`, else a fit.
        lower: lower limits [rad or m].
        upper: upper limits [rad or m].
        count: how many are wanted.
        sensor: noise of a seen position on each axis, standard deviation [m].
        turn_sensor: noise of a seen orientation [rad]; None: orientations aren't seen.
        done: movements made already that the covariance doesn't know of.
        candidates: postures to choose from, where not all are free of collisions with the marker in sight; None:
            random ones. One may be proposed several times.
        seed: draws the candidates, and the postures that stand for the workspace.

    Raises:
        BadInput: limits that are none, a count below 1, a noise that isn't positive, or postures of another robot.
    """
    _check(model, lower, upper, count, sensor, turn_sensor, done, candidates)
    rng = np.random.default_rng(seed)
    root = _root(model.covariance)
    probes = _looks(model, rng.uniform(lower, upper, (_PROBES, len(lower))), root, 1.0, None)
    wanted = np.einsum("lrn,lrm->nm", probes, probes)
    pool = rng.uniform(lower, upper, (_CANDIDATES, len(lower))) if candidates is None else candidates
    looks, doubt = _looks(model, pool, root, sensor, turn_sensor), np.eye(root.shape[1])
    for look in _looks(model, np.empty((0, len(lower))) if done is None else done, root, sensor, turn_sensor):
        doubt = _after(doubt, look)
    chosen = []
    for _ in range(count):
        chosen.append(_best(looks, doubt, wanted))
        doubt = _after(doubt, looks[chosen[-1]])
    return pool[chosen]


def _looks(
    model: Rigid,
    q: Float[np.ndarray, "looks joints"],
    root: Float[np.ndarray, "all numbers"],
    sensor: float,
    turn_sensor: float | None,
) -> Looks:
    """What is seen at each posture for a unit of each number, in units of the noise."""
    slope = number_slopes(model.linkage, q)[1]
    shift = slope[:, list(model.coordinates)] @ root / sensor
    return shift if turn_sensor is None else np.concatenate([shift, slope[:, 3:] @ root / turn_sensor], axis=1)


def _best(
    looks: Looks, doubt: Float[np.ndarray, "numbers numbers"], wanted: Float[np.ndarray, "numbers numbers"]
) -> int:
    """The look that shrinks ``tr(wanted doubt)`` most."""
    seen = looks @ doubt
    spread = seen @ looks.transpose(0, 2, 1) + np.eye(looks.shape[1])
    gain = np.linalg.solve(spread, seen @ wanted @ seen.transpose(0, 2, 1))
    return int(np.argmax(np.trace(gain, axis1=1, axis2=2)))


def _after(
    doubt: Float[np.ndarray, "numbers numbers"], look: Float[np.ndarray, "rows numbers"]
) -> Float[np.ndarray, "numbers numbers"]:
    """The covariance after a look."""
    seen = look @ doubt
    return doubt - seen.T @ np.linalg.solve(seen @ look.T + np.eye(len(look)), seen)


def _root(covariance: Float[np.ndarray, "all all"]) -> Float[np.ndarray, "all numbers"]:
    """A root of the covariance, without the numbers that are known."""
    values, vectors = np.linalg.eigh(covariance)
    known = values <= 1e-12 * values[-1]
    return vectors[:, ~known] * np.sqrt(values[~known])


def _check(
    model: Rigid,
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    count: int,
    sensor: float,
    turn_sensor: float | None,
    done: Float[np.ndarray, "done joints"] | None,
    candidates: Float[np.ndarray, "candidates joints"] | None,
) -> None:
    joints = model.linkage.gain.shape[1]
    if count < 1:
        raise BadInput(f"{count} movements can't be proposed", remedy="ask for 1 or more")
    if not sensor > 0 or not (turn_sensor is None or turn_sensor > 0):
        raise BadInput("the noise of looking is not positive", remedy="give it in m and rad, such as 0.001 and 0.005")
    limits = np.stack([lower, upper])
    if limits.shape[1] != joints or not np.isfinite(limits).all() or not (lower < upper).all():
        raise BadInput(
            f"the limits are not a range for each of {joints} joints", remedy="give each a lower and an upper"
        )
    for q, what in ((done, "movements made already"), (candidates, "candidates")):
        if q is not None and (q.shape[1] != joints or not np.isfinite(q).all()):
            raise BadInput(f"the {what} are not {joints} finite numbers each", remedy="give one column for each joint")
    if candidates is not None and not len(candidates):
        raise BadInput("there are no candidates", remedy="give at least one posture")
