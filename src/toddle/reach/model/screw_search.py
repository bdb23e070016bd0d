"""The search for an arm that explains the movements: many starts, until one leaves nothing to explain."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Int

from toddle.reach.model.screw_arms import Arms
from toddle.reach.model.screw_start import lack_of_fit, random_arms, robust_sigma
from toddle.reach.model.screw_steps import Seen, descend, look
from toddle.reach.model.screw_types import free_numbers, held_numbers, sliding, suspects

_STARTS = 16
_SUBSET = 150  # movements that starts are tried on
_ROUNDS = 4
_CLOSE = 0.012  # of the spread of the tips: an arm that misses by more is not taken while there are starts left
_CHANCE = 4.0  # standard deviations of the test of fit
_WILD = 4.6  # standard deviations [of each coordinate], of a miss: one in ten thousand of three coordinates
_MOST_WILD = 0.15


class Candidate(NamedTuple):
    """An arm, and how well it explains the movements.

    Attributes:
        arms: one.
        gains: axes whose gain was free.
        sigma: standard deviation of a coordinate's miss, by the median [m].
        fits: nothing is left to explain.
    """

    arms: Arms
    gains: Bool[np.ndarray, " axes"]
    sigma: float
    fits: bool


def search(
    seen: Seen, motor: Int[np.ndarray, " axes"], slides: np.ndarray | None, rng: np.random.Generator
) -> Candidate:
    """An arm that explains the movements, or the best that was found."""
    few = seen.some(rng.permutation(len(seen.q))[:_SUBSET])
    axes = len(motor)
    guess = np.zeros(axes) if slides is None else slides
    fixed, loose = np.zeros(axes, bool), np.ones(axes, bool)
    best: Candidate | None = None
    for _ in range(_ROUNDS):
        best = _best(best, tried(random_arms(_STARTS, seen, guess, motor, rng), fixed, few, seen, rng))
        if best.fits:
            return best
        turning = tried(random_arms(_STARTS, seen, guess, motor, rng), loose, few, seen, rng)
        best = _best(best, turning)
        if slides is None:
            for candidate in turning[:3]:
                best = _best(best, with_slides(candidate, few, seen, rng))
                if best.fits:
                    break
        if best.fits:
            return best
    assert best is not None
    return best


def with_slides(candidate: Candidate, few: Seen, seen: Seen, rng: np.random.Generator) -> list[Candidate]:
    """The same arm with its suspects put as sliding, all together and one by one, with gains free and not."""
    doubtful = suspects(candidate.arms, np.ptp(seen.q, axis=0))[0]
    if not doubtful.any():
        return []
    choices = [doubtful, *(np.eye(len(doubtful), dtype=bool)[doubtful] if doubtful.sum() > 1 else [])]
    found: list[Candidate] = []
    for choice in choices:
        arms = sliding(candidate.arms, choice)
        found += tried(arms._replace(gain=np.ones(arms.gain.shape)), ~np.ones(len(choice), bool), few, seen, rng)
        found += tried(arms, np.ones(len(choice), bool), few, seen, rng)
    return sorted(found, key=lambda one: one.sigma)


def tried(
    arms: Arms, gains: Bool[np.ndarray, " axes"], few: Seen, seen: Seen, rng: np.random.Generator
) -> list[Candidate]:
    """What becomes of some starts, the best first: by least squares, then with wild movements counting less."""
    free = free_numbers(len(gains), seen.rows, gains=bool(gains.any()))
    held = held_numbers(arms, free, seen.rows, gains)
    arms = descend(arms, few, free, steps=60, held=held)[0]
    found = judged(arms, gains, seen, rng)
    if found[0].fits:
        return found
    floor = 1e-12 * seen.x.std()
    square = look(arms, few, free).square
    for _ in range(5):
        scale = 5 * robust_sigma(square, seen.rows) + floor
        arms, _, square = descend(arms, few, free, steps=8, held=held, scale=scale)
    return judged(arms, gains, seen, rng)


def judged(arms: Arms, gains: Bool[np.ndarray, " axes"], seen: Seen, rng: np.random.Generator) -> list[Candidate]:
    """How well some arms explain all movements, the best first."""
    state = look(arms, seen, np.zeros(0, int))
    sigma = robust_sigma(state.square, seen.rows)
    order = np.argsort(sigma)
    found = []
    for which in order:
        fits = False
        if len(found) < 2 and sigma[which] < _CLOSE * seen.x.std():
            tame = state.square[which] < (_WILD * sigma[which]) ** 2 + 1e-24 * seen.x.var()
            fits = tame.mean() > 1 - _MOST_WILD and (
                sigma[which] < 1e-9 * seen.x.std()
                or lack_of_fit(state.miss[which][:, tame], seen.q[tame], rng) < _CHANCE
            )
        found.append(Candidate(arms.pick(which), gains, float(sigma[which]), fits))
    return found


def _best(best: Candidate | None, found: list[Candidate]) -> Candidate:
    """The better of what there was and what was found; one that fits before any that does not."""
    every = [*found, *([] if best is None else [best])]
    return min(every, key=lambda one: (not one.fits, one.sigma))
