"""Motors that drive two axes of the arm (mimic joints): which, and where in the chain the second one sits.

Every motor that may do so is tried with its second axis at every place of the chain. Each such arm starts several
times; hopeless starts are given up early.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from toddle.reach.model.screw_arms import Arms, from_lines, lines_of, recentred, side_by_side
from toddle.reach.model.screw_isolation import Isolated, doubtful
from toddle.reach.model.screw_start import random_arms
from toddle.reach.model.screw_steps import Seen, descend
from toddle.reach.model.screw_types import free_numbers, held_numbers

_STARTS = 4  # of each motor and place
_KEPT = 12
_SUSPECTED = 2  # motors whose own movements show no second axis clearly


def with_followers(
    shown: Isolated | None,
    seen: Seen,
    slides: Float[np.ndarray, " joints"] | None,
    rng: np.random.Generator,
    *,
    gains: bool,
) -> tuple[Arms, Bool[np.ndarray, "arms axes"]]:
    """The most promising arms in which one motor drives two axes, and which of their axes are second ones.

    Args:
        shown: the axes that movements of single joints showed, if there were such movements.
        seen: the movements.
        slides: 1.0 where a joint slides, where that is known.
        rng: for the starts.
        gains: whether all encoders may turn further, or less, than they say; else second axes alone.
    """
    joints = seen.q.shape[1]
    motors = np.arange(joints)
    if shown is not None:
        suspected = np.argsort(-shown.miss)[:_SUSPECTED]
        motors = np.flatnonzero(doubtful(shown.miss)) if doubtful(shown.miss).any() else suspected
    groups, second = [], []
    for motor in motors:
        for place in range(joints + 1):
            order = np.insert(np.arange(joints), place, motor)
            groups.append(_group(shown, seen, slides, order, place, rng, gains))
            second.append(np.tile(np.arange(joints + 1) == place, (_STARTS, 1)))
    arms, extra = side_by_side(groups), np.concatenate(second)
    free = free_numbers(joints + 1, seen.rows, gains=True)
    loose = np.ones(extra.shape, bool) if gains else extra
    held = held_numbers(arms, free, seen.rows, loose)
    arms, cost, _ = descend(arms, seen.some(slice(0, 100)), free, steps=25, held=held)
    kept = np.argsort(cost)[:_KEPT]
    return arms.pick(kept), extra[kept]


def _group(
    shown: Isolated | None,
    seen: Seen,
    slides: np.ndarray | None,
    order: np.ndarray,
    place: int,
    rng: np.random.Generator,
    gains: bool,
) -> Arms:
    """Starts for one motor and one place of its second axis."""
    known = np.zeros(len(order)) if slides is None else slides[order]
    if shown is not None:
        known = shown.slides[order]
    motor = int(order[place])
    drawn = random_arms(_STARTS, seen, np.where(order == motor, 0.0, known), order, rng)
    if shown is None:
        return drawn
    along, through, _ = lines_of(drawn)
    keeps = ((order != motor) & ~doubtful(shown.miss)[order])[:, None]
    arms = from_lines(
        np.where(keeps, shown.along[order], along),
        np.where(keeps, shown.through[order], through),
        drawn.slides,
        np.tile(shown.tip, (_STARTS, 1)),
        drawn.motor,
    )
    gain = np.where(~keeps[:, 0], 1.0, shown.gain[order] if gains else np.sign(shown.gain[order]))
    return recentred(arms._replace(gain=np.tile(gain, (_STARTS, 1))), -shown.posture)
