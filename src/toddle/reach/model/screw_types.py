"""What an arm's joints are: which slide, and which encoders turn further, or less, than they say.

A joint that slides is a joint that turns by little about an axis far away. So a fit in which every joint turns and
every gain is free tells the sliding ones by their small turns, and those are then put as what they are.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int

from toddle.reach.model.rigid import PER_AXIS
from toddle.reach.model.screw_arms import Arms, from_lines, lines_of

_SMALL_TURN = 0.35  # [rad] over a joint's whole range: it may as well slide


def free_numbers(axes: int, rows: int, *, gains: bool, turns: bool = False) -> Int[np.ndarray, " free"]:
    """The numbers that a fit may change: axes across themselves, their stretch where asked for, the tip."""
    kinds = [0, 1, 4] if rows == 2 else [0, 1, 3, 4]
    per_axis = PER_AXIS * np.arange(axes)[:, None] + np.array([*kinds, *([6] if gains else [])])
    return np.concatenate(
        [per_axis.ravel(), PER_AXIS * axes + np.arange(rows), PER_AXIS * axes + np.arange(3, 6 if turns else 3)]
    )


def held_numbers(
    arms: Arms, free: Int[np.ndarray, " free"], rows: int, gains: np.ndarray
) -> Bool[np.ndarray, "arms free"]:
    """Which free numbers mean nothing for a candidate's axes, or are gains that it keeps.

    Args:
        arms: the candidates; in the plane, a sliding axis' own y is the plane's normal.
        free: from `free_numbers`.
        rows: how many coordinates the tip has.
        gains: True where an axis' gain may change, for each candidate and axis.
    """
    axes = arms.slides.shape[1]
    axis, kind = np.minimum(free // PER_AXIS, axes - 1), free % PER_AXIS
    slides = arms.slides[:, axis] > 0
    held = (kind < 2) & slides
    if rows == 2:
        held |= (kind == 4) & ~slides
    held |= (kind == 6) & ~np.broadcast_to(gains, arms.slides.shape)[:, axis]
    held[:, free >= PER_AXIS * axes] = False
    return held


def sliding(arms: Arms, which: Bool[np.ndarray, "*arms axes"]) -> Arms:
    """The same arms with some turning axes put as sliding ones, along the way that their tips take."""
    along, through, tip = lines_of(arms)
    ways = arms.gain[..., None] * np.cross(along, tip[:, None] - through)
    lengths = np.maximum(np.linalg.norm(ways, axis=-1), 1e-9)
    changed = which & (arms.slides == 0)
    along = np.where(changed[..., None], ways / lengths[..., None], along)
    through = np.where(changed[..., None], tip[:, None], through)
    slides = np.where(changed, 1.0, arms.slides)
    return from_lines(along, through, slides, tip, arms.motor)._replace(gain=np.where(changed, lengths, arms.gain))


def suspects(arms: Arms, span: Float[np.ndarray, " joints"]) -> Bool[np.ndarray, "arms axes"]:
    """Axes that turn by so little that they may slide."""
    return (arms.slides == 0) & (np.abs(arms.gain) * span[arms.motor] < _SMALL_TURN)


def travel(arms: Arms, span: Float[np.ndarray, " joints"]) -> Float[np.ndarray, "arms axes"]:
    """How far each axis moves the tip over its joint's range, about [m]; infinite for an axis that is not in doubt."""
    along, through, tip = lines_of(arms)
    lever = np.linalg.norm(np.cross(along, tip[:, None] - through), axis=-1)
    moved = np.abs(arms.gain) * span[arms.motor] * np.where(arms.slides > 0, 1.0, lever)
    return np.where(suspects(arms, span) | (arms.slides > 0), moved, np.inf)


def idling(arms: Arms, which: Bool[np.ndarray, "*arms axes"]) -> Arms:
    """The same arms with some axes turning about the tip itself, as far as their encoders say."""
    along, through, tip = lines_of(arms)
    through = np.where(which[..., None], tip[:, None], through)
    idle = from_lines(along, through, np.where(which, 0.0, arms.slides), tip, arms.motor)
    return idle._replace(gain=np.where(which, 1.0, arms.gain))
