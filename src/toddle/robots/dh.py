"""Arms by their Denavit-Hartenberg table, and the two arms of Martin, de Lope, Santos 2009 (tables 1 and 2).

The standard convention: link i's frame follows from link i-1's by a turn theta about z, a shift d along z, a
shift a along the new x and a turn alpha about it; the joint moves theta or d.

The document gives lengths without a unit. Here one of its units is one centimetre.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import jax.numpy as jnp
import numpy as np

from toddle.failures import BadInput
from toddle.robots.chain import Chain
from toddle.robots.frames import Transform, transform, z_motion

UNIT = 0.01  # [m] for one unit of the document


@dataclass(frozen=True)
class Row:
    """One row of a Denavit-Hartenberg table.

    Attributes:
        theta: turn about z [rad]; where the joint moves theta, what is added to its value.
        d: shift along z [m]; where the joint moves d, what is added to its value.
        a: shift along the new x [m].
        alpha: turn about the new x [rad].
        joint: the joint's name.
        moves: which of theta and d the joint moves.
        limits: the joint's lower and upper limit [rad or m].
        home: where it starts [rad or m].
    """

    joint: str
    theta: float = 0.0
    d: float = 0.0
    a: float = 0.0
    alpha: float = 0.0
    moves: Literal["theta", "d"] = "theta"
    limits: tuple[float, float] = (-math.pi / 2, math.pi / 2)
    home: float = 0.0


def from_table(name: str, rows: Sequence[Row], *, coordinates: tuple[int, ...] = (0, 1, 2)) -> Chain:
    """The chain of a Denavit-Hartenberg table.

    Args:
        name: the robot's name.
        rows: one for each joint, base first.
        coordinates: which of x, y, z the tip's position is reported in.

    Raises:
        BadInput: there is no row, a number is not finite, or limits and home do not fit.
    """
    if not rows:
        raise BadInput("the table has no row", where=name, remedy="give one row a joint")
    for row in rows:
        values = (row.theta, row.d, row.a, row.alpha, *row.limits, row.home)
        (lower, upper), where = row.limits, f"{name}: joint {row.joint!r}"
        if not np.all(np.isfinite(values)):
            raise BadInput("its row is not finite", where=where, remedy="give numbers")
        if not lower < upper or not lower <= row.home <= upper:
            raise BadInput(
                f"its limits {lower:g}, {upper:g} do not rise, or its home {row.home:g} lies outside",
                where=where,
                remedy="give a lower and an upper limit with the home between them",
            )
    before, rigid = [], np.eye(4)
    for row in rows:
        # Both motions are along or about the same z, so the constant one may come first.
        before.append(rigid @ z_motion(row.theta, slides=False) @ z_motion(row.d, slides=True))
        rigid = _link(row)
    limits = np.array([row.limits for row in rows], dtype=np.float32)
    return Chain(
        name=name,
        joints=tuple(row.joint for row in rows),
        lower=jnp.asarray(limits[:, 0]),
        upper=jnp.asarray(limits[:, 1]),
        home=jnp.asarray([row.home for row in rows], jnp.float32),
        before=jnp.asarray(np.array(before, dtype=np.float32)),
        slides=jnp.asarray([float(row.moves == "d") for row in rows], jnp.float32),
        gain=jnp.eye(len(rows), dtype=jnp.float32),
        offset=jnp.zeros(len(rows), jnp.float32),
        tip=jnp.asarray(rigid.astype(np.float32)),
        coordinates=coordinates,
    )


def _link(row: Row) -> Transform:
    """What follows the joint: the shift a along x, then the turn alpha about it."""
    c, s = math.cos(row.alpha), math.sin(row.alpha)
    return transform(np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]), np.array([row.a, 0.0, 0.0]))


def planar3() -> Chain:
    """The three-link planar arm of Martin 2009, table 1: 8.625, 8.625 and 6.125 units; two coordinates.

    The limits of plus or minus a quarter turn and the bent home are ours: the document gives none.
    """
    lengths = (8.625, 8.625, 6.125)
    rows = [Row(f"theta_{i}", a=a * UNIT, home=0.1 * math.pi) for i, a in enumerate(lengths, start=1)]
    return from_table("planar3", rows, coordinates=(0, 1))


def scara() -> Chain:
    """The SCARA arm of Martin 2009, table 2: two links of 20 units, a wrist that turns, and a sliding hand.

    The limits are ours: a quarter turn either way, and 0 to 20 units for the slide.
    """
    rows = [
        Row("theta_1", a=20 * UNIT, home=0.1 * math.pi),
        Row("theta_2", a=20 * UNIT, alpha=math.pi, home=0.2 * math.pi),
        Row("theta_3"),
        Row("d_4", moves="d", limits=(0.0, 20 * UNIT), home=10 * UNIT),
    ]
    return from_table("scara", rows)
