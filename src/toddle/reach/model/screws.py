"""Learn a rigid arm from nothing but movements: the axes of its joints as unknown screws.

The tip's transform is a product of exponentials (Brockett 1984; Lynch, Park: Modern Robotics, 2017, section 4.1), of
which nothing is known: neither where the axes lie, nor which slide, nor how far the encoders turn for what they say.
All is found by Levenberg-Marquardt from several starts (`screw_search`, `screw_steps`).
"""

from __future__ import annotations

import time

import numpy as np
from jaxtyping import Bool

from toddle.reach.model.model import Fit
from toddle.reach.model.rigid import Rigid
from toddle.reach.model.screw_arms import linkage_from, tidied
from toddle.reach.model.screw_check import checked, refuse_unmoved
from toddle.reach.model.screw_final import covariance, finished
from toddle.reach.model.screw_notes import notes_of
from toddle.reach.model.screw_search import search
from toddle.reach.model.screw_steps import NONE, Seen, look
from toddle.reach.model.screw_turn import with_turns
from toddle.signals import Experience


def fit_screws(
    experience: Experience, *, joints: tuple[str, ...], slides: Bool[np.ndarray, " joints"] | None = None, seed: int = 0
) -> Fit:
    """Learn a rigid arm from movements that it made.

    Random movements do; some that move one joint at a time (`toddle.reach.explore.isolating`) make it quicker and find
    harder arms. The accuracy to expect is ``noise * sqrt(P / movements)`` with P numbers, about 4 a joint and 3.

    Args:
        experience: the movements; with two coordinates of the tip, all joints turn about z or slide in the plane.
        joints: the joints' names, in the order of the chain and of the columns of q.
        slides: which joints slide; None: that is found out.
        seed: for the starts.

    Returns:
        The fit, its model a `toddle.reach.model.rigid.Rigid`. Where no structure explains the movements it is the best
        that was found, and its miss shows that.

    Raises:
        BadInput: there are too few movements, a joint stays or always moves with another, or the tip doesn't move.
    """
    began = time.perf_counter()
    good, whole = checked(experience, joints)
    rng = np.random.default_rng(seed)
    centre = good.q.mean(axis=0)
    rows = good.x.shape[1]
    x = np.pad(good.x.astype(float), ((0, 0), (0, 3 - rows)))
    seen = Seen(good.q - centre, x, None if rows == 2 else good.turn, rows)
    found = search(seen._replace(turn=None), None if slides is None else slides.astype(float), rng)
    final = finished(found.arms, found.gains, seen._replace(turn=None))
    if not found.fits:
        refuse_unmoved(good, np.linalg.norm(look(final.arms, seen._replace(turn=None), NONE).miss[0], axis=0), rng)
    if seen.turn is not None:
        arms, seen = with_turns(final.arms, final.gains, seen, final.sigma, rng)
        final = finished(arms, final.gains, seen)
    linkage = linkage_from(tidied(final.arms), centre)
    model = Rigid(linkage, covariance(linkage, final, good.q, rows, seen.lever), tuple(range(rows)))
    miss, wild = np.full(len(whole), np.nan), ~whole
    miss[whole] = np.linalg.norm(good.x - model.forward(good.q), axis=1)
    wild[whole] = final.wild
    notes = notes_of(final, joints, found.fits, seen, whole)
    return Fit(model, "screws", miss, final.sigma, wild, time.perf_counter() - began, notes)
