"""Where the axes lie, from movements in which one joint moved and the others stayed.

Each such joint alone is an arm of one axis, and its fit is easy: a circle, with known angles, or almost a line, with a
gain that is then small. What misses by much more than the other joints' has a wild movement in it, or more axes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from toddle.reach.model.screw_arms import Arms, from_lines, lines_of, recentred
from toddle.reach.model.screw_start import random_arms
from toddle.reach.model.screw_steps import Seen, descend
from toddle.reach.model.screw_types import free_numbers, held_numbers, sliding, suspects

_STARTS = 6
_UNUSUAL = 6.0  # times as large as usual: not one axis, or a wild movement
_CLEAR = 50.0  # times the usual miss: what the tip has to go for its axis to be clear
_LARGEST_GAIN = 4.0
_EXACT = 1e-9  # [m]
_FEWEST = 2  # movements of a joint, besides where all stay


class Isolated(NamedTuple):
    """Axes as they lie where the joints stay.

    Attributes:
        along: their directions.
        through: a point on each [m].
        slides: 1.0 where an axis slides.
        gain: motion of each axis for a unit of its joint.
        miss: root mean square of each coordinate's miss, joint by joint, for the numbers that were spent [m].
        travel: how far the tip went from home at most, joint by joint [m].
        tip: where the tip is [m].
        posture: where the joints stay, less the centre [rad or m].
    """

    along: Float[np.ndarray, "joints 3"]
    through: Float[np.ndarray, "joints 3"]
    slides: Float[np.ndarray, " joints"]
    gain: Float[np.ndarray, " joints"]
    miss: Float[np.ndarray, " joints"]
    travel: Float[np.ndarray, " joints"]
    tip: Float[np.ndarray, "3"]
    posture: Float[np.ndarray, " joints"]


def alone(q: Float[np.ndarray, "movements joints"]) -> tuple[int, Int[np.ndarray, " movements"]] | None:
    """A movement from which others differ by one joint at most, and which joint: -1 none, -2 several.

    Returns:
        None where some joint has not moved alone at least twice.
    """
    span = np.ptp(q, axis=0)
    best: tuple[int, Int[np.ndarray, " movements"]] | None = None
    for row in range(min(len(q), 400)):
        moved = np.abs(q - q[row]) > 2e-3 * span
        count = moved.sum(axis=1)
        if best is None or (count <= 1).sum() > (best[1] > -2).sum():
            best = row, np.where(count == 1, moved.argmax(axis=1), np.where(count == 0, -1, -2))
    if best is None or min(np.count_nonzero(best[1] == joint) for joint in range(q.shape[1])) < _FEWEST:
        return None
    return best


def isolated(seen: Seen, slides: Float[np.ndarray, " joints"] | None, rng: np.random.Generator) -> Isolated | None:
    """The axes as the movements of single joints show them; None where there are no such movements.

    Args:
        seen: the movements.
        slides: 1.0 where a joint slides; None: to be found out.
        rng: for starts.
    """
    found = alone(seen.q)
    if found is None:
        return None
    row, joint_of = found
    joints = seen.q.shape[1]
    posture = seen.q[row]
    tip = np.median(seen.x[joint_of == -1], axis=0)
    known = np.full(joints, np.nan) if slides is None else slides
    q, x = seen.q - posture, seen.x
    paths = []
    for joint in range(joints):
        own = joint_of == joint
        angles, places = np.append(q[own, joint], 0.0)[:, None], np.concatenate([x[own], tip[None]])
        paths.append(seen._replace(q=angles, x=places, turn=None))
    axes = [_axis(path, float(kind), rng) for path, kind in zip(paths, known, strict=True)]
    common = usual(np.array([axis.miss for axis in axes]))
    for joint, (path, kind) in enumerate(zip(paths, known, strict=True)):
        if axes[joint].miss > _UNUSUAL * common + _EXACT and len(path.q) > _FEWEST + 2:
            axes[joint] = _without_one(axes[joint], path, float(kind), common, rng)
    along, through, slides, gain, miss = (np.array(values) for values in zip(*axes, strict=True))
    travel = np.array([np.linalg.norm(path.x - tip, axis=1).max() for path in paths])
    return Isolated(along, through, slides, gain, miss, travel, tip, posture)


def isolated_arms(found: Isolated, count: int, seen: Seen, rng: np.random.Generator) -> Arms:
    """Starts from the axes that were found; all but the first with the unclear ones drawn at random."""
    joints = len(found.gain)
    motor = np.tile(np.arange(joints), (count, 1))
    drawn = lines_of(random_arms(count, seen, found.slides, motor[0], rng))
    redrawn = unclear(found) & (np.arange(count) > 0)[:, None]
    along = np.where(redrawn[..., None], drawn[0], found.along)
    through = np.where(redrawn[..., None], drawn[1], found.through)
    slides = np.where(redrawn, 0.0, found.slides)
    arms = from_lines(along, through, slides, np.tile(found.tip, (count, 1)), motor)
    return recentred(arms._replace(gain=np.where(redrawn, 1.0, found.gain)), -found.posture)


def doubtful(miss: Float[np.ndarray, " joints"]) -> Bool[np.ndarray, " joints"]:
    """Joints whose own movements are explained much worse than the others'."""
    return miss > _UNUSUAL * usual(miss) + _EXACT


def unclear(found: Isolated) -> Bool[np.ndarray, " joints"]:
    """Joints that are doubtful, or whose axis runs so near to the tip that it may point anywhere."""
    return doubtful(found.miss) | (found.travel < _CLEAR * usual(found.miss) + _EXACT)


def usual(miss: Float[np.ndarray, " joints"]) -> float:
    """What joints miss by that have one axis and no wild movement: at least a quarter of them is so."""
    return float(np.quantile(miss, 0.25))


class _Axis(NamedTuple):
    along: Float[np.ndarray, "3"]
    through: Float[np.ndarray, "3"]
    slides: float
    gain: float
    miss: float


def _without_one(all_of_it: _Axis, path: Seen, slides: float, common: float, rng: np.random.Generator) -> _Axis:
    """The axis without the movement that spoils it, if one does."""
    rows = np.arange(len(path.q))
    axes = [_axis(path.some(rows != row), slides, rng) for row in rows[:-1]]
    best = min(axes, key=lambda axis: axis.miss)
    return best if best.miss < _UNUSUAL * common + _EXACT else all_of_it


def _axis(path: Seen, slides: float, rng: np.random.Generator) -> _Axis:
    """The axis of one joint from its own movements; slides: 1.0, 0.0, or NaN: to be found out."""
    best, least = None, np.inf
    for loose in (False, True):
        arms = random_arms(_STARTS, path, np.array([float(slides > 0)]), np.zeros(1, int), rng)
        free = free_numbers(1, path.rows, gains=loose)
        cost, arms = _fitted(arms, path, free, np.array([loose]))
        cost = np.where(np.abs(arms.gain[:, 0]) < _LARGEST_GAIN, cost, np.inf)
        arms, cost = arms.pick(int(cost.argmin())), cost.min(keepdims=True)
        if loose and np.isnan(slides):
            slid = sliding(arms, suspects(arms, np.ptp(path.q, axis=0)))
            more, slid = _fitted(slid, path, free, np.array([True]))
            arms, cost = (slid, more) if more[0] < 1.5 * cost.min() + _EXACT**2 else (arms, cost)
        miss = float(np.sqrt(cost.min() / max(path.rows * len(path.q) - len(free), 1)))
        if miss < 0.7 * least:
            best, least = arms, miss
    assert best is not None
    along, through, _ = lines_of(best)
    return _Axis(along[0, 0], through[0, 0], float(best.slides[0, 0]), float(best.gain[0, 0]), least)


def _fitted(arms: Arms, seen: Seen, free: np.ndarray, gains: np.ndarray) -> tuple[np.ndarray, Arms]:
    held = held_numbers(arms, free, seen.rows, gains)
    arms, cost, _ = descend(arms, seen, free, steps=40, held=held)
    return cost, arms
