"""The last fit of an arm: wild movements left out, gains freed or fixed as the data says, and how sure the numbers are.

Left out is what misses by more than a normal distribution would in one of ten thousand movements; the rest is fitted by
least squares, so that the covariance is ``s^2 (J^T J)^+`` with the estimated variance s^2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from toddle.reach.model.rigid import PER_AXIS, number_slopes
from toddle.reach.model.screw_arms import Arms, without
from toddle.reach.model.screw_start import robust_sigma
from toddle.reach.model.screw_steps import NONE, Seen, descend, look
from toddle.reach.model.screw_types import free_numbers, held_numbers, idling, sliding, suspects, travel
from toddle.robots.linkage import Linkage

_QUANTILE = {1: 15.14, 2: 18.42, 3: 21.11, 5: 25.74, 6: 27.86}  # of chi-square, one in ten thousand above
_EXACT = 1e-7  # of the spread of the tips: what rounded numbers alone may miss by


_STILL = 3.0  # standard deviations: an axis that moves the tip by less says nothing of itself


class Final(NamedTuple):
    """An arm as it is handed over.

    Attributes:
        arms: one.
        gains: axes whose gain is other than 1.
        free: the numbers that were fitted.
        wild: movements that were left out.
        sigma: standard deviation of a coordinate that was seen [m].
    """

    arms: Arms
    gains: Bool[np.ndarray, " axes"]
    free: Int[np.ndarray, " free"]
    wild: Bool[np.ndarray, " movements"]
    sigma: float


def finished(arms: Arms, gains: Bool[np.ndarray, " axes"], seen: Seen) -> Final:
    """The arm fitted to all movements but the wild ones, with as few gains free as explain them."""
    rows = look(arms, seen.some(slice(0, 1)), NONE).miss.shape[1]
    square = look(arms, seen, NONE).square
    floor = _EXACT * float(seen.x.std())
    for _ in range(2):
        scale = 5 * float(robust_sigma(square, rows)[0]) + floor
        arms, square, _ = _fitted(arms, gains, seen, scale)
    wild = _wild(square[0], float(robust_sigma(square, rows)[0]) + floor, rows)
    final = _settled(arms, gains, seen, wild, rows)
    for axis in np.flatnonzero(suspects(final.arms, np.ptp(seen.q, axis=0))[0]):
        slid = _unit(sliding(final.arms, np.arange(len(gains)) == axis), final.gains)
        if travel(final.arms, np.ptp(seen.q, axis=0))[0, axis] < _STILL * final.sigma + floor:
            idle = idling(final.arms, np.arange(len(gains)) == axis)
            kept = final.gains & (np.arange(len(gains)) != axis)
            final = _simpler(final, _settled(idle, kept, seen, final.wild, rows), seen, rows)
            continue
        final = _simpler(final, _settled(slid, final.gains, seen, final.wild, rows), seen, rows)
    for axis in np.flatnonzero(~_first_axes(final.arms))[::-1]:
        shorter, kept = without(final.arms, int(axis)), np.delete(final.gains, axis)
        final = _simpler(final, _settled(shorter, kept, seen, final.wild, rows), seen, rows)
    for which in _gains_to_try(final, seen, rows):
        final = _simpler(final, _settled(_unit(final.arms, which), which, seen, final.wild, rows), seen, rows)
    return final


def covariance(
    linkage: Linkage, final: Final, q: Float[np.ndarray, "movements joints"], rows: int, lever: float
) -> Float[np.ndarray, "numbers numbers"]:
    """Of the linkage's numbers (see `toddle.reach.model.rigid`); zero for those that were not fitted.

    Args:
        linkage: the arm, for joint values as they are.
        final: the fit.
        q: all movements [rad or m].
        rows: how many coordinates of the tip were seen.
        lever: what a radian of the tip's turn counted [m].
    """
    slope = number_slopes(linkage, q[~final.wild])[1][:, :, final.free]
    slope = np.concatenate([slope[:, :rows], lever * slope[:, 3:]], axis=1) if lever else slope[:, :rows]
    flat = slope.reshape(-1, len(final.free))
    whole = np.zeros((PER_AXIS * len(linkage.slides) + 6,) * 2)
    whole[np.ix_(final.free, final.free)] = final.sigma**2 * np.linalg.pinv(flat.T @ flat, rcond=1e-11, hermitian=True)
    return whole


def _fitted(
    arms: Arms, gains: np.ndarray, seen: Seen, scale: float = np.inf
) -> tuple[Arms, Float[np.ndarray, "arms movements"], Int[np.ndarray, " free"]]:
    free = free_numbers(len(gains), seen.rows, gains=True, turns=seen.lever > 0)
    held = held_numbers(arms, free, seen.rows, gains)
    arms, _, square = descend(arms, seen, free, steps=60, held=held, scale=scale, tolerance=1e-8)
    return arms, square, free[~held[0]]


def _settled(arms: Arms, gains: np.ndarray, seen: Seen, wild: np.ndarray, rows: int) -> Final:
    """Least squares on the tame movements, until they stay the same."""
    sigma, free = 0.0, NONE
    for _ in range(4):
        arms, square, free = _fitted(arms, gains, seen.some(~wild))
        sigma = float(np.sqrt(square.sum() / max(rows * np.count_nonzero(~wild) - len(free), 1)))
        again = _wild(look(arms, seen, NONE).square[0], sigma + _EXACT * float(seen.x.std()), rows)
        if (again == wild).all():
            break
        wild = again
    return Final(arms, gains, free, wild, sigma)


def _wild(square: Float[np.ndarray, " movements"], sigma: float, rows: int) -> Bool[np.ndarray, " movements"]:
    found = square > _QUANTILE[rows] * sigma**2
    return found if found.mean() < 0.5 else np.zeros(len(square), bool)


def _gains_to_try(final: Final, seen: Seen, rows: int) -> list[Bool[np.ndarray, " axes"]]:
    """Other choices of gains: those that lie far from 1 when all are free, and none but those of second axes."""
    followers = ~_first_axes(final.arms)
    every = _settled(final.arms, np.ones(len(final.gains), bool), seen, final.wild, rows)
    return [followers, followers | (_far_from_unit(every, seen) & ~_idle(final, seen))]


def _idle(final: Final, seen: Seen) -> Bool[np.ndarray, " axes"]:
    """Axes that move the tip by too little for their gain to be told."""
    turned = look(final.arms, seen, PER_AXIS * np.arange(len(final.gains)) + 5).slope[0]
    return (final.arms.slides[0] == 0) & (np.sqrt((turned**2).sum(axis=(1, 2))) < 20 * final.sigma)


def _first_axes(arms: Arms) -> Bool[np.ndarray, " axes"]:
    """The first axis of each motor."""
    first = np.zeros(arms.motor.shape[1], bool)
    first[np.unique(arms.motor[0], return_index=True)[1]] = True
    return first


def _far_from_unit(final: Final, seen: Seen) -> Bool[np.ndarray, " axes"]:
    slope = look(final.arms, seen.some(~final.wild), final.free).slope[0]
    flat = slope.reshape(len(slope), -1)
    variance = np.diag(np.linalg.pinv(flat @ flat.T, rcond=1e-12, hermitian=True)) * final.sigma**2
    far = np.zeros(len(final.gains), bool)
    stretched = (final.free % PER_AXIS == 6) & (final.free < PER_AXIS * len(final.gains))
    axes = final.free[stretched] // PER_AXIS
    deviation = np.sqrt(variance[stretched]) * np.abs(final.arms.gain[0, axes])
    far[axes] = np.abs(np.abs(final.arms.gain[0, axes]) - 1) > 3 * deviation + 1e-7
    return far


def _unit(arms: Arms, gains: np.ndarray) -> Arms:
    """The arm with the gains that are not free put to 1, or -1."""
    return arms._replace(gain=np.where(gains, arms.gain, np.sign(arms.gain)))


def _simpler(one: Final, other: Final, seen: Seen, rows: int) -> Final:
    """Of two fits, the one with more numbers only where chance would not explain that it is better."""
    few, many = (one, other) if len(one.free) < len(other.free) else (other, one)
    tame = ~(one.wild | other.wild)
    costs = [look(fit.arms, seen.some(tame), NONE).square.sum() for fit in (few, many)]
    more = len(many.free) - len(few.free)
    variance = costs[1] / max(rows * np.count_nonzero(tame) - len(many.free), 1) + (_EXACT * float(seen.x.std())) ** 2
    worse = np.count_nonzero(few.wild) > np.count_nonzero(many.wild) + 0.02 * len(tame)
    better_by_chance = costs[0] - costs[1] < variance * (more + 3 * np.sqrt(2 * more))
    return few if better_by_chance and not worse else many
