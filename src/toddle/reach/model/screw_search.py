"""The search for an arm that explains the movements: many starts, until one leaves nothing to explain."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from toddle.reach.model.screw_arms import Arms
from toddle.reach.model.screw_isolation import Isolated, doubtful, isolated, isolated_arms, unclear, usual
from toddle.reach.model.screw_mimic import with_followers
from toddle.reach.model.screw_plane import plane_arms
from toddle.reach.model.screw_start import lack_of_fit, random_arms, robust_sigma
from toddle.reach.model.screw_steps import NONE, Seen, descend, look
from toddle.reach.model.screw_types import free_numbers, held_numbers, idling, sliding, suspects, travel

_STARTS = 16
_SUBSET = 150  # movements that starts are tried on
_ROUNDS = 2
_CLOSE = 0.012  # of the spread of the tips: an arm that misses by more is not taken while there are starts left
_NEAR = 0.03  # of the spread of the tips: worth more steps
_CHANCE = 4.0  # standard deviations of the test of fit
_WILD = 4.6  # standard deviations of a coordinate: three coordinates miss by more once in ten thousand times
_MOST_FOLLOWED = 8  # joints: with more, trying every motor at every place takes too long
_STILL = 3.0  # standard deviations: an axis that moves the tip by less says nothing of itself
_MOST_WILD = 0.15
_EXACT = 1e-6  # of the spread of the tips: no noise to speak of, but that of rounded numbers
_UNIT = 0.1  # a gain that a few movements show nearer to 1 than this may be 1


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


class _Task(NamedTuple):
    """What is searched with: all movements, some of them for the starts, and what is known of the joints."""

    seen: Seen
    few: Seen
    slides: Float[np.ndarray, " joints"] | None
    rng: np.random.Generator


def search(seen: Seen, slides: Float[np.ndarray, " joints"] | None, rng: np.random.Generator) -> Candidate:
    """An arm that explains the movements, or the best that was found.

    Args:
        seen: the movements.
        slides: 1.0 where a joint slides; None: to be found out.
        rng: for the starts.
    """
    task = _Task(seen, seen.some(rng.permutation(len(seen.q))[:_SUBSET]), slides, rng)
    best: Candidate | None = None
    for candidate in _proposals(task):
        best = candidate if best is None else min(best, candidate, key=lambda one: (not one.fits, one.sigma))
        if best.fits:
            break
    assert best is not None
    return best


def _proposals(task: _Task) -> Iterator[Candidate]:
    """Ever more costly ideas of what the arm may be."""
    joints = task.seen.q.shape[1]
    shown = isolated(task.seen, task.slides, task.rng)
    if shown is not None:
        yield from _as_shown(shown, task)
        rigid = usual(shown.miss) < _CLOSE * task.seen.x.std()  # else no joint draws a circle: more axes are no help
        for _ in range((_ROUNDS if doubtful(shown.miss).any() else 1) if rigid else 0):
            yield from _with_followers(shown, task)
    for turn in range(_ROUNDS if shown is None else 1):
        yield tried(_starts(task, gains=False), np.zeros(joints, bool), task)[0]
        turning = tried(_starts(task, gains=True), np.ones(joints, bool), task)
        if task.slides is None:
            for candidate in turning[:3]:
                yield from _with_slides(candidate, task)
        yield turning[0]
        if turn == 0 and shown is None and joints <= _MOST_FOLLOWED:
            yield from _with_followers(shown, task)


def _starts(task: _Task, *, gains: bool) -> Arms:
    joints = task.seen.q.shape[1]
    slides = np.zeros(joints) if task.slides is None else task.slides
    if task.seen.rows == 2 and not slides.any():
        return plane_arms(2, task.few, np.arange(joints), task.rng, gains=gains)
    return random_arms(_STARTS, task.seen, slides, np.arange(joints), task.rng)


def _as_shown(shown: Isolated, task: _Task) -> Iterator[Candidate]:
    """From the axes that movements of single joints showed."""
    joints = len(shown.gain)
    count = 8 if unclear(shown).any() else 1
    if _near_unit(shown).all():
        rounded = shown._replace(gain=np.sign(shown.gain))
        yield tried(isolated_arms(rounded, count, task.seen, task.rng), np.zeros(joints, bool), task)[0]
    yield tried(isolated_arms(shown, count, task.seen, task.rng), np.ones(joints, bool), task)[0]


def _near_unit(shown: Isolated) -> Bool[np.ndarray, " joints"]:
    """Joints whose gain may be 1, and those that nothing is known of."""
    return (np.abs(np.abs(shown.gain) - 1) < _UNIT) | doubtful(shown.miss)


def _with_slides(candidate: Candidate, task: _Task) -> Iterator[Candidate]:
    """The same arm with its suspects put as sliding, all together and one by one, with gains free and not."""
    span = np.ptp(task.seen.q, axis=0)
    idle = travel(candidate.arms, span)[0] < _STILL * candidate.sigma + _EXACT * task.seen.x.std()
    if idle.any():
        candidate = tried(idling(candidate.arms, idle), candidate.gains & ~idle, task)[0]
        yield candidate
    suspected = suspects(candidate.arms, span)[0]
    if not suspected.any():
        return
    for choice in [suspected, *(np.eye(len(suspected), dtype=bool)[suspected] if suspected.sum() > 1 else [])]:
        arms = sliding(candidate.arms, choice)
        yield tried(arms._replace(gain=np.ones(arms.gain.shape)), np.zeros(len(choice), bool), task)[0]
        yield tried(arms, np.ones(len(choice), bool), task)[0]


def _with_followers(shown: Isolated | None, task: _Task) -> Iterator[Candidate]:
    """With one more axis, driven by a motor that drives another already."""
    unit = shown is None or bool(_near_unit(shown).all())
    for gains in (not unit, unit):
        arms, extra = with_followers(shown, task.few, task.slides, task.rng, gains=gains)
        loose = np.ones(arms.slides.shape, bool) if gains else extra
        yield tried(arms, loose, task)[0]


def tried(arms: Arms, gains: Bool[np.ndarray, "*arms axes"], task: _Task) -> list[Candidate]:
    """What becomes of some starts, the best first: by least squares, then with wild movements counting less."""
    gains = np.broadcast_to(gains, arms.slides.shape)
    free = free_numbers(gains.shape[1], task.seen.rows, gains=bool(gains.any()))
    held = held_numbers(arms, free, task.seen.rows, gains)
    arms = descend(arms, task.few, free, steps=60, held=held)[0]
    found = judged(arms, gains, task)
    if not found[0].fits and found[0].sigma < _NEAR * task.seen.x.std():
        found = [*_followed(found[0], task), *found[1:]]
    if found[0].fits:
        return found
    floor = 1e-12 * task.seen.x.std()
    square = look(arms, task.few, free).square
    for _ in range(5):
        scale = 5 * robust_sigma(square, task.seen.rows) + floor
        arms, _, square = descend(arms, task.few, free, steps=8, held=held, scale=scale)
    return judged(arms, gains, task)


def _followed(candidate: Candidate, task: _Task) -> list[Candidate]:
    """A promising candidate after more steps, on all movements."""
    arms, gains = candidate.arms, candidate.gains[None]
    free = free_numbers(gains.shape[1], task.seen.rows, gains=bool(gains.any()))
    held = held_numbers(arms, free, task.seen.rows, gains)
    return judged(descend(arms, task.seen, free, steps=100, held=held, tolerance=1e-6)[0], gains, task)


def judged(arms: Arms, gains: Bool[np.ndarray, "arms axes"], task: _Task) -> list[Candidate]:
    """How well some arms explain all movements, the best first; only the two best may be said to fit."""
    seen = task.seen
    square = look(arms, seen, NONE)
    sigma = robust_sigma(square.square, seen.rows)
    order = np.argsort(sigma)
    found = []
    for rank, which in enumerate(order):
        fits = rank < 2 and explains(square.miss[which], seen, float(sigma[which]), task.rng)
        found.append(Candidate(arms.pick(int(which)), gains[which], float(sigma[which]), fits))
    return found


def explains(miss: Float[np.ndarray, "rows movements"], seen: Seen, sigma: float, rng: np.random.Generator) -> bool:
    """Whether misses are small, few of them wild, and the joints don't foretell them."""
    spread = float(seen.x.std())
    if sigma < _EXACT * spread:
        return True
    if sigma > _CLOSE * spread:
        return False
    tame = (miss**2).sum(axis=0) < (_WILD * sigma) ** 2
    return bool(tame.mean() > 1 - _MOST_WILD) and lack_of_fit(miss[:, tame], seen.q[tame], rng) < _CHANCE
