"""Movements that no arm can be learned from are refused, with what would help."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from toddle.failures import BadInput
from toddle.reach.model.screw_start import lack_of_fit
from toddle.signals import Experience

_SPARE = 1.5  # as many observed coordinates for each unknown number, at least
_RECOMMENDED = 4.5  # movements for each unknown number


def checked(experience: Experience, joints: tuple[str, ...]) -> tuple[Experience, Bool[np.ndarray, " movements"]]:
    """The movements without gaps, and which of all these are.

    Raises:
        BadInput: they don't belong together, or an arm can't be learned from them.
    """
    q, x, turn = experience.q, experience.x, experience.turn
    if not joints or q.ndim != 2 or q.shape[1] != len(joints):
        columns = q.shape[1] if q.ndim == 2 else 0
        raise BadInput(
            f"there are {len(joints)} joints and {columns} columns of joint values",
            where="movements",
            remedy="give one column for each joint, in the order of the chain",
        )
    if x.ndim != 2 or x.shape[1] not in (2, 3) or len(x) != len(q) or (turn is not None and len(turn) != len(q)):
        raise BadInput(
            f"{len(q)} rows of joint values, and tips of the shape {x.shape}",
            where="movements",
            remedy="give x, y (and z) of the tip for each movement",
        )
    whole = np.asarray(np.isfinite(q).all(axis=1) & np.isfinite(x).all(axis=1))
    if turn is not None:
        whole = whole & np.isfinite(turn).all(axis=(1, 2))
    good = Experience(
        q[whole].astype(float), x[whole].astype(float), None if turn is None else turn[whole].astype(float)
    )
    _refuse_few(good, joints, len(q))
    _refuse_still(good, joints)
    return good, whole


def _refuse_few(good: Experience, joints: tuple[str, ...], made: int) -> None:
    rows = good.x.shape[1]
    unknown = 2 * len(joints) + 2 if rows == 2 else 4 * len(joints) + 3
    least = int(np.ceil(_SPARE * unknown / rows))
    if len(good.q) < least:
        gaps = f" ({made - len(good.q)} of {made} have gaps)" if made > len(good.q) else ""
        raise BadInput(
            f"{len(good.q)} movements{gaps} are too few for {len(joints)} joints, whose {unknown} numbers "
            f"need at least {least}",
            where="movements",
            remedy=f"make {least} or more; {int(np.ceil(_RECOMMENDED * unknown))} make it as exact as one look",
        )


def _refuse_still(good: Experience, joints: tuple[str, ...]) -> None:
    span = np.ptp(good.q, axis=0)
    for name, width in zip(joints, span, strict=True):
        if width < 1e-6:
            raise BadInput(
                f"joint {name!r} never moves", where="movements", remedy="vary it, or leave it out of the joints"
            )
    _refuse_together(good.q, joints)
    if np.ptp(good.x, axis=0).max() < 1e-9:
        raise BadInput(
            "the tip never moves", where="movements", remedy="check what is observed, and that the arm is switched on"
        )


def _refuse_together(q: Float[np.ndarray, "movements joints"], joints: tuple[str, ...]) -> None:
    related = np.corrcoef(q.T) if len(joints) > 1 else np.eye(1)
    first, second = np.nonzero(np.triu(np.abs(related) > 1 - 1e-7, 1))
    remedy = "move each without the others, too"
    if len(first):
        raise BadInput(
            f"joints {joints[first[0]]!r} and {joints[second[0]]!r} always move together",
            where="movements",
            remedy=remedy,
        )
    values, vectors = np.linalg.eigh(np.atleast_2d(related))
    if values[0] < 1e-9:
        tied = [repr(joints[i]) for i in np.flatnonzero(np.abs(vectors[:, 0]) > 1e-3)]
        raise BadInput(f"joints {', '.join(tied)} always move together", where="movements", remedy=remedy)


def refuse_unmoved(good: Experience, miss: Float[np.ndarray, " movements"], rng: np.random.Generator) -> None:
    """Refuse tips that the joints have nothing to do with, once no arm explains them.

    Raises:
        BadInput: the joints don't foretell the tip at all.
    """
    away = good.x - np.median(good.x, axis=0)
    unexplained = np.median(miss) > 0.5 * np.median(np.linalg.norm(away, axis=1))
    if unexplained and lack_of_fit((good.x - good.x.mean(axis=0)).T, good.q, rng) < 3:
        raise BadInput(
            "the tip doesn't follow the joints: where it was seen has nothing to do with their values",
            where="movements",
            remedy="check that the rows of joint values and of tips belong together",
        )
