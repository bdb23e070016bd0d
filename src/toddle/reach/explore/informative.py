"""Which movements to make next: those that leave the least doubt about where the tip is, over the whole workspace.

Greedy I-optimal design (Atkinson, Donev and Tobias 2007, Optimum Experimental Designs, section 10.6): of many postures
the one is taken whose sight shrinks the mean variance of the modelled tip most. With ``C`` the covariance of the arm's
numbers, ``J`` their slope at a posture and ``R`` the noise of looking, a look leaves ``C - C J'(J C J' + R)^-1 J C``.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from toddle.failures import BadInput
from toddle.reach.model.rigid import Rigid, number_slopes

_CANDIDATES, _PROBES = 1000, 300


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
        sensor: noise of an observed position on each axis, standard deviation [m].
        turn_sensor: noise of an observed orientation [rad]; None: orientations aren't seen.
        done: movements made already that the covariance does not know of.
        candidates: postures to choose from (free of collisions, the marker in sight); None: random ones.
        seed: draws the candidates and the postures that stand for the workspace.

    Raises:
        BadInput: a limit, a count or a posture that can't be used.
    """
    _check(model, lower, upper, count, candidates)
    rng = np.random.default_rng(seed)
    probes = rng.uniform(lower, upper, (_PROBES, len(lower)))
    pool = rng.uniform(lower, upper, (max(_CANDIDATES, count), len(lower))) if candidates is None else candidates
    root = _root(model.covariance)
    rows = _looks(model, sensor, turn_sensor)
    aim = number_slopes(model.linkage, probes)[1][:, model.coordinates].reshape(-1, len(root)) @ root
    wanted = aim.T @ aim / len(probes)
    looks = rows(pool) @ root
    doubt = np.eye(root.shape[1])
    for look in [] if done is None else rows(done) @ root:
        doubt = _after(doubt, look)
    chosen: list[int] = []
    while len(chosen) < count:
        seen = looks @ doubt
        gain = np.linalg.solve(
            seen @ looks.transpose(0, 2, 1) + np.eye(looks.shape[1]), seen @ wanted @ seen.transpose(0, 2, 1)
        )
        worth = np.trace(gain, axis1=1, axis2=2)
        if len(pool) >= count:
            worth[chosen] = -np.inf
        chosen.append(int(np.argmax(worth)))
        doubt = _after(doubt, looks[chosen[-1]])
    return pool[chosen]


def _root(covariance):
    values, vectors = np.linalg.eigh(covariance)
    keep = values > 1e-12 * values[-1]
    return vectors[:, keep] * np.sqrt(values[keep])


def _looks(model, sensor, turn_sensor):
    def rows(q):
        slope = number_slopes(model.linkage, q)[1]
        shift = slope[:, model.coordinates] / sensor
        return shift if turn_sensor is None else np.concatenate([shift, slope[:, 3:] / turn_sensor], axis=1)

    return rows


def _after(doubt, look):
    seen = look @ doubt
    return doubt - seen.T @ np.linalg.solve(seen @ look.T + np.eye(len(look)), seen)


def _check(model, lower, upper, count, candidates):
    pass
