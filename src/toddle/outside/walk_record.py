"""A walk as it was recorded, tick by tick: arrays for its figures, its pictures and its trajectory."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from toddle.robots.gait import Gait
from toddle.signals import Reference, Velocity
from toddle.walk.loop import Measured, Moment
from toddle.walk.pattern.plan import Interval
from toddle.walk.pattern.trajectory import Trajectory

_WIDTHS = {  # of one tick's row
    "t": 1, "asked": 3, "allowed": 3, "com": 9, "zmp": 2, "yaw": 3, "feet": 8, "feet_velocity": 8,
    "feet_acceleration": 8, "load": 2, "support": 1, "posture_ms": 1,
}  # fmt: skip
_MEASURED_WIDTHS = {
    "com": 3, "com_velocity": 3, "zmp": 2, "feet": 8, "yaw": 1, "velocity": 3, "force": 2, "margin": 1,
}  # fmt: skip


class MeasuredRecord(NamedTuple):
    """What the robot's sensors told, one row a tick.

    Attributes:
        com: centre of mass [m].
        com_velocity: its velocity [m/s].
        zmp: zero moment point from the ankles' sensors [m].
        feet: left and right sole: x, y, z [m] and yaw [rad].
        yaw: heading [rad].
        velocity: achieved over the last two steps [m/s, m/s, rad/s].
        force: on the left and the right sole [N].
        margin: of the zero moment point inside the polygon of support [m]; negative outside.
    """

    com: Float[np.ndarray, "ticks 3"]
    com_velocity: Float[np.ndarray, "ticks 3"]
    zmp: Float[np.ndarray, "ticks 2"]
    feet: Float[np.ndarray, "ticks 2 4"]
    yaw: Float[np.ndarray, " ticks"]
    velocity: Float[np.ndarray, "ticks 3"]
    force: Float[np.ndarray, "ticks 2"]
    margin: Float[np.ndarray, " ticks"]


class TrueRecord(NamedTuple):
    """What was so in the simulator now and then, for judging only: time [s]; the waist's x, y [m] and yaw [rad]."""

    t: Float[np.ndarray, " looks"]
    waist: Float[np.ndarray, "looks 3"]


class Record(NamedTuple):
    """A walk, one row a tick; the plan's columns are those of `toddle.signals.Reference`.

    Attributes:
        t: time [s].
        asked: velocity asked for [m/s, m/s, rad/s].
        allowed: what the safety gate let through.
        com: centre of mass planned: position, velocity, acceleration.
        zmp: zero moment point planned [m].
        yaw: of the waist, planned: angle, rate, acceleration.
        feet: planned: left and right sole: x, y, z [m] and yaw [rad].
        feet_velocity: their first derivative.
        feet_acceleration: their second derivative.
        load: share of the weight that each foot is to carry.
        support: the foot that carries: -1 both, 0 left, 1 right.
        posture_ms: what the whole-body inverse kinematics took.
        measured: from the sensors; None without a body.
        plan_ms: what each plan of the predictive controller took.
        plan_status: how each ended.
        fell: whether the robot fell.
        true: from the simulator; None without one.
    """

    t: Float[np.ndarray, " ticks"]
    asked: Float[np.ndarray, "ticks 3"]
    allowed: Float[np.ndarray, "ticks 3"]
    com: Float[np.ndarray, "ticks 3 3"]
    zmp: Float[np.ndarray, "ticks 2"]
    yaw: Float[np.ndarray, "ticks 3"]
    feet: Float[np.ndarray, "ticks 2 4"]
    feet_velocity: Float[np.ndarray, "ticks 2 4"]
    feet_acceleration: Float[np.ndarray, "ticks 2 4"]
    load: Float[np.ndarray, "ticks 2"]
    support: Int[np.ndarray, " ticks"]
    posture_ms: Float[np.ndarray, " ticks"]
    measured: MeasuredRecord | None
    plan_ms: Float[np.ndarray, " plans"]
    plan_status: tuple[str, ...]
    fell: bool
    true: TrueRecord | None = None


class Recorder:
    """Collects a walk's moments."""

    def __init__(self) -> None:
        self._rows: list[Float[np.ndarray, " columns"]] = []
        self._measured: list[Float[np.ndarray, " columns"]] = []
        self._plan_ms: list[float] = []
        self._plan_status: list[str] = []
        self._true: list[tuple[float, float, float, float]] = []
        self._fell = False

    def __len__(self) -> int:
        return len(self._rows)

    def add(self, moment: Moment) -> None:
        """One tick more."""
        self.add_plan(
            moment.t, moment.asked, moment.allowed, moment.reference, moment.support, posture_ms=moment.posture_ms
        )
        self._measured.append(_measured_row(moment.measured))
        self._fell = self._fell or moment.fell
        if moment.plan is not None:
            self.add_solve(str(moment.plan.status), moment.plan.milliseconds)

    def add_plan(
        self, t: float, asked: Velocity, allowed: Velocity, plan: Reference, support: int, *, posture_ms: float = np.nan
    ) -> None:
        """One tick of the pattern alone."""
        parts = (plan.com, plan.zmp, plan.yaw, plan.feet, plan.feet_velocity, plan.feet_acceleration, plan.load)
        numbers = (np.array([t, *asked, *allowed]), *(part.ravel() for part in parts), np.array([support, posture_ms]))
        self._rows.append(np.concatenate(numbers))

    def add_solve(self, status: str, ms: float) -> None:
        """One plan of the predictive controller."""
        self._plan_ms.append(float(ms))
        self._plan_status.append(status)

    def add_truth(self, t: float, waist: Float[np.ndarray, "3"]) -> None:
        """Where the waist is."""
        self._true.append((t, *waist.tolist()))

    def record(self) -> Record:
        """All of it so far."""
        columns = _split(self._rows, _WIDTHS)
        count = len(self._rows)
        shapes = {"com": (count, 3, 3), **dict.fromkeys(("feet", "feet_velocity", "feet_acceleration"), (count, 2, 4))}
        columns |= {name: columns[name].reshape(shape) for name, shape in shapes.items()}
        true = np.array(self._true).reshape(-1, 4)
        return Record(
            **{name: columns[name] for name in _WIDTHS if name != "support"},
            support=columns["support"].astype(np.int64),
            measured=self._measured_record(),
            plan_ms=np.array(self._plan_ms, dtype=float),
            plan_status=tuple(self._plan_status),
            fell=self._fell,
            true=TrueRecord(true[:, 0], true[:, 1:]) if self._true else None,
        )

    def _measured_record(self) -> MeasuredRecord | None:
        if not self._measured:
            return None
        columns = _split(self._measured, _MEASURED_WIDTHS)
        columns["feet"] = columns["feet"].reshape(-1, 2, 4)
        return MeasuredRecord(**columns)


def record_of_pattern(pattern: Trajectory, gait: Gait, allowed: Sequence[Velocity]) -> Record:
    """The same record of a walking pattern without a body; ``allowed``: the velocity at each iteration."""
    rows = len(pattern.t)
    counts = [round(interval.duration / gait.command_period) for interval in pattern.intervals]
    ahead = rows - sum(counts)
    command = np.concatenate([np.zeros((ahead, 3)), np.repeat(np.array(allowed).reshape(-1, 3), counts, axis=0)])
    supports = [_support(*part, gait) for part in zip(pattern.intervals, counts, strict=True)]
    return Record(
        pattern.t, command, command, pattern.com[:, :, :3], pattern.zmp, pattern.com[:, :, 3],
        pattern.feet[:, 0], pattern.feet[:, 1], pattern.feet[:, 2], np.full((rows, 2), np.nan),
        np.concatenate([np.full(ahead, -1), *supports]), np.full(rows, np.nan), None,
        np.array([interval.milliseconds for interval in pattern.intervals], dtype=float),
        tuple(str(interval.status) for interval in pattern.intervals), False,
    )  # fmt: skip


def _support(interval: Interval, count: int, gait: Gait) -> Int[np.ndarray, " ticks"]:
    elapsed = interval.elapsed + np.arange(count) * gait.command_period
    single = (elapsed >= gait.double_support - 1e-9) & (interval.landing is not None)
    return np.where(single, interval.support.side, -1)


def standing(
    feet: Float[np.ndarray, "ticks 2 4"], feet_velocity: Float[np.ndarray, "ticks 2 4"]
) -> Bool[np.ndarray, "ticks 2"]:
    """When each foot stands on the floor: it neither is above it nor moves along it."""
    moves = np.abs(feet_velocity[:, :, (0, 1, 3)]).max(axis=2) > 1e-6
    return ~(moves | (feet[:, :, 2] > 1e-6))


def _measured_row(measured: Measured) -> Float[np.ndarray, " columns"]:
    parts = [np.ravel(np.asarray(getattr(measured, name), dtype=float)) for name in _MEASURED_WIDTHS]
    return np.concatenate(parts)


def _split(rows: list[Float[np.ndarray, " columns"]], widths: dict[str, int]) -> dict[str, np.ndarray]:
    """The named columns of rows; those of width one lose their axis."""
    table = np.array(rows).reshape(len(rows), sum(widths.values()))
    ends = np.cumsum(list(widths.values()))
    return {
        name: table[:, end - width] if width == 1 else table[:, end - width : end]
        for (name, width), end in zip(widths.items(), ends, strict=True)
    }
