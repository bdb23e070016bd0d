"""What a correction changed, joint by joint, in the terms of the person who owns the arm.

From tip positions alone some changes can't be told from others: a zero that is off carries along everything beyond the
joint, just as a link does that sits across by the same amount. With zeros held to be far less certain than links, what
zeros can explain is put down to zeros. So the numbers are reported as unlimited movements without noise would settle
them, ``P numbers`` with ``P = (F'F + I)^-1 F'F``, ``F`` the slope over the workspace in units of the belief's widths;
``diag P`` is the share of each number that shows at all, and ``P C P'`` its uncertainty. Gains, which nothing else
imitates, are reported as they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from toddle.reach.model.corrected_fit import Changes, Seen, residuals
from toddle.reach.model.corrected_search import Start
from toddle.reach.model.rigid import PER_AXIS
from toddle.robots.linkage import Linkage

_SHARP = 5e-3  # [m or rad] with 300 postures: apart is what moves the tip by 0.3 mm
_POSTURES = 300


@dataclass(frozen=True)
class Change:
    """What was changed at one axis, or at the tip; uncertainties are standard deviations.

    Attributes:
        joint: the joint that moves the axis; "tip" for the tip in the last link.
        slides: the axis slides.
        zero: what is to be added to the joint's reading [rad, or m for a sliding joint].
        zero_sd: its uncertainty.
        seen: the share of an error of the zero that can show at all: 0 where the tip lies on the axis.
        shift: how far the axis sits from where it was described, in its own frame [m].
        shift_sd: uncertainty of each coordinate [m].
        tilt: by how much the axis is tilted [rad].
        tilt_sd: its uncertainty [rad].
        gain: what its motion is multiplied with.
        gain_sd: its uncertainty.
        flipped: it moves the other way than described.
    """

    joint: str
    slides: bool
    zero: float
    zero_sd: float
    seen: float
    shift: Float[np.ndarray, "3"]
    shift_sd: Float[np.ndarray, "3"]
    tilt: float
    tilt_sd: float
    gain: float
    gain_sd: float
    flipped: bool


def changes_of(
    seen: Seen, found: Changes, start: Start, joints: tuple[str, ...], *, seed: int = 0
) -> tuple[Change, ...]:
    """The changes, axis by axis, the tip last; see `Change`."""
    shown = _shown(seen, found, seed)
    numbers, covariance = shown @ found.numbers, shown @ found.covariance @ shown.T
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    share = np.diag(shown)
    changes = []
    for axis, slides in enumerate(seen.nominal.slides > 0):
        name, gain = _mover(seen.nominal, axis)
        at = PER_AXIS * axis
        zero = at + (2 if slides else 5)
        shift = numbers[at : at + 3] * ([1, 1, 0] if slides else [1, 1, 1])
        tilted = slice(at + 3, at + (6 if slides else 5))
        changes.append(
            Change(
                joint=joints[name],
                slides=bool(slides),
                zero=float(numbers[zero] / gain + start.zero[name]),
                zero_sd=float(_honest(sd, share, found, zero) / abs(gain)),
                seen=float(np.clip(share[zero], 0.0, 1.0)),
                shift=shift,
                shift_sd=sd[at : at + 3],
                tilt=float(np.linalg.norm(numbers[tilted])),
                tilt_sd=float(np.linalg.norm(sd[tilted])),
                gain=float(1 + found.numbers[at + 6]),
                gain_sd=float(np.sqrt(found.covariance[at + 6, at + 6])),
                flipped=bool(start.flipped[name]),
            )
        )
    return (*changes, _tip_change(numbers, sd))


def report(changes: tuple[Change, ...]) -> tuple[str, ...]:
    """One line for each change, for a person to read."""
    return tuple(_line(change) for change in changes)


def _line(change: Change) -> str:
    parts = []
    if change.flipped:
        parts.append("moves the other way")
    if change.joint != "tip":
        unit, scale = ("mm", 1e3) if change.slides else ("deg", 180 / np.pi)
        off = f"zero off by {scale * change.zero:+.2f} ± {scale * change.zero_sd:.2f} {unit}"
        parts.append(off if change.seen > 0.5 else "zero not seen (the tip lies on its axis, or close to it)")
    x, y, z = 1e3 * change.shift
    size, doubt = 1e3 * np.linalg.norm(change.shift), 1e3 * np.linalg.norm(change.shift_sd)
    parts.append(f"shifted by {size:.1f} ± {doubt:.1f} mm ({x:+.1f} {y:+.1f} {z:+.1f})")
    if change.tilt > 2 * change.tilt_sd and change.tilt > 1e-3:
        parts.append(f"tilted by {np.degrees(change.tilt):.2f} ± {np.degrees(change.tilt_sd):.2f} deg")
    if abs(change.gain - 1) > 2 * change.gain_sd and abs(change.gain - 1) > 1e-3:
        parts.append(f"moves {change.gain:.4f} ± {change.gain_sd:.4f} of what it is told")
    return f"{change.joint}: {', '.join(parts)}"


def _shown(seen: Seen, found: Changes, seed: int) -> Float[np.ndarray, "numbers numbers"]:
    """What unlimited movements would report for a unit of each number."""
    low, high = seen.q.min(axis=0), seen.q.max(axis=0)
    q = np.random.default_rng(seed).uniform(low, high, (_POSTURES, len(low)))
    turn = None if seen.turn is None else np.tile(np.eye(3), (len(q), 1, 1))
    everywhere = seen._replace(q=q, x=np.zeros((len(q), len(seen.coordinates))), turn=turn)
    sd = found.belief.sd
    flat = residuals(everywhere, found.numbers)[1].reshape(-1, len(sd)) * sd / _SHARP
    square = flat.T @ flat
    shown = sd[:, None] * np.linalg.solve(square + np.eye(len(sd)), square)
    return np.divide(shown, sd, out=np.zeros_like(shown), where=sd > 0)


def _honest(sd: Float[np.ndarray, " numbers"], share: Float[np.ndarray, " numbers"], found: Changes, at: int) -> float:
    """A number that hardly shows is as uncertain as it was believed to be."""
    return float(sd[at]) if share[at] > 0.5 else float(found.belief.sd[at])


def _mover(linkage: Linkage, axis: int) -> tuple[int, float]:
    """The joint that moves an axis most, and with which gain."""
    joint = int(np.argmax(np.abs(linkage.gain[axis])))
    return joint, float(linkage.gain[axis, joint])


def _tip_change(numbers: Float[np.ndarray, " numbers"], sd: Float[np.ndarray, " numbers"]) -> Change:
    return Change(
        joint="tip",
        slides=False,
        zero=0.0,
        zero_sd=0.0,
        seen=0.0,
        shift=numbers[-6:-3],
        shift_sd=sd[-6:-3],
        tilt=float(np.linalg.norm(numbers[-3:])),
        tilt_sd=float(np.linalg.norm(sd[-3:])),
        gain=1.0,
        gain_sd=0.0,
        flipped=False,
    )
