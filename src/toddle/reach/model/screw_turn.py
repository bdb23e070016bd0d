"""An arm whose tip's orientation was seen, too: first its places explain the axes, then its turns settle the rest.

The tip's own frame follows from the axes by singular values (Wahba's problem). Axes that the places say nothing of (a
last wrist roll, say) are tried in several directions. A radian counts as many metres as makes both kinds of miss alike.
"""

from __future__ import annotations

import numpy as np

from toddle.reach.model.rigid import PER_AXIS
from toddle.reach.model.screw_arms import Arms, from_lines, lines_of, move, side_by_side
from toddle.reach.model.screw_start import robust_sigma
from toddle.reach.model.screw_steps import NONE, Seen, descend, look, turned
from toddle.reach.model.screw_types import free_numbers, held_numbers

_STARTS = 16
_SUBSET = 100  # movements that starts are tried on


def with_turns(arms: Arms, gains: np.ndarray, seen: Seen, sigma: float, rng: np.random.Generator) -> tuple[Arms, Seen]:
    """The arm with its tip's frame and idle axes found, and the movements with what a radian counts [m].

    Args:
        arms: one that explains the places.
        gains: axes whose gain is free.
        seen: the movements, turns among them.
        sigma: standard deviation of a seen coordinate [m].
        rng: for the starts.
    """
    seen = seen._replace(lever=0.3 * float(seen.x.std()))
    starts = _tips_set(_idle_redrawn(arms, seen, sigma, rng), seen)
    few = seen.some(rng.permutation(len(seen.q))[:_SUBSET])
    free = free_numbers(arms.slides.shape[1], seen.rows, gains=True, turns=True)
    best = None
    for loose in (gains, np.ones(len(gains), bool)):
        held = held_numbers(starts, free, seen.rows, loose)
        found, _, square = descend(starts, few, free, steps=40, held=held, scale=2 * seen.lever)
        cost = np.median(square, axis=1)
        best = found.pick(int(cost.argmin()))
        if cost.min() < (0.1 * seen.lever) ** 2:
            break
    assert best is not None
    for _ in range(2):
        best, seen = _relevered(best, seen)
        scale = 8 * float(robust_sigma(look(best, seen, free).square, 6)[0]) + 1e-12
        best = descend(best, seen, free, steps=20, held=held_numbers(best, free, seen.rows, gains), scale=scale)[0]
    return _relevered(best, seen)


def _relevered(arms: Arms, seen: Seen) -> tuple[Arms, Seen]:
    """What a radian counts, by the misses of place and of turn."""
    motion = move(arms, seen.q, NONE)
    places = ((seen.x.T - motion.place)[:, : seen.rows] ** 2).sum(axis=1)
    turns = (turned(motion.turn, seen.turn) ** 2).sum(axis=1)
    far, round_ = float(robust_sigma(places, seen.rows)[0]), float(robust_sigma(turns, 3)[0])
    spread = float(seen.x.std())
    lever = max(far, 1e-10 * spread) / max(round_, 1e-10)
    return arms, seen._replace(lever=float(np.clip(lever, 1e-3 * spread, 1e3 * spread)))


def _idle_redrawn(arms: Arms, seen: Seen, sigma: float, rng: np.random.Generator) -> Arms:
    """The arm, and others whose axes that hardly move the tip point anywhere."""
    along, through, tip = lines_of(arms)
    free = PER_AXIS * np.arange(along.shape[1]) + 5
    reach = np.sqrt((look(arms, seen._replace(lever=0.0, turn=None), free).slope[0] ** 2).sum(axis=1).mean(axis=1))
    idle = (reach < 3 * sigma + 1e-9 * seen.x.std()) & (arms.slides[0] == 0)
    if not idle.any():
        return arms
    others = np.where(idle[:, None], rng.normal(size=(_STARTS, *along.shape[1:])), along)
    middle = np.where(idle[:, None], tip[:, None], through)
    drawn = from_lines(
        others,
        np.repeat(middle, _STARTS, axis=0),
        np.repeat(arms.slides, _STARTS, axis=0),
        np.repeat(tip, _STARTS, axis=0),
        np.repeat(arms.motor, _STARTS, axis=0),
    )
    gain = np.where(idle, 1.0, np.repeat(arms.gain, _STARTS, axis=0))
    return side_by_side([arms, drawn._replace(gain=gain)])


def _tips_set(arms: Arms, seen: Seen) -> Arms:
    """The same arms with the tip's frame turned as it was seen, as well as that goes."""
    model = move(arms, seen.q, NONE).turn
    assert seen.turn is not None
    # the turn D of the tip's frame with model D nearest to seen: by singular values of the sum of model^T seen
    left, _, right = np.linalg.svd(np.einsum("akrm,mrs->aks", model, seen.turn))
    left[..., -1] *= np.linalg.det(left @ right)[:, None]
    turn = np.tile(np.eye(4), (len(left), 1, 1))
    turn[:, :3, :3] = left @ right
    return arms._replace(tip=arms.tip @ turn)
