"""What a walk is judged by: how far, how true to its command, how near the planned zero moment point, how fast."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from toddle.outside.walk_record import Record, TrueRecord
from toddle.robots.gait import Gait

STEADY = 40.0
"""Errors of velocity are those of the last so many seconds of a command that doesn't change [s]."""

SETTLING = 5.0
"""The beginning that doesn't count for them [s]."""

_SHORTEST = 2.0  # of a stretch that says anything [s]
_SOLVED = "solved"


def figures_of(record: Record, gait: Gait, *, until: float, wall: float) -> dict[str, Any]:
    """The figures of a walk; None is what it can't tell.

    Args:
        record: the walk.
        gait: how it steps.
        until: when its command ended [s]; what follows is the stop.
        wall: what it took on the clock, without pictures [s].
    """
    seconds = float(record.t[-1]) if len(record.t) else 0.0
    speed, turning = velocity_errors(record, gait, until)
    true_speed, true_turning = true_errors(record, gait, until)
    distance = zmp_distance(record)
    plans = Counter(record.plan_status)
    return {
        "seconds": round(seconds, 6),
        "fell": record.fell,
        "distance_m": distance_walked(record, gait),
        "velocity_error_percent": speed,
        "yaw_rate_error_percent": turning,
        "true_velocity_error_percent": true_speed,
        "true_yaw_rate_error_percent": true_turning,
        "zmp_error_mean_cm": _stat(np.mean, 100 * distance),
        "zmp_error_std_cm": _stat(np.std, 100 * distance),
        "nmpc_ms_median": _stat(np.median, record.plan_ms),
        "nmpc_ms_p99": _stat(lambda ms: np.percentile(ms, 99), record.plan_ms),
        "posture_ms_median": _stat(np.median, record.posture_ms),
        "real_time_factor": seconds / wall if wall > 0 else None,
        "fallbacks": sum(count for status, count in plans.items() if status != _SOLVED),
        "plans": dict(plans),
    }


def window(record: Record, gait: Gait, until: float) -> Bool[np.ndarray, " ticks"] | None:
    """The ticks in which the command was steady, settling left out; None where there are too few.

    The command is what the safety gate let through.
    """
    began = max(SETTLING, until - STEADY)
    within = (record.t >= began) & (record.t < until)
    allowed = record.allowed[within]
    if until - began < max(_SHORTEST, 2.1 * gait.step_time) or not within.any() or np.ptp(allowed, axis=0).max() > 1e-9:
        return None
    return within


def velocity_errors(record: Record, gait: Gait, until: float) -> tuple[float | None, float | None]:
    """Of the mean measured velocity and yaw rate against the command [percent of the command].

    A pattern without a body is measured by its own centre of mass.
    """
    within = window(record, gait, until)
    if within is None:
        return None, None
    if record.measured is not None:
        achieved = np.nan_to_num(record.measured.velocity[within]).mean(axis=0)
    else:
        place = np.column_stack([record.com[within, 0, :2], record.yaw[within, 0]])
        achieved = mean_velocity(record.t[within], place, 2 * gait.step_time)
    return _against(achieved, record.allowed[within][-1])


def true_errors(record: Record, gait: Gait, until: float) -> tuple[float | None, float | None]:
    """The same by where the simulator's waist really went."""
    within = window(record, gait, until)
    if within is None or record.true is None:
        return None, None
    times = record.t[within]
    seen = TrueRecord(*(values[(record.true.t >= times[0]) & (record.true.t <= times[-1])] for values in record.true))
    if len(seen.t) < 2 or seen.t[-1] - seen.t[0] < 2 * gait.step_time:
        return None, None
    return _against(mean_velocity(seen.t, seen.waist, 2 * gait.step_time), record.allowed[within][-1])


def zmp_distance(record: Record) -> Float[np.ndarray, " ticks"]:
    """Between the planned and the measured zero moment point [m], where the sensors tell one."""
    if record.measured is None:
        return np.empty(0)
    distance = np.linalg.norm(record.measured.zmp - record.zmp, axis=1)
    return distance[np.isfinite(distance)]


def distance_walked(record: Record, gait: Gait) -> float:
    """Along the way, without the sway [m]."""
    if len(record.t) < 2:
        return 0.0
    if record.measured is not None:
        speed = np.hypot(*np.nan_to_num(record.measured.velocity[1:, :2]).T)
        return float(np.sum(speed * np.diff(record.t)))
    each = max(round(2 * gait.step_time / (record.t[1] - record.t[0])), 1)
    return float(np.sum(np.hypot(*np.diff(record.com[::each, 0, :2], axis=0).T)))


def mean_velocity(
    t: Float[np.ndarray, " looks"], place: Float[np.ndarray, "looks 3"], stride: float
) -> Float[np.ndarray, "3"]:
    """Of x, y, yaw over time, in the frame of the body [m/s, m/s, rad/s], without the sway of its steps.

    The heading is the mean yaw over a stride of two steps [s]. As many whole strides as there are count, weighted by a
    Hann window where they are two or more: what sways averages out though strides are not all alike.
    """
    strides = int((t[-1] - t[0]) / stride + 1e-6)
    t = t[t <= t[0] + strides * stride + 1e-6]
    place = place[: len(t)]
    yaw, middle = np.unwrap(place[:, 2]), (t[1:] + t[:-1]) / 2
    grown = np.concatenate([[0.0], np.cumsum((yaw[1:] + yaw[:-1]) / 2 * np.diff(t))])
    low, high = np.maximum(middle - stride / 2, t[0]), np.minimum(middle + stride / 2, t[-1])
    heading = (np.interp(high, t, grown) - np.interp(low, t, grown)) / (high - low)
    dx, dy = np.diff(place[:, :2], axis=0).T / np.diff(t)
    ahead = np.cos(heading) * dx + np.sin(heading) * dy
    aside = np.cos(heading) * dy - np.sin(heading) * dx
    weight = np.diff(t)
    if strides > 1:
        weight = weight * np.sin(np.pi * (middle - t[0]) / (t[-1] - t[0])) ** 2
    rates = np.stack([ahead, aside, np.diff(yaw) / np.diff(t)])
    return rates @ weight / weight.sum()


def _against(achieved: Float[np.ndarray, "3"], asked: Float[np.ndarray, "3"]) -> tuple[float | None, float | None]:
    speed, turning = float(np.hypot(*asked[:2])), abs(float(asked[2]))
    off = float(np.hypot(*(achieved - asked)[:2]))
    return (
        100 * off / speed if speed > 0 else None,
        100 * abs(float(achieved[2] - asked[2])) / turning if turning > 0 else None,
    )


def _stat(of: Any, values: Float[np.ndarray, " values"]) -> float | None:
    known = values[np.isfinite(values)]
    return float(of(known)) if len(known) else None
