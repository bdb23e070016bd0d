"""What a fit found out about an arm, in sentences."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool

from toddle.reach.model.rigid import PER_AXIS
from toddle.reach.model.screw_final import Final
from toddle.reach.model.screw_steps import Seen, look


def notes_of(
    final: Final, joints: tuple[str, ...], fits: bool, seen: Seen, whole: Bool[np.ndarray, " movements"]
) -> tuple[str, ...]:
    """A sentence for each thing that was found.

    Args:
        final: the fit.
        joints: their names.
        fits: whether the structure explains the movements.
        seen: the movements that were used.
        whole: those of all that have no gap.
    """
    motor, slides, gain = final.arms.motor[0], final.arms.slides[0], final.arms.gain[0]
    notes = [f"joint {joints[motor[axis]]} slides" for axis in np.flatnonzero(slides)]
    drives = np.bincount(motor, minlength=len(joints))
    notes += [f"motor {joints[joint]} drives {_count(int(drives[joint]))} axes" for joint in np.flatnonzero(drives > 1)]
    for axis in np.flatnonzero(final.gains & (drives[motor] == 1)):
        does = "slides" if slides[axis] else "turns"
        notes.append(f"encoder of {joints[motor[axis]]} {does} {abs(gain[axis]):.3g} times as far as it says")
    notes += [f"joint {joints[joint]} doesn't move the tip as far as was seen" for joint in _idle(final, seen)]
    if final.wild.any():
        notes.append(f"{final.wild.sum()} of {len(whole)} movements were seen wrongly and left out")
    if not whole.all():
        rows = np.flatnonzero(~whole)
        shown = ", ".join(map(str, rows[:5])) + (", ..." if len(rows) > 5 else "")
        notes.append(f"{len(rows)} of {len(whole)} movements have gaps and were left out (rows {shown})")
    if not fits:
        notes.append("no rigid chain that was tried explains the movements: this is the best of them")
    return tuple(notes)


def _count(axes: int) -> str:
    return {2: "two", 3: "three"}.get(axes, str(axes))


def _idle(final: Final, seen: Seen) -> list[int]:
    """Joints whose motion changes the seen tip by less than can be told."""
    axes = final.arms.slides.shape[1]
    slope = look(final.arms, seen, PER_AXIS * np.arange(axes) + 5).slope[0]
    moved = np.sqrt((slope**2).sum(axis=(1, 2)))
    floor = 5 * final.sigma + 1e-8 * seen.x.std() * np.sqrt(len(seen.q))
    still = (moved < floor) & (final.arms.slides[0] == 0)
    return [joint for joint in range(seen.q.shape[1]) if np.all(still[final.arms.motor[0] == joint])]
