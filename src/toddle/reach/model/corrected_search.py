"""Gross errors of a description: a joint that moves the other way round, a zero that is off by a large angle.

Small steps don't get there, so such changes are tried: every sign and coarse zero of one joint, kept where they bring
the description nearer to the movements, several joints one after the other (a beam search on the median miss, which
wild movements don't move). Only the best few are then fitted.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from toddle.reach.model.corrected_fit import Belief, Seen, most_probable
from toddle.robots.linkage import Linkage, poses

_COARSE = np.radians(np.arange(-150, 181, 30))
_BEAM, _DEPTH, _FITTED = 6, 3, 4


class Start(NamedTuple):
    """A description with gross errors taken out.

    Attributes:
        linkage: its constants.
        zero: what was added to each joint's reading [rad].
        flipped: joints that move the other way.
    """

    linkage: Linkage
    zero: Float[np.ndarray, " joints"]
    flipped: Bool[np.ndarray, " joints"]


def better_start(seen: Seen, belief: Belief) -> Start | None:
    """The description with the fewest gross changes from which a fit misses least; None: none is better."""
    joints = seen.q.shape[1]
    asked = _start(seen.nominal, np.zeros(joints), np.zeros(joints, bool))
    found, beam = {_name(asked): (_miss(seen, asked), asked)}, [asked]
    for _ in range(_DEPTH):
        for start in beam:
            for trial in _neighbours(seen.nominal, start):
                if _name(trial) not in found:
                    found[_name(trial)] = (_miss(seen, trial), trial)
        beam = [start for _, start in sorted(found.values(), key=lambda entry: entry[0])][:_BEAM]
    fitted = [(_fitted(seen, start, belief), start) for start in beam[:_FITTED]]
    level, best = min(fitted, key=lambda entry: entry[0])
    return None if best is asked or level >= _fitted(seen, asked, belief) else best


def _neighbours(nominal: Linkage, start: Start) -> list[Start]:
    """One joint changed, each in every way."""
    slides = (nominal.gain[nominal.slides > 0] != 0).any(axis=0)
    trials = []
    for joint, change in enumerate(np.eye(len(start.zero))):
        for flipped in (start.flipped, start.flipped ^ (change > 0)):
            trials += [
                _start(nominal, start.zero + change * zero, flipped) for zero in ((0.0,) if slides[joint] else _COARSE)
            ]
    return trials


def _start(nominal: Linkage, zero: Float[np.ndarray, " joints"], flipped: Bool[np.ndarray, " joints"]) -> Start:
    gain = nominal.gain * np.where(flipped, -1.0, 1.0)
    return Start(nominal._replace(gain=gain, offset=nominal.offset + gain @ zero), zero, flipped)


def _name(start: Start) -> tuple[float, ...]:
    return (*np.round(np.mod(start.zero, 2 * np.pi), 6).tolist(), *start.flipped.astype(float).tolist())


def _miss(seen: Seen, start: Start) -> float:
    """The median distance between what was seen and what is described [m]."""
    off = seen.x - poses(start.linkage, seen.q)[:, seen.coordinates, 3]
    return float(np.median(np.linalg.norm(off, axis=1)))


def _fitted(seen: Seen, start: Start, belief: Belief) -> float:
    """The noise that is left after small changes [m]."""
    return most_probable(seen._replace(nominal=start.linkage), belief, rounds=2).sensor[0]
