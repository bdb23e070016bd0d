"""A description that is only wrong is corrected from few movements instead of learned from none.

Zeros off by degrees, links by millimetres: the numbers of `toddle.reach.model.rigid` that make a known linkage explain
the movements, the most probable ones given how wrong descriptions are (`corrected_fit`). Whether links are also tilted
and gains off is decided by the evidence. A joint that turns the other way round, or a zero that is off by a large
angle, is looked for when the first fit is poor (`corrected_search`). What was changed, joint by joint, is said by
`corrected_changes`.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from toddle.failures import BadInput
from toddle.reach.model.corrected_changes import Change, changes_of
from toddle.reach.model.corrected_fit import Belief, Changes, Seen, blockwise, most_probable
from toddle.reach.model.corrected_search import Start, better_start
from toddle.reach.model.model import Fit
from toddle.reach.model.rigid import Rigid, changed
from toddle.robots.linkage import Linkage
from toddle.signals import Experience

_COARSE = 0.003  # [m] noise above which signs and large zeros are looked at
_DOUBTFUL, _ABSURD = 0.03, 0.15  # misses, as a share of the workspace's size
_FROM_NOTHING = "learn the arm from nothing instead, from at least 100 movements"


class Widths(NamedTuple):
    """How wrong a description may be: standard deviations, each for every axis.

    Attributes:
        zero: of a turning joint's zero [rad]; wide, so that what a zero can explain is put down to it.
        slide: of a sliding joint's zero [m].
        shift: of an axis' place, on each coordinate [m].
        turn: of an axis' tilt, if the evidence is that there is any [rad].
        gain: of a gain, if the evidence is that it is off.
        base: of the first axis' place, for an observer that is placed less well; None: as `shift` [m].
        tip: of the tip's place, for a marker that is placed less well; None: as `shift` [m].
    """

    zero: float = math.radians(15.0)
    slide: float = 0.02
    shift: float = 0.005
    turn: float = 0.01
    gain: float = 0.01
    base: float | None = None
    tip: float | None = None


STRAIGHT = (3e-4, 0.0)  # tilts [rad] and gains of a description that is right about them


@dataclass(frozen=True)
class Corrected:
    """A corrected description.

    Attributes:
        fit: the corrected arm, a `Rigid`, and how it sits in the movements.
        changes: axis by axis, the tip last.
        doubtful: small changes don't explain the movements; the fit's last note says so.
    """

    fit: Fit
    changes: tuple[Change, ...]
    doubtful: bool


def assumed(nominal: Linkage, *, coordinates: tuple[int, ...] = (0, 1, 2), widths: Widths | None = None) -> Rigid:
    """A described arm and how wrong its description may be, before any movement."""
    straight = (widths or Widths())._replace(turn=STRAIGHT[0], gain=STRAIGHT[1])
    return Rigid(nominal, np.diag(_belief(nominal, straight).sd ** 2), coordinates)


def correct(
    nominal: Linkage,
    experience: Experience,
    *,
    joints: tuple[str, ...],
    coordinates: tuple[int, ...] = (0, 1, 2),
    widths: Widths | None = None,
    seed: int = 0,
) -> Corrected:
    """Correct a described arm so that it explains the movements.

    Args:
        nominal: the arm as described.
        experience: movements made and watched.
        joints: names of the joints, in the order of the experience's columns.
        coordinates: which of x, y, z the experience's positions have.
        widths: how wrong the description may be.
        seed: draws the postures over which the uncertainty of what is reported is judged.

    Raises:
        BadInput: too few movements, numbers that are not finite, or movements that can't be this robot's.
    """
    began = time.perf_counter()
    _check(nominal, experience, joints, coordinates)
    widths = widths or Widths()
    seen = Seen(nominal, experience.q, experience.x, experience.turn, coordinates)
    found = _by_evidence(seen, widths)
    start = Start(nominal, np.zeros(len(joints)), np.zeros(len(joints), bool))
    if found.sensor[0] > _COARSE:
        other = better_start(seen, _belief(nominal, widths._replace(turn=STRAIGHT[0], gain=STRAIGHT[1])))
        again = None if other is None else _by_evidence(seen._replace(nominal=other.linkage), widths)
        if other is not None and again is not None and again.sensor[0] < found.sensor[0] / 2:
            start, found, seen = other, again, seen._replace(nominal=other.linkage)
    changes = changes_of(seen, found, start, joints, seed=seed)
    doubt = _doubt(seen, found)
    notes = (*_unmoved(experience, joints), *_left_out(found), *([doubt] if doubt else []))
    by_step = blockwise(np.eye(len(found.numbers)), found.numbers)
    model = Rigid(changed(seen.nominal, found.numbers), by_step @ found.covariance @ by_step.T, coordinates)
    fit = Fit(model, "corrected", found.miss, found.sensor[0], ~found.keep, time.perf_counter() - began, notes)
    return Corrected(fit, changes, bool(doubt))


def _by_evidence(seen: Seen, widths: Widths) -> Changes:
    """Links straight or tilted, gains right or off: whichever makes the movements most probable."""
    straight = widths._replace(turn=STRAIGHT[0], gain=STRAIGHT[1])
    found = near = most_probable(seen, _belief(seen.nominal, straight))
    for turn, gain in ((True, False), (False, True), (True, True)):
        taken = widths._replace(turn=widths.turn if turn else STRAIGHT[0], gain=widths.gain if gain else STRAIGHT[1])
        belief = _belief(seen.nominal, taken, turn=turn, gain=gain)
        trial = most_probable(seen, belief, start=near.numbers)
        found = max(found, trial, key=lambda changes: changes.evidence)
    return found


def _belief(nominal: Linkage, widths: Widths, *, turn: bool = False, gain: bool = False) -> Belief:
    """A width for every number; the movements may revise those of shifts, and of tilts and gains where asked."""
    axes, turns, gains = len(nominal.slides), 1 if turn else -1, 2 if gain else -1
    sd = np.tile([*[widths.shift] * 3, *[widths.turn] * 3, widths.gain], (axes, 1))
    kind = np.tile([0, 0, 0, turns, turns, turns, gains], (axes, 1))
    if widths.base is not None:
        sd[0, :3], kind[0, :3] = widths.base, -1
    zero = np.where(nominal.slides > 0, 2, 5)
    sd[range(axes), zero] = np.where(nominal.slides > 0, widths.slide, widths.zero)
    kind[range(axes), zero] = -1
    tip = widths.shift if widths.tip is None else widths.tip
    return Belief(
        np.concatenate([sd.ravel(), [tip] * 3, [widths.turn] * 3]),
        np.concatenate([kind.ravel(), [0 if widths.tip is None else -1] * 3, [turns] * 3]),
    )


def _check(nominal: Linkage, experience: Experience, joints: tuple[str, ...], coordinates: tuple[int, ...]) -> None:
    count, wanted = len(experience.q), max(8, len(joints) + 2)
    if experience.q.shape[1] != nominal.gain.shape[1] or len(joints) != nominal.gain.shape[1]:
        raise BadInput(
            f"the movements have {experience.q.shape[1]} joints and the robot has {nominal.gain.shape[1]}",
            remedy=f"one column for each of {', '.join(joints)}",
        )
    if experience.x.shape[1] != len(coordinates):
        raise BadInput(f"the tip has {experience.x.shape[1]} coordinates", remedy=f"give {len(coordinates)}")
    if count < wanted:
        raise BadInput(
            f"{count} movements are too few to correct {len(joints)} joints", remedy=f"make {wanted} or more"
        )
    parts = [experience.q, experience.x, *([] if experience.turn is None else [experience.turn.reshape(count, 9)])]
    gaps = ~np.all([np.isfinite(part).all(axis=1) for part in parts], axis=0)
    if gaps.any():
        first = int(np.argmax(gaps)) + 1
        raise BadInput(f"movement {first} is not all finite numbers", remedy="leave such movements out")


def _doubt(seen: Seen, found: Changes) -> str:
    """Why small changes are not the whole story; empty where they are.

    Raises:
        BadInput: they explain next to nothing.
    """
    size = float(np.sqrt(np.median(np.sum((seen.x - np.median(seen.x, axis=0)) ** 2, axis=1))))
    miss = float(np.median(found.miss))
    if miss > _ABSURD * size:
        raise BadInput(
            f"the movements can't be this robot's: corrected as well as can be, it misses them by {1e3 * miss:.0f} mm",
            remedy=f"check that the log is this robot's, in rad and m, seen from its base; or {_FROM_NOTHING}",
        )
    if max(miss, found.sensor[0]) < max(_DOUBTFUL * size, 0.005):
        return ""
    return (
        f"the corrected arm still misses by {1e3 * miss:.0f} mm: unless the tip is seen no better than that, "
        f"the description is wrong in more than zeros and links; {_FROM_NOTHING}"
    )


def _unmoved(experience: Experience, joints: tuple[str, ...]) -> list[str]:
    return [
        f"joint {name} never moved: of its zero and link only their sum was seen"
        for name, low, high in zip(joints, experience.q.min(axis=0), experience.q.max(axis=0), strict=True)
        if high - low < 1e-3
    ]


def _left_out(found: Changes) -> list[str]:
    wild = int(np.sum(~found.keep))
    return [f"{wild} of {len(found.keep)} movements were left out as wild"] if wild else []
