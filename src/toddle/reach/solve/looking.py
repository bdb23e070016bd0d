"""Observed correction for any model: look where the tip went, learn by what the model missed there, aim again.

What the model misses is itself a smooth function of the joints, unknown: a Gaussian process with the model's own spread
as its variance (Rasmussen and Williams 2006, equations 2.25 and 2.26), conditioned on the few looks of one target. It
does at once what a filtered bias, its drift while the arm moves, and secant updates of the Jacobian (Broyden) do one
by one: the mean is the filtered bias, its slope mends the model's slope along the ways that were gone, and its variance
says how sure the answer is. A look in noise counts as much as it tells and no more. The variance is scaled by what the
looks show, so that a model which is surer of itself than it should be (a body that was damaged) is still mended.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Int
from scipy.special import gammaincinv, gammaln

from toddle.failures import BadInput
from toddle.reach.model.model import Model
from toddle.reach.observe import Observe
from toddle.reach.solve.answers import Answers
from toddle.reach.solve.gauss_newton import SOLVED, Descent, descend

REACH = 0.25  # correlation length of what a model misses, of a joint's range
_BELIEF = 3.0  # looks' worth of coordinates that the model's spread counts as much as what is seen
_LEAST = 1e-18  # [m^2] variance of looks without noise, so that looks at one place agree


@runtime_checkable
class Solves(Protocol):
    """Whoever knows postures for targets."""

    def solve(self, targets: Float[np.ndarray, "batch space"]) -> Answers:
        """Answers for targets [m]."""
        ...


class Looks(NamedTuple):
    """What was seen while reaching for a batch of targets.

    Attributes:
        q: joint values that were looked at [rad or m].
        missed: where the tip was seen, from where the model puts it [m].
        variance: of what the model misses, before any look [m^2].
        noise: of a look, on each axis [m^2].
        reach: distance of joint values over which what is missed changes [rad or m].
    """

    q: Float[np.ndarray, "batch looks joints"]
    missed: Float[np.ndarray, "batch looks space"]
    variance: Float[np.ndarray, " batch"]
    noise: float
    reach: Float[np.ndarray, " joints"]


class Course(NamedTuple):
    """Answers after 0 (open loop), 1, ... looks.

    Attributes:
        q: the joint values that are best by what is known then [rad or m].
        expected: distance to expect between tip and target there [m].
        expected_90: distance that nine of ten stay within [m].
        looks: what was seen, to go on from.
    """

    q: Float[np.ndarray, "answers batch joints"]
    expected: Float[np.ndarray, "answers batch"]
    expected_90: Float[np.ndarray, "answers batch"]
    looks: Looks


def begun(
    model: Model,
    q: Float[np.ndarray, "batch joints"],
    sensor: float,
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
) -> Looks:
    """Nothing seen yet, at the postures where reaching begins."""
    variance = np.trace(model.spread(q), axis1=1, axis2=2) / model.space
    nothing = np.zeros((len(q), 0, q.shape[1])), np.zeros((len(q), 0, model.space))
    return Looks(*nothing, np.maximum(variance, _LEAST), sensor**2 + _LEAST, REACH * np.maximum(upper - lower, 1e-9))


def seen(
    looks: Looks, model: Model, q: Float[np.ndarray, "batch joints"], x: Float[np.ndarray, "batch space"]
) -> Looks:
    """One more look at every target's tip: at joint values q it was seen at x [m]."""
    missed = x - model.forward(q)
    return looks._replace(
        q=np.concatenate([looks.q, q[:, None]], axis=1), missed=np.concatenate([looks.missed, missed[:, None]], axis=1)
    )


class _Missed(NamedTuple):
    """What the model misses, conditioned on the looks."""

    looks: Looks
    weights: Float[np.ndarray, "batch looks space"]
    precision: Float[np.ndarray, "batch looks looks"]
    scale: Float[np.ndarray, " batch"]

    def at(
        self, rows: Int[np.ndarray, " rows"], q: Float[np.ndarray, "rows joints"]
    ) -> tuple[Float[np.ndarray, "rows space"], Float[np.ndarray, "rows space joints"], Float[np.ndarray, " rows"]]:
        """Its mean [m], the mean's slope and its variance [m^2] at postures of some of the targets."""
        away = (self.looks.q[rows] - q[:, None]) / self.looks.reach
        kernel = np.exp(-0.5 * np.sum(away**2, axis=2))
        weighted = kernel[:, :, None] * self.weights[rows]
        slope = np.einsum("rks,rkj->rsj", weighted, away) / self.looks.reach
        known = np.einsum("rk,rkl,rl->r", kernel, self.precision[rows], kernel)
        return weighted.sum(1), slope, self.scale[rows] * np.maximum(1 - known, 0.0)


def _missed(looks: Looks) -> _Missed:
    """Condition on the looks, and scale the variance by them."""
    away = (looks.q[:, :, None] - looks.q[:, None]) / looks.reach
    kernel = np.exp(-0.5 * np.sum(away**2, axis=3))
    count, space = looks.missed.shape[1:]
    scale, precision = looks.variance, np.zeros_like(kernel)
    for _ in range(4 if count else 0):
        share = np.maximum(looks.noise / scale, 1e-9)
        precision = np.linalg.inv(kernel + share[:, None, None] * np.eye(count))
        # expectation and maximisation: squares of what is missed as the looks show it, and as they leave it open
        pulled = precision @ looks.missed
        shown = np.einsum("bks,bkl,bls->b", pulled, kernel, pulled)
        left = scale * space * (count - np.einsum("bkl,blk->b", precision, kernel))
        scale = (_BELIEF * looks.variance + shown + left) / (_BELIEF + count * space)
    return _Missed(looks, precision @ looks.missed, precision, scale)


def aimed(
    looks: Looks,
    model: Model,
    targets: Float[np.ndarray, "batch space"],
    q: Float[np.ndarray, "batch joints"],
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
) -> Float[np.ndarray, "batch joints"]:
    """From the postures q, where the model and the looks together put the tip at the targets [rad or m]."""
    return _descended(_missed(looks), model, targets, np.arange(len(q)), q, lower, upper).q


def correct(
    model: Model,
    solver: Solves | None,
    observe: Observe,
    targets: Float[np.ndarray, "batch space"],
    q: Float[np.ndarray, "batch joints"],
    looks: int,
    *,
    sensor: float,
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
) -> Course:
    """Reach for targets, looking where the tip went.

    Args:
        model: the learned body.
        solver: asked for another posture where the present one can't be mended; None: there is none.
        observe: moves to joint values [rad or m], a row for each target, and tells where the tip came to be [m].
        targets: where it should be [m].
        q: the solver's answers on the model [rad or m]: where the arm goes first.
        looks: how often the tip is looked at.
        sensor: standard deviation of a look on each axis [m]; 0: looks are exact.
        lower, upper: the joints' limits [rad or m].

    Raises:
        BadInput: looks is negative.
    """
    if looks < 0:
        raise BadInput(f"{looks} looks", remedy="give 0 (open loop) or more")
    known, there = begun(model, q, sensor, lower, upper), q
    answers = [_judged(_missed(known), model, targets, q[:, None])]
    for _ in range(looks):
        known = seen(known, model, there, observe(there))
        missed = _missed(known)
        there = _mended(missed, model, solver, targets, answers[-1].q, lower, upper)
        answers.append(_judged(missed, model, targets, np.concatenate([known.q, there[:, None]], axis=1)))
    q_all, expected, ninety = (np.stack(values) for values in zip(*answers, strict=True))
    return Course(q_all, expected, ninety, known)


class _Answer(NamedTuple):
    q: np.ndarray
    expected: np.ndarray
    expected_90: np.ndarray


def _judged(
    missed: _Missed,
    model: Model,
    targets: Float[np.ndarray, "batch space"],
    tries: Float[np.ndarray, "batch tries joints"],
) -> _Answer:
    """Of some postures for each target the one whose true distance is expected to be the least."""
    batch, count, joints = tries.shape
    rows, q = np.repeat(np.arange(batch), count), tries.reshape(-1, joints)
    bias, _, variance = missed.at(rows, q)
    off = np.sum((targets[rows] - model.forward(q) - bias) ** 2, axis=1)
    best = np.arange(batch) * count + np.argmin((off + model.space * variance).reshape(batch, count), axis=1)
    return _Answer(q[best], *_distances(off[best], np.maximum(variance[best], _LEAST), model.space))


def _distances(
    off: Float[np.ndarray, " batch"], variance: Float[np.ndarray, " batch"], space: int
) -> tuple[Float[np.ndarray, " batch"], Float[np.ndarray, " batch"]]:
    """Mean and 90 % quantile of a distance whose square is taken as gamma distributed, by its moments [m]."""
    mean, spread = off + space * variance, 2 * space * variance**2 + 4 * variance * off
    shape, size = mean**2 / spread, spread / mean
    # for large shapes gammainc has its limit, a point: the distance is known
    narrow = shape > 1e4
    kept = np.where(narrow, 1.0, shape)
    expected = np.exp(gammaln(kept + 0.5) - gammaln(kept)) * np.sqrt(size)
    ninety = np.sqrt(size * gammaincinv(kept, 0.9))
    return np.where(narrow, np.sqrt(mean), expected), np.where(narrow, np.sqrt(mean), ninety)


def _mended(
    missed: _Missed,
    model: Model,
    solver: Solves | None,
    targets: Float[np.ndarray, "batch space"],
    q: Float[np.ndarray, "batch joints"],
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
) -> Float[np.ndarray, "batch joints"]:
    """Where to go next: the nearest posture that seems right; where there is none nearby, another one."""
    found = _descended(missed, model, targets, np.arange(len(q)), q, lower, upper)
    short = np.linalg.norm(found.miss, axis=1)
    stuck = np.flatnonzero(short > SOLVED)
    if solver is None or not len(stuck):
        return found.q
    bias = missed.at(stuck, found.q[stuck])[0]
    other = solver.solve(targets[stuck] - bias).q
    again = _descended(missed, model, targets, stuck, other, lower, upper)
    better = np.linalg.norm(again.miss, axis=1) < 0.5 * short[stuck]
    found.q[stuck[better]] = again.q[better]
    return found.q


def _descended(
    missed: _Missed,
    model: Model,
    targets: Float[np.ndarray, "batch space"],
    some: Int[np.ndarray, " some"],
    q: Float[np.ndarray, "some joints"],
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
) -> Descent:
    """For some of the targets, from postures q, where model and looks together put the tip at them."""

    def miss(rows: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x, slope = model.slope(q)
        bias, tilt, _ = missed.at(some[rows], q)
        return targets[some[rows]] - x - bias, slope + tilt

    return descend(miss, q, lower, upper)
