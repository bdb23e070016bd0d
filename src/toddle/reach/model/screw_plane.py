"""Starts for arms in the plane, where turning joints make the fit linear once it is known which way they turn.

With complex numbers for points and joint k turning by s_k q_k, the tip is at
``x = a_0 + sum_k a_k exp(i sum_{j<=k} s_j q_j)``: linear in the links a. The rates s (1 and -1, or gains on a grid) are
found one joint at a time.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from toddle.reach.model.screw_arms import Arms, from_lines
from toddle.reach.model.screw_steps import Seen

_WAYS = np.array([1.0, -1.0])
_RATES = np.array([0.5, 0.75, 1.0, 1.25, 1.5, -0.5, -0.75, -1.0, -1.25, -1.5])


def plane_arms(count: int, seen: Seen, motor: np.ndarray, rng: np.random.Generator, *, gains: bool) -> Arms:
    """Arms in the plane, the first from joints that all turn the same way, the others from ways drawn at random."""
    choices = _RATES if gains else _WAYS
    starts = [np.ones(len(motor)), *rng.choice(choices, (count - 1, len(motor)))]
    found = [_descended(rates, seen, motor, choices) for rates in starts]
    links = np.array([_links(rates, seen, motor)[0] for rates in found])
    points = np.cumsum(links, axis=1)
    flat = np.stack([np.real(points), np.imag(points), np.zeros(points.shape)], axis=-1)
    rates = np.array(found)
    along = np.zeros((*rates.shape, 3))
    along[..., 2] = np.sign(rates)
    arms = from_lines(along, flat[:, :-1], np.zeros(rates.shape), flat[:, -1], np.tile(motor, (count, 1)))
    return arms._replace(gain=np.abs(rates))


def _descended(rates: Float[np.ndarray, " axes"], seen: Seen, motor: np.ndarray, choices: np.ndarray) -> np.ndarray:
    """Better rates, changed one at a time while that helps."""
    best = _links(rates, seen, motor)[1]
    for _ in range(2 * len(rates)):
        before = best
        for axis in range(len(rates)):
            for choice in choices:
                trial = rates.copy()
                trial[axis] = choice
                cost = _links(trial, seen, motor)[1]
                if cost < best:
                    rates, best = trial, cost
        if best > 0.999 * before:
            break
    return rates


def _links(rates: np.ndarray, seen: Seen, motor: np.ndarray) -> tuple[np.ndarray, float]:
    """The base's place and the links, complex [m], and the cost of them [m^2]."""
    turn = np.exp(1j * np.cumsum(seen.q[:, motor] * rates, axis=1))
    told = np.concatenate([np.ones((len(turn), 1)), turn], axis=1)
    place = seen.x[:, 0] + 1j * seen.x[:, 1]
    normal = told.conj().T @ told
    links = np.linalg.solve(normal + 1e-9 * len(turn) * np.eye(len(normal)), told.conj().T @ place)
    return links, float((np.abs(place - told @ links) ** 2).sum())
