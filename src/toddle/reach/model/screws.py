"""Learn a rigid arm from nothing but movements: the axes of its joints as unknown screws.

The tip's transform is a product of exponentials (Brockett 1984; Lynch, Park: Modern Robotics, 2017, section 4.1), of
which nothing is known: neither where the axes lie, nor which slide, nor how far the encoders turn for what they say.
All is found by Levenberg-Marquardt from several starts (`screw_search`, `screw_steps`).
"""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from toddle.reach.model.model import Fit
from toddle.reach.model.rigid import Rigid, number_slopes
from toddle.reach.model.screw_arms import Arms, linkage_from
from toddle.reach.model.screw_search import Candidate, search
from toddle.reach.model.screw_start import robust_sigma
from toddle.reach.model.screw_steps import Seen, descend, look
from toddle.reach.model.screw_types import free_numbers, held_numbers
from toddle.robots.linkage import Linkage
from toddle.signals import Experience


def fit_screws(
    experience: Experience, *, joints: tuple[str, ...], slides: Bool[np.ndarray, " joints"] | None = None, seed: int = 0
) -> Fit:
    """Learn a rigid arm."""
    began = time.perf_counter()
    rng = np.random.default_rng(seed)
    centre = experience.q.mean(axis=0)
    x = np.zeros((len(experience.x), 3))
    x[:, : experience.x.shape[1]] = experience.x
    seen = Seen(experience.q - centre, x, rows=experience.x.shape[1])
    found = search(seen, np.arange(len(joints)), None if slides is None else slides.astype(float), rng)
    final = polished(found, seen)
    linkage = linkage_from(final.arms, centre)
    coordinates = tuple(range(seen.rows))
    covariance = _covariance(linkage, experience.q, coordinates, final)
    model = Rigid(linkage, covariance, coordinates)
    miss = np.linalg.norm(experience.x - model.forward(experience.q), axis=1)
    return Fit(model, "screws", miss, final.sigma, final.wild, time.perf_counter() - began, ())


class Polished(NamedTuple):
    """An arm fitted to all tame movements."""

    arms: Arms
    free: np.ndarray
    wild: np.ndarray
    sigma: float


def polished(found: Candidate, seen: Seen) -> Polished:
    """The arm fitted to all tame movements by least squares."""
    rows, arms = seen.rows, found.arms
    axes = len(found.gains)

    def fitted(arms: Arms, gains: np.ndarray, seen: Seen, scale: float = np.inf):
        free = free_numbers(axes, rows, gains=True)
        held = held_numbers(arms, free, rows, gains)
        arms, cost, square = descend(arms, seen, free, steps=40, held=held, scale=scale, tolerance=1e-9)
        return arms, cost[0], square[0], free[~held[0]]

    square = look(arms, seen, np.zeros(0, int)).square
    for _ in range(2):
        scale = 5 * float(robust_sigma(square, rows)[0]) + 1e-12 * seen.x.std()
        arms, _, square, _ = fitted(arms, found.gains, seen, scale)
        square = square[None]
    wild = np.zeros(len(seen.q), bool)
    gains = found.gains
    for _ in range(3):
        tame = seen.some(~wild)
        arms, cost, square, free = fitted(arms, gains, tame)
        sigma = np.sqrt(cost / max(rows * (~wild).sum() - len(free), 1))
        square = look(arms, seen, np.zeros(0, int)).square[0]
        new = square > (4.6 * sigma) ** 2 + 1e-20 * seen.x.var()
        if (new == wild).all():
            break
        wild = new
    return Polished(arms, free, wild, float(sigma))


def _covariance(
    linkage: Linkage, q: Float[np.ndarray, "movements joints"], coordinates: tuple[int, ...], final: Polished
) -> Float[np.ndarray, "numbers numbers"]:
    slope = number_slopes(linkage, q[~final.wild])[1][:, coordinates]
    slope = slope.reshape(-1, slope.shape[2])[:, final.free]
    covariance = np.zeros((7 * len(linkage.slides) + 6,) * 2)
    covariance[np.ix_(final.free, final.free)] = final.sigma**2 * np.linalg.pinv(slope.T @ slope, rcond=1e-10)
    return covariance
