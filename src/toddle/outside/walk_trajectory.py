"""A walk's trajectory as a table in a Parquet file: one row a tick, the plan's columns and the measured ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from toddle.outside.files import write_bytes
from toddle.outside.walk_record import Record

_AXES = ("x", "y", "z", "yaw")
_SIDES = ("left", "right")
_MEASURED = "_measured"


def columns_of(record: Record) -> dict[str, np.ndarray]:
    """The table's columns by name [s, m, rad, m/s, ...].

    First those of the plan, as a pattern without a body has them: t, com_x, ..., com_x_velocity, ...,
    com_x_acceleration, ..., zmp_x, zmp_y, left_x, ..., right_yaw. Then the command, and the foot that carries. Then
    what the sensors told, with the suffix _measured.
    """
    table: dict[str, np.ndarray] = {"t": record.t}
    for order, suffix in enumerate(("", "_velocity", "_acceleration")):
        table |= {f"com_{axis}{suffix}": record.com[:, order, i] for i, axis in enumerate("xyz")}
        table[f"com_yaw{suffix}"] = record.yaw[:, order]
    table |= {f"zmp_{axis}": record.zmp[:, i] for i, axis in enumerate("xy")}
    table |= _feet(record.feet)
    for name, velocity in (("asked", record.asked), ("command", record.allowed)):
        table |= {f"{name}_{axis}": velocity[:, i] for i, axis in enumerate(("vx", "vy", "omega"))}
    table["support"] = record.support
    return table | _measured(record)


def write_trajectory(path: Path, record: Record) -> None:
    """Write the table, whole or not at all."""
    sink = pa.BufferOutputStream()
    table = pa.table({name: np.ascontiguousarray(values) for name, values in columns_of(record).items()})
    pq.write_table(table, sink, compression="zstd")
    write_bytes(path, sink.getvalue().to_pybytes())


def _measured(record: Record) -> dict[str, np.ndarray]:
    seen = record.measured
    if seen is None:
        return {}
    table = {f"com_{axis}": seen.com[:, i] for i, axis in enumerate("xyz")} | {"com_yaw": seen.yaw}
    table |= {f"com_{axis}_velocity": seen.com_velocity[:, i] for i, axis in enumerate("xyz")}
    table |= {f"zmp_{axis}": seen.zmp[:, i] for i, axis in enumerate("xy")} | _feet(seen.feet)
    table |= {axis: seen.velocity[:, i] for i, axis in enumerate(("vx", "vy", "omega"))}
    table |= {f"{side}_force": seen.force[:, i] for i, side in enumerate(_SIDES)} | {"zmp_margin": seen.margin}
    return {name + _MEASURED: values for name, values in table.items()}


def _feet(feet: np.ndarray) -> dict[str, np.ndarray]:
    return {f"{side}_{axis}": feet[:, number, i] for number, side in enumerate(_SIDES) for i, axis in enumerate(_AXES)}
