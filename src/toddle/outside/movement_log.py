"""Recorded movements from a file: joint columns by name, the tip's position, and its orientation where it was seen.

A CSV (with a header) or a Parquet file, one movement a row: ``x``, ``y``, ``z`` [m] (no ``z``: an arm in the plane), a
quaternion ``qw``, ``qx``, ``qy``, ``qz`` where there is one (each of them also with ``tip_`` before it), and the
joints by their names [rad or m]. Columns of time or count are left out. Rows with gaps are dropped, and that is told.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from jaxtyping import Float

from toddle.failures import BadInput, unknown_name
from toddle.signals import Experience

_POSITION = ("x", "y", "z")
_QUATERNION = ("qw", "qx", "qy", "qz")
_NO_JOINT = {"", "t", "time", "stamp", "timestamp", "frame", "frame_index", "index", "step", "movement", "row"}
_LARGEST = 2**30  # bytes
_UNIT = 1e-3  # by which a quaternion's length may differ from one


@dataclass(frozen=True)
class MovementLog:
    """What a file of movements holds.

    Attributes:
        joints: names of the joints, in the order of the columns of ``experience.q``.
        experience: the movements.
        notes: what a person should know of how it was read.
    """

    joints: tuple[str, ...]
    experience: Experience
    notes: tuple[str, ...] = ()


def read_movements(path: str | os.PathLike[str], joints: Sequence[str] | None = None) -> MovementLog:
    """Read recorded movements.

    Args:
        path: of a .csv or .parquet file.
        joints: names of the robot's joints, base first; None: every column that is nothing else is a joint.

    Raises:
        BadInput: it can't be read, a column is missing or isn't numbers, no row is complete, or an orientation is
            no unit quaternion.
    """
    table, where = _table(Path(path)), str(path)
    columns = {_plain(name): name for name in table.column_names}
    if len(columns) < len(table.column_names):
        raise BadInput("two columns have the same name", where=where, remedy="name each column once")
    position = [name for name in _POSITION if name in columns]
    if position not in (["x", "y"], ["x", "y", "z"]):
        raise BadInput(
            f"its columns are {', '.join(table.column_names)}: the tip's position is missing",
            where=where,
            remedy="name its columns x, y, z [m]",
        )
    turned = [name for name in _QUATERNION if name in columns]
    if turned and len(turned) < 4:
        raise BadInput(f"of the quaternion it has only {', '.join(turned)}", where=where, remedy="give qw, qx, qy, qz")
    names = _joints(columns, joints, where)
    wanted = [*(columns[_plain(name)] for name in (*names, *position, *turned))]
    values = np.stack([_numbers(table, column, where) for column in wanted], axis=1)
    whole = np.asarray(np.isfinite(values).all(axis=1))
    notes = []
    if not whole.any():
        raise BadInput("no row is complete", where=where, remedy="record every joint and the tip in each movement")
    if not whole.all():
        rows = np.flatnonzero(~whole) + 1
        shown = ", ".join(map(str, rows[:5])) + (", ..." if len(rows) > 5 else "")
        notes.append(f"{len(rows)} of {len(whole)} rows have gaps and are left out (row {shown})")
    q, x, quaternion = np.split(values[whole], [len(names), len(names) + len(position)], axis=1)
    turn = _turns(quaternion, np.flatnonzero(whole) + 1, where) if turned else None
    return MovementLog(names, Experience(q, x, turn), tuple(notes))


def _plain(name: str) -> str:
    """A column's name without what people write around it."""
    name = name.strip()
    bare = name.removeprefix("tip_")
    return bare if bare in (*_POSITION, *_QUATERNION) else name


def _joints(columns: dict[str, str], joints: Sequence[str] | None, where: str) -> tuple[str, ...]:
    taken = {*_POSITION, *_QUATERNION}
    found = tuple(name for name in columns if name not in taken and name.lower() not in _NO_JOINT)
    if joints is None:
        if not found:
            raise BadInput("it has no column of a joint", where=where, remedy="give each joint a column by its name")
        return found
    for joint in joints:
        if joint not in columns:
            if not set(joints) & set(found):
                raise BadInput(
                    f"its joints are {', '.join(found) or 'none'}, the robot's are {', '.join(joints)}",
                    where=where,
                    remedy="take the log of this robot, or name the columns like its joints",
                )
            raise unknown_name("column", joint, found, where=where)
    return tuple(joints)


def _table(path: Path) -> pa.Table:
    where = str(path)
    if not path.is_file():
        raise BadInput("there is no such file", where=where, remedy="give a .csv or .parquet file of movements")
    if path.stat().st_size > _LARGEST:
        raise BadInput("it is larger than any log of movements", where=where, remedy="cut it")
    try:
        if path.suffix.lower() == ".parquet":
            return pyarrow.parquet.read_table(path)
        if path.suffix.lower() == ".csv":
            return pyarrow.csv.read_csv(path)
    except (pa.ArrowException, OSError, UnicodeDecodeError) as fault:
        what = str(fault).splitlines()[0] if str(fault) else type(fault).__name__
        raise BadInput(f"it can't be read ({what})", where=where, remedy="one movement a row, with a header") from fault
    raise BadInput(f"it ends with {path.suffix!r}", where=where, remedy="give a .csv or .parquet file")


def _numbers(table: pa.Table, column: str, where: str) -> Float[np.ndarray, " rows"]:
    """A column as floats; what is missing is NaN."""
    try:
        return np.asarray(table.column(column).cast(pa.float64()).to_numpy(), float)
    except (pa.ArrowException, TypeError, ValueError) as fault:
        raise BadInput(f"column {column!r} isn't numbers", where=where, remedy="leave a gap empty") from fault


def _turns(
    quaternion: Float[np.ndarray, "movements 4"], rows: np.ndarray, where: str
) -> Float[np.ndarray, "movements 3 3"]:
    """Rotations of unit quaternions (w, x, y, z)."""
    length = np.linalg.norm(quaternion, axis=1)
    if np.abs(length - 1).max() > _UNIT:
        worst = int(np.argmax(np.abs(length - 1)))
        raise BadInput(
            f"the quaternion of row {rows[worst]} has length {length[worst]:.3g}",
            where=where,
            remedy="give unit quaternions qw, qx, qy, qz",
        )
    w, x, y, z = (quaternion / length[:, None]).T
    rows_of = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows_of).transpose(2, 0, 1)
