"""The most probable small changes of a known linkage, given movements: maximum a posteriori, with its own noise levels.

Minimises ``sum |r|^2 / sigma^2 + sum (number / sd)^2`` over the numbers of `toddle.reach.model.rigid` by
Levenberg-Marquardt, ``r`` the seen pose less the changed linkage's. Wild movements lose their weight by annealed
Geman-McClure and are then cut. The noise ``sigma``, and how large the changes of each kind are (``sd``), maximise the
evidence by MacKay's fixed point: ``sd^2 = sum number^2 / gamma`` with ``gamma`` the numbers that the data determine,
``sigma^2 = sum |r|^2 / (rows - gamma)`` (MacKay 1992, Bayesian Interpolation, section 4).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial.transform import Rotation
from scipy.special import chdtri

from toddle.reach.model.rigid import PER_AXIS, changed, number_slopes, twist_motion
from toddle.robots.linkage import Linkage

SENSOR = (0.001, 0.005)  # first guess of the noise of position [m] and orientation [rad]
WILD = 1e-5  # a movement is cut when chance would put it so far off only this often
_GUESSES = 4.0  # movements that the first guess of a kind of change is worth
_TUKEY = 4.0  # where Geman-McClure begins to bite, in standard deviations

Numbers = Float[np.ndarray, " numbers"]


class Seen(NamedTuple):
    """A known linkage and what was seen of it.

    Attributes:
        nominal: as it was described.
        q: joint values [rad or m].
        x: tip positions [m].
        turn: tip orientations; None: not seen.
        coordinates: which of x, y, z a position has.
    """

    nominal: Linkage
    q: Float[np.ndarray, "movements joints"]
    x: Float[np.ndarray, "movements space"]
    turn: Float[np.ndarray, "movements 3 3"] | None
    coordinates: tuple[int, ...]


class Belief(NamedTuple):
    """What is held of the changes before movements are seen, and which of these widths the movements may revise.

    Attributes:
        sd: standard deviation of each number [m, rad or 1].
        kind: which numbers share a width; negative: that width is not revised.
    """

    sd: Numbers
    kind: Int[np.ndarray, " numbers"]


class Changes(NamedTuple):
    """The most probable numbers.

    Attributes:
        numbers: with respect to the nominal linkage.
        covariance: of the numbers.
        sensor: noise of position [m] and orientation [rad], per axis.
        keep: movements that were used.
        miss: distance between the seen and the modelled position [m].
        belief: with the widths that the movements suggest.
        evidence: logarithm of how probable the movements are under that belief, to within a constant.
    """

    numbers: Numbers
    covariance: Float[np.ndarray, "numbers numbers"]
    sensor: tuple[float, float]
    keep: Bool[np.ndarray, " movements"]
    miss: Float[np.ndarray, " movements"]
    belief: Belief
    evidence: float


def most_probable(seen: Seen, belief: Belief, *, start: Numbers | None = None, rounds: int = 10) -> Changes:
    """The most probable numbers, and the noise levels and widths with them.

    Args:
        seen: the description and the movements.
        belief: how wrong the description may be.
        start: numbers that are near already; None: come near from the description.
        rounds: how often widths and levels are revised at most; they are settled when they change by less than 1 %.
    """
    numbers = _annealed(seen, belief) if start is None else start
    residual, slope = residuals(seen, numbers)
    level = _robust_level(seen, residual)
    keep = np.ones(len(seen.q), bool)
    first = belief
    for _ in range(rounds):
        keep = _kept(residual / level, keep, slope / level[:, None], belief.sd)
        numbers = _descend(seen, numbers, level, keep.astype(float), belief.sd)
        residual, slope = residuals(seen, numbers)
        was = level
        unsure, level = _levels(seen, residual[keep], slope[keep], level, belief.sd)
        before, belief = belief, _widths(belief, first, numbers, unsure)
        if np.allclose(belief.sd, before.sd, rtol=0.01) and np.allclose(level, was, rtol=0.01):
            break
    unsure = _unsure((slope / level[:, None])[keep], belief.sd)
    covariance = belief.sd[:, None] * unsure * belief.sd
    evidence = _evidence(residual / level, numbers, unsure, level, belief.sd)
    space = len(seen.coordinates)
    miss = np.linalg.norm(residual[:, :space], axis=1)
    sensor = (float(level[0]), float(level[-1]) if seen.turn is not None else float("nan"))
    return Changes(numbers, covariance, sensor, keep, miss, belief, evidence)


def residuals(
    seen: Seen, numbers: Numbers
) -> tuple[Float[np.ndarray, "movements rows"], Float[np.ndarray, "movements rows numbers"]]:
    """Seen less modelled pose (position [m], then turn [rad] in the base frame), and the model's slope."""
    pose, slope = number_slopes(changed(seen.nominal, numbers), seen.q)
    slope = blockwise(slope, numbers)
    rows = list(seen.coordinates)
    off = seen.x - pose[:, rows, 3]
    if seen.turn is None:
        return off, slope[:, rows]
    turned = Rotation.from_matrix(seen.turn @ pose[:, :3, :3].transpose(0, 2, 1)).as_rotvec()
    return np.concatenate([off, turned], axis=1), slope[:, [*rows, 3, 4, 5]]


def blockwise(slope: Float[np.ndarray, "*batch numbers"], numbers: Numbers) -> Float[np.ndarray, "*batch numbers"]:
    """Slopes with respect to the numbers, from slopes with respect to further small steps after them."""
    ends = range(0, len(numbers), PER_AXIS)
    out = np.empty_like(slope)
    for end in ends:
        shift, turn = slice(end, end + 3), slice(end + 3, end + 6)
        frame = twist_motion(numbers[None, end : end + 6])[0, :3, :3]
        out[..., shift] = slope[..., shift] @ frame.T
        out[..., turn] = slope[..., turn] @ _turn_rate(numbers[turn])
        if end + 6 < len(numbers):
            out[..., end + 6] = slope[..., end + 6] / (1 + numbers[end + 6])
    return out


def _turn_rate(turn: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """The right Jacobian of the rotation group: exp(turn + d) = exp(turn) exp(J d)."""
    angle = float(np.linalg.norm(turn))
    cross = np.cross(turn, np.eye(3)).T
    if angle < 1e-6:
        return np.eye(3) - cross / 2
    return np.eye(3) - (1 - np.cos(angle)) / angle**2 * cross + (angle - np.sin(angle)) / angle**3 * (cross @ cross)


def _noise(seen: Seen, position: float, orientation: float) -> Float[np.ndarray, " rows"]:
    turns = 0 if seen.turn is None else 3
    return np.array([position] * len(seen.coordinates) + [orientation] * turns)


def _annealed(seen: Seen, belief: Belief) -> Numbers:
    """Come near, from far away, with a noise level that falls from the first misses to the last."""
    numbers = np.zeros(len(belief.sd))
    guess = _noise(seen, *SENSOR)
    scale = np.inf
    for _ in range(16):
        distance = np.linalg.norm(residuals(seen, numbers)[0] / guess, axis=1)
        now = max(1.0, float(np.median(distance)) / np.sqrt(len(guess)))
        if now > 0.9 * scale:
            break
        scale = now
        weight = 1 / (1 + (distance / (_TUKEY * scale)) ** 2) ** 2
        numbers = _descend(seen, numbers, guess * scale, weight, belief.sd)
    return numbers


def _descend(
    seen: Seen,
    numbers: Numbers,
    level: Float[np.ndarray, " rows"],
    weight: Float[np.ndarray, " movements"],
    sd: Numbers,
) -> Numbers:
    """A few steps of Levenberg-Marquardt, in numbers counted in their prior standard deviations."""
    root = np.sqrt(weight)[:, None] / level

    def cost_at(at: Numbers) -> tuple[float, np.ndarray, np.ndarray]:
        residual, slope = residuals(seen, at)
        scaled = np.divide(at, sd, out=np.zeros_like(at), where=sd > 0)
        return float(((root * residual) ** 2).sum() + scaled @ scaled), residual * root, slope * root[..., None] * sd

    cost, residual, slope = cost_at(numbers)
    damping = 1e-3
    for _ in range(6):
        flat = slope.reshape(-1, len(sd))
        now = np.divide(numbers, sd, out=np.zeros_like(numbers), where=sd > 0)
        normal = flat.T @ flat + np.eye(len(sd))
        pull = flat.T @ residual.ravel() - now
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), pull)
        trial = numbers + sd * step
        after, trial_residual, trial_slope = cost_at(trial)
        if after < cost:
            done = cost - after < 1e-4 * cost
            numbers, cost, residual, slope, damping = trial, after, trial_residual, trial_slope, damping / 10
            if done:
                break
        else:
            damping *= 10
    return numbers


def _robust_level(seen: Seen, residual: Float[np.ndarray, "movements rows"]) -> Float[np.ndarray, " rows"]:
    """Noise levels from medians, which wild movements do not move."""
    space = len(seen.coordinates)
    position = np.median(np.abs(residual[:, :space])) / 0.6745
    orientation = np.median(np.abs(residual[:, space:])) / 0.6745 if seen.turn is not None else SENSOR[1]
    return _noise(seen, max(float(position), 1e-5), max(float(orientation), 1e-5))


def _unsure(slope: Float[np.ndarray, "movements rows numbers"], sd: Numbers) -> Float[np.ndarray, "numbers numbers"]:
    """Posterior covariance of the numbers, counted in their prior standard deviations."""
    flat = slope.reshape(-1, len(sd)) * sd
    return np.linalg.inv(flat.T @ flat + np.eye(len(sd)))


def _kept(
    scaled: Float[np.ndarray, "movements rows"],
    keep: Bool[np.ndarray, " movements"],
    slope: Float[np.ndarray, "movements rows numbers"],
    sd: Numbers,
) -> Bool[np.ndarray, " movements"]:
    """The movements that chance explains; one that was left out is asked with the model's own doubt beside it."""
    square = (scaled**2).sum(axis=1)
    if not keep.all():
        out = slope[~keep] * sd
        doubt = np.eye(scaled.shape[1]) + out @ _unsure(slope[keep], sd) @ out.transpose(0, 2, 1)
        square[~keep] = np.einsum("mr,mr->m", scaled[~keep], np.linalg.solve(doubt, scaled[~keep][..., None])[..., 0])
    kept = square < chdtri(scaled.shape[1], WILD)
    return kept if 2 * kept.sum() > len(kept) else square <= np.median(square)


def _evidence(
    scaled: Float[np.ndarray, "movements rows"],
    numbers: Numbers,
    unsure: Float[np.ndarray, "numbers numbers"],
    level: Float[np.ndarray, " rows"],
    sd: Numbers,
) -> float:
    """Laplace's approximation of the log evidence; a wild movement costs what the last one that is kept would."""
    rows = scaled.shape[1]
    misfit = np.minimum((scaled**2).sum(axis=1), chdtri(rows, WILD)).sum() + 2 * len(scaled) * np.log(level).sum()
    size = np.sum((numbers[sd > 0] / sd[sd > 0]) ** 2)
    return float(np.linalg.slogdet(unsure)[1] - misfit - size) / 2


def _levels(
    seen: Seen,
    residual: Float[np.ndarray, "kept rows"],
    slope: Float[np.ndarray, "kept rows numbers"],
    level: Float[np.ndarray, " rows"],
    sd: Numbers,
) -> tuple[Float[np.ndarray, "numbers numbers"], Float[np.ndarray, " rows"]]:
    """Posterior covariance, and the noise levels that the evidence asks for: of positions, of orientations."""
    slope = slope / level[:, None]
    unsure = _unsure(slope, sd)
    found, space = [], len(seen.coordinates)
    for part, guess in ((slice(0, space), SENSOR[0]), (slice(space, None), SENSOR[1])):
        flat = slope[:, part].reshape(-1, len(sd)) * sd
        taken = float(np.sum((flat @ unsure) * flat))
        square = float(np.sum(residual[:, part] ** 2))
        found.append(np.sqrt((square + guess**2) / (max(len(flat) - taken, 0.0) + 1)))
    return unsure, _noise(seen, *found)


def _widths(belief: Belief, first: Belief, numbers: Numbers, unsure: Float[np.ndarray, "numbers numbers"]) -> Belief:
    """The widths that the evidence asks for, each kind of change for itself; the first guess has a small say."""
    determined = 1 - np.diag(unsure)
    sd = belief.sd.copy()
    for kind in set(belief.kind[belief.kind >= 0]):
        those = belief.kind == kind
        guess = _GUESSES * first.sd[those].mean() ** 2
        sd[those] = np.sqrt((np.sum(numbers[those] ** 2) + guess) / (determined[those].sum() + _GUESSES))
    return belief._replace(sd=sd)
