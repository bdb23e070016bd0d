"""One walk in physics, watched by a judge that knows the truth, and the figures of it.

The walker sees what its sensors tell. Falls, velocities, slip, clearances and saturated servos are the simulator's.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from toddle.outside.simulation.disturbances import WorldOptions
from toddle.outside.simulation.humanoid import HumanoidSimulation, Truth
from toddle.outside.walk_figures import mean_velocity, window
from toddle.outside.walk_record import Record, Recorder
from toddle.outside.walk_run import warm_up
from toddle.robots.humanoid import Humanoid
from toddle.robots.humanoids import load_humanoid
from toddle.signals import Circle, Velocity
from toddle.walk.config import WalkConfig
from toddle.walk.loop import CommandSource, Moment, Walks, walk
from toddle.walk.walker import Walker, walker

LOOK = 7
"""Ticks between two looks at the truth; they meet all phases of a step of 60 ticks."""

Watcher = Callable[[Moment, HumanoidSimulation], bool]
"""Sees every tick, may push, and says whether it has seen enough."""


class Seen(NamedTuple):
    """What a judge saw of a walk.

    Attributes:
        record: tick by tick.
        fell: the waist is low or lies over.
        last: the truth at the end.
        cpu: processor time of walker and physics [s].
        saturation: share of servos that gave all they have, mean.
        slip: of the stance sole from the begin to the end of each single support [mm].
        clearance: least one of feet, legs, body to an obstacle [m], at most 1.
        touched: whether feet, legs, body touched one.
        enough: the watcher had seen enough.
    """

    record: Record
    fell: bool
    last: Truth
    cpu: float
    saturation: float
    slip: list[float]
    clearance: np.ndarray
    touched: np.ndarray
    enough: bool


@lru_cache(maxsize=4)
def humanoid_named(name: str) -> Humanoid:
    """The humanoid, read once a process; everything was called once, so that no compiler is measured."""
    humanoid = load_humanoid(name)
    warm_up(walker(humanoid), HumanoidSimulation(humanoid))
    return humanoid


@lru_cache(maxsize=1)
def simulation_of(name: str, world: WorldOptions) -> HumanoidSimulation:
    """Its simulation; walks in the same world after another use the same."""
    return HumanoidSimulation(humanoid_named(name), world)


@lru_cache(maxsize=32)
def walker_of(name: str, config: WalkConfig, fastest: Velocity | None = None) -> Walker:
    """Its walker; ``fastest`` lets the gate through more, or less, than the robot's gait does."""
    humanoid = humanoid_named(name)
    if fastest is not None:
        humanoid = replace(humanoid, gait=replace(humanoid.gait, fastest=fastest))
    return walker(humanoid, config)


def stroll(
    walks: Walks[Any],
    simulation: HumanoidSimulation,
    commands: CommandSource,
    seconds: float,
    *,
    circles: tuple[Circle, ...] = (),
    limited: bool = True,
    watcher: Watcher | None = None,
) -> Seen:
    """Walk and watch; cut after ``seconds``, or when the robot has fallen, or when the watcher has seen enough."""
    recorder, cpu, fell, enough = Recorder(), 0.0, False, False
    saturation: list[float] = []
    slip: list[float] = []
    clearance, stood, support = np.ones(3), np.zeros(2), -1
    truth = simulation.truth()
    began = time.process_time()
    for number, moment in enumerate(walk(walks, simulation, commands, seconds, circles, limited=limited)):
        cpu += time.process_time() - began
        recorder.add(moment)
        if number % LOOK == 0 or moment.support != support or moment.fell:
            truth = simulation.truth()
            recorder.add_truth(moment.t, truth.waist)
            saturation.append(truth.saturation)
            clearance = np.minimum(clearance, truth.clearance)
            fell = truth.fallen or moment.fell
        if moment.support != support:
            if support >= 0:
                slip.append(1e3 * float(np.hypot(*(truth.soles[support, :2] - stood))))
            support = moment.support
            stood = truth.soles[support, :2] if support >= 0 else stood
        enough = watcher is not None and watcher(moment, simulation)
        if fell or enough:
            break
        began = time.process_time()
    mean = float(np.mean(saturation)) if saturation else 0.0
    last, touched = simulation.truth(), simulation.touched.copy()
    fell = fell or last.fallen
    return Seen(recorder.record(), fell, last, cpu, mean, slip, clearance, touched, enough)


def figures(seen: Seen, walks: Walks[Any]) -> dict[str, Any]:
    """What a walk is judged by; None is what it can't tell."""
    record, gait = seen.record, walks.gait
    seconds = float(record.t[-1]) if len(record.t) else 0.0
    error = 100 * zmp_error(record)
    found: dict[str, Any] = {
        "fell": seen.fell,
        "seconds": round(seconds, 2),
        "zmp_error_mean_cm": _rounded(error.mean() if len(error) else None),
        "zmp_error_std_cm": _rounded(error.std() if len(error) else None),
        "saturation_percent": _rounded(100 * seen.saturation),
        "slip_mm": {"mean": _rounded(np.mean(seen.slip)), "most": _rounded(max(seen.slip))} if seen.slip else None,
        "real_time_factor": _rounded(seconds / seen.cpu if seen.cpu > 0 else None, 1),
        "nmpc_ms_median": _rounded(np.median(record.plan_ms) if len(record.plan_ms) else None, 4),
        "posture_ms_median": _rounded(np.nanmedian(record.posture_ms) if len(record.t) else None, 4),
        "fallbacks": sum(status != "solved" for status in record.plan_status),
        "plans": len(record.plan_status),
    }
    within = None if seen.fell else window(record, gait, seconds)
    if within is None or record.true is None or record.measured is None:
        return found
    asked, t = record.allowed[within][-1], record.t[within]
    looks = (record.true.t >= t[0]) & (record.true.t <= t[-1])
    true = mean_velocity(record.true.t[looks], record.true.waist[looks], 2 * gait.step_time)
    measured = np.nan_to_num(record.measured.velocity[within]).mean(axis=0)
    return found | {
        "asked": _listed(asked),
        "true_velocity": _listed(true),
        "measured_velocity": _listed(measured),
        "true_error_percent": errors(true, asked),
        "measured_error_percent": errors(measured, asked),
    }


def errors(achieved: np.ndarray, asked: np.ndarray) -> list[float | None]:
    """Of velocity (both axes together) and of yaw rate, each in percent of what was asked; None where nothing was."""
    speed, turn = float(np.hypot(*asked[:2])), abs(float(asked[2]))
    off = achieved - asked
    return [
        _rounded(100 * float(np.hypot(*off[:2])) / speed if speed > 0 else None, 2),
        _rounded(100 * abs(float(off[2])) / turn if turn > 0 else None, 2),
    ]


def zmp_error(record: Record) -> np.ndarray:
    """Distance of the plan at each tick to what the sensors told one tick later [m]: only then it has acted."""
    if record.measured is None or len(record.t) < 2:
        return np.empty(0)
    distance = np.hypot(*(record.measured.zmp[1:] - record.zmp[:-1]).T)
    return distance[np.isfinite(distance)]


def steady(velocity: Sequence[float]) -> CommandSource:
    """Always the same."""
    asked = Velocity(*velocity)
    return lambda t: asked


def _rounded(value: Any, digits: int = 3) -> float | None:
    return None if value is None else round(float(value), digits)


def _listed(numbers: np.ndarray) -> list[float]:
    return [round(float(number), 4) for number in numbers]
