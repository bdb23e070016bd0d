"""What happened to a rigid arm, and the arm as it is now, from the few movements since.

Every hypothesis of `toddle.reach.model.damage_hypotheses` is fitted to them and judged by its evidence
(`toddle.reach.model.damage_evidence`). A bend may explain whatever a slip explains, with five numbers more; the
determinant in the evidence is what it pays for them. A single wild look among the movements is found by leaving each
out in turn.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from toddle.reach.model.damage_evidence import SeenSince, fitted
from toddle.reach.model.damage_hypotheses import joint_family, link_family, turn_slope
from toddle.reach.model.damage_watch import JUMP, surprises
from toddle.reach.model.rigid import PER_AXIS, Rigid, changed
from toddle.robots.linkage import Linkage
from toddle.signals import Experience

_KEPT = 1e-3  # hypotheses that are less likely than that are forgotten
_FEW = 3  # movements, of which one can be told to be wild
_WILD = 25.0  # log evidence that a wild look must cost: it may be one in a thousand, and anywhere in some cubic metres


@dataclass(frozen=True)
class Repair:
    """What happened, and the arm as it is now.

    Attributes:
        kind: "slip", "lock", "weaken", "bend", "replace", or "nothing".
        joint: the joint that broke, or whose link did, counted from 0 at the base; -1: none.
        amount: the slip [rad or m], where it is locked [rad or m], what remains of its motion, or how far the far end
            of the link (where the next axis has its frame) is from where it was [m].
        sureness: probability of this cause among all that were weighed.
        model: the arm as it is now.
        free: joints that still move; a solver must not use the others.
    """

    kind: str
    joint: int
    amount: float
    sureness: float
    model: Rigid
    free: Bool[np.ndarray, " joints"]


def repair(
    model: Rigid,
    since: Experience,
    lower: Float[np.ndarray, " joints"],
    upper: Float[np.ndarray, " joints"],
    sensor: float,
    *,
    stood: Float[np.ndarray, " joints"] | None = None,
    angle_sensor: float = 0.01,
) -> tuple[Repair, ...]:
    """Causes that explain the movements since the body changed, the likeliest first.

    Args:
        model: the arm as it was learned, before.
        since: the movements made since, as few as one; orientations are used where they were seen.
        lower: lower limits [rad or m].
        upper: upper limits [rad or m].
        sensor: standard deviation of a seen tip about the model on each axis [m].
        stood: where the joints stood just before [rad or m]: that is where a joint locks; None: not known.
        angle_sensor: standard deviation of a seen orientation about each axis [rad].
    """

    def weighed(kept: np.ndarray) -> list[_Cause]:
        some = Experience(since.q[kept], since.x[kept], None if since.turn is None else since.turn[kept])
        return _weighed(model, some, SeenSince.of(model, some, sensor, angle_sensor), (lower, upper, stood))

    kept = np.arange(len(since.q))
    causes = weighed(kept)
    while len(kept) >= _FEW:  # does one wild look stand against all others?
        now = causes[0].make()[0]
        if surprises(now, since.q[kept], since.x[kept], sensor).max() < JUMP:
            break
        trials = [weighed(np.delete(kept, row)) for row in range(len(kept))]
        row = int(np.argmax([trial[0].evidence for trial in trials]))
        if trials[row][0].evidence - causes[0].evidence < _WILD:
            break
        kept, causes = np.delete(kept, row), trials[row]
    weight = np.exp([cause.evidence - causes[0].evidence for cause in causes])
    weight /= weight.sum()
    repairs = []
    for cause, sureness in zip(causes, weight, strict=True):
        if sureness >= _KEPT:
            now, amount = cause.make()
            free = np.array([not (cause.kind == "lock" and j == cause.joint) for j in range(since.q.shape[1])])
            repairs.append(Repair(cause.kind, cause.joint, amount, float(sureness), now, free))
    return tuple(repairs)


def telling_movement(repairs: tuple[Repair, ...], candidates: Float[np.ndarray, "batch joints"], sensor: float) -> int:
    """The candidate posture [rad or m] after which most will be known: about which cause, and how much of it.

    Log determinant of what the seen tip's covariance would be over all causes, by their sureness.
    """
    weight = np.array([each.sureness for each in repairs])
    tips = np.stack([each.model.forward(candidates) for each in repairs])
    middle = np.einsum("c,cbs->bs", weight, tips) / weight.sum()
    apart = tips - middle
    doubt = np.einsum("c,cbs,cbt->bst", weight, apart, apart) / weight.sum()
    for share, each in zip(weight / weight.sum(), repairs, strict=True):
        doubt = doubt + share * each.model.spread(candidates)
    return int(np.argmax(np.linalg.slogdet(doubt + sensor**2 * np.eye(doubt.shape[-1]))[1]))


class _Cause(NamedTuple):
    """A hypothesis, fitted."""

    kind: str
    joint: int
    evidence: float
    make: Callable[[], tuple[Rigid, float]]


def _weighed(
    model: Rigid, since: Experience, seen: SeenSince, joints: tuple[np.ndarray, np.ndarray, np.ndarray | None]
) -> list[_Cause]:
    """Every hypothesis fitted to the movements, the likeliest first."""
    miss = seen.miss(model.pose(since.q)[None])
    causes = [_Cause("nothing", -1, -0.5 * float((miss**2).sum()), lambda: (model, 0.0))]
    joint_of = np.argmax(np.abs(model.linkage.gain), axis=1)
    for family, change in (
        (joint_family(model.linkage, since.q, *joints), _joint_changed),
        (link_family(model.linkage, since.q), _link_changed),
    ):
        numbers, evidence, covariance = fitted(family, seen)
        for case, (kind, axis) in enumerate(zip(family.kinds, family.axes, strict=True)):
            make = partial(change, model, kind, axis, numbers[case], covariance[case])
            joint = axis if change is _joint_changed else int(joint_of[axis])
            causes.append(_Cause(kind, joint, float(evidence[case]), make))
    return sorted(causes, key=lambda cause: -cause.evidence)


def _joint_changed(
    model: Rigid,
    kind: str,
    joint: int,
    numbers: Float[np.ndarray, "2"],
    covariance: Float[np.ndarray, "2 2"],
) -> tuple[Rigid, float]:
    """The arm whose joint goes to numbers[0] + numbers[1] q, and the amount that a person is told."""
    place, share = numbers
    share = 0.0 if kind == "lock" else share
    linkage = model.linkage
    gain = linkage.gain.copy()
    gain[:, joint] *= share
    now = linkage._replace(gain=gain, offset=linkage.offset + linkage.gain[:, joint] * place)
    moves = np.zeros((len(model.covariance), 2))
    for axis, slides in enumerate(linkage.slides):
        moves[PER_AXIS * axis + (2 if slides else 5), 0] = linkage.gain[axis, joint]
        if kind == "weaken" and linkage.gain[axis, joint] != 0:
            moves[PER_AXIS * axis + 6, 1] = 1 / share
    amount = {"slip": place, "lock": place, "weaken": share}[kind]
    return replace(model, linkage=now, covariance=model.covariance + moves @ covariance @ moves.T), float(amount)


def _link_changed(
    model: Rigid,
    kind: str,
    axis: int,
    numbers: Float[np.ndarray, "6"],
    covariance: Float[np.ndarray, "6 6"],
) -> tuple[Rigid, float]:
    """The arm whose link after an axis has its far end moved by a twist, and the amount that a person is told."""
    first = PER_AXIS * (axis + 1)  # the tip's six numbers follow the last axis' seven
    step = np.zeros(len(model.covariance))
    step[first : first + 6] = numbers
    linkage: Linkage = changed(model.linkage, step)
    into = np.zeros((6, 6))
    into[:3, :3] = Rotation.from_rotvec(numbers[3:]).as_matrix().T
    into[3:, 3:] = turn_slope(numbers[None, 3:])[0].T
    doubt = model.covariance.copy()
    doubt[first : first + 6, first : first + 6] += into @ covariance @ into.T
    return replace(model, linkage=linkage, covariance=doubt), float(np.linalg.norm(numbers[:3]))
