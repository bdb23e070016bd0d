"""Pushes at the chest: the largest impulse survived, standing and in four phases of the step; and terms switched off.

A push lasts 0.1 s. Directions are from straight ahead, turning left; the left foot carries, so 90 degrees is outwards.
Survived: not fallen 3 s later. The largest impulse is found by bisection on a grid, as if whoever survives a push
survived every weaker one too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from benchmarks.walking.campaign import Case, Part, Row
from benchmarks.walking.physics import Watcher, figures, simulation_of, steady, stroll, walker_of
from benchmarks.walking.walks import ROBOT
from toddle.outside.simulation.disturbances import WorldOptions
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.robots.gait import Gait
from toddle.robots.humanoid import RIGHT
from toddle.walk.config import TICK, WalkConfig
from toddle.walk.loop import Moment

GRID = (2, 4, 6, 8, 10, 12)
"""Impulses [N s]; the last one is the cap."""

DIRECTIONS = tuple(range(0, 360, 45))
PHASES = (0.1, 0.35, 0.6, 0.85)
SPEEDS = (0.1, 0.25)
SETTLED, WATCHED = 5.0, 3.0  # before and after the push [s]
SCREEN, SCREEN_PHASES = 8, (0.1, 0.6)
OTHER_TERMS: dict[str, dict[str, float]] = {"zmp_feedback": {"zmp_gain": 0.0}, "sag_integral": {"offset_most": 0.0}}
"""Terms of the balance station that have a gain and no switch."""


def largest(survives: Callable[[int], bool], grid: Sequence[int]) -> int:
    """The largest of an ascending grid that is survived, by bisection; 0: not even the first."""
    low, high = 0, len(grid)
    while low < high:
        middle = (low + high) // 2
        if survives(grid[middle]):
            low = middle + 1
        else:
            high = middle
    return grid[low - 1] if low else 0


def pushing(impulse: float, direction: float, phase: float | None, gait: Gait) -> Watcher:
    """Pushes once, in a phase of the left foot's step (None: at 1 s), and watches for `WATCHED`.

    Args:
        impulse: [N s].
        direction: [degrees].
        phase: share of the step that is over when the push begins.
        gait: how long a step takes.
    """
    last, end = -1, math.inf

    def watch(moment: Moment, simulation: HumanoidSimulation) -> bool:
        nonlocal last, end
        landed = moment.t >= SETTLED and last == RIGHT and moment.support != RIGHT
        last = moment.support
        if end == math.inf and (landed or phase is None):
            start = 1.0 if phase is None else moment.t - TICK + phase * gait.step_time
            simulation.push(impulse, math.radians(direction), start=start)
            end = start + WATCHED
        return moment.t >= end

    return watch


def survives(
    speed: float, phase: float | None, direction: float, impulse: float, config: WalkConfig | None = None
) -> bool:
    """Whether the robot still stands after a push."""
    walks, simulation = walker_of(ROBOT, config or WalkConfig()), simulation_of(ROBOT, WorldOptions())
    watcher = pushing(impulse, direction, phase, walks.gait)
    seconds = SETTLED + 4 * walks.gait.step_time + WATCHED
    seen = stroll(walks, simulation, steady((speed, 0.0, 0.0)), seconds, watcher=watcher)
    if not (seen.fell or seen.enough):
        raise RuntimeError(f"at {speed:g} m/s the left foot never landed: nothing was pushed")
    return not seen.fell


def cells(quick: bool) -> list[Case]:
    phased = [(speed, phase) for speed in SPEEDS for phase in PHASES]
    stances = phased[1:2] if quick else [(0.0, None), *phased]
    return [
        {"name": f"{stance_in_words(speed, phase)}, {direction} deg"}
        | {"speed": speed, "phase": phase, "direction": direction}
        for speed, phase in stances
        for direction in (DIRECTIONS[2:3] if quick else DIRECTIONS)
    ]


def stance_in_words(speed: float, phase: float | None) -> str:
    return "standing" if phase is None else f"{speed:g} m/s, phase {phase:g}"


def run_cell(case: Case) -> Row:
    tried: dict[int, bool] = {}

    def trial(impulse: int) -> bool:
        tried[impulse] = survives(case["speed"], case["phase"], case["direction"], impulse)
        return tried[impulse]

    return {"largest": largest(trial, GRID), "tried": tried}


def cells_summary(rows: dict[str, Row]) -> dict[str, Any]:
    """By speed: the least and the mean of what every cell survived [N s], the share of at least 8, and the map."""
    found: dict[str, Any] = {}
    for speed in ("standing", *(f"{speed:g} m/s" for speed in SPEEDS)):
        values = {name: row["largest"] for name, row in rows.items() if name.startswith(speed)}
        if values:
            numbers = np.array(list(values.values()))
            found[speed] = {
                "cells": len(numbers),
                "least": int(numbers.min()),
                "mean": round(float(numbers.mean()), 2),
                "share_of_at_least_6": round(float((numbers >= 6).mean()), 3),
                "share_of_at_least_8": round(float((numbers >= 8).mean()), 3),
                "share_of_at_least_10": round(float((numbers >= 10).mean()), 3),
                "weak": {name: int(value) for name, value in values.items() if value < 8},
            }
    return found


def terms() -> dict[str, dict[str, Any]]:
    """What each switched-off term changes in the configuration; the first one changes nothing."""
    config = WalkConfig()
    switches = {item.name: {item.name: False} for item in fields(config) if getattr(config, item.name) is True}
    return {"all on": {}, **switches, **OTHER_TERMS}


def ablations(quick: bool) -> list[Case]:
    named = dict(list(terms().items())[:2]) if quick else terms()
    phases, directions = (SCREEN_PHASES[:1], DIRECTIONS[:1]) if quick else (SCREEN_PHASES, DIRECTIONS)
    seconds = 12.0 if quick else 60.0
    cases: list[Case] = []
    for term, changed in named.items():
        off = {"term": term, "changed": changed}
        cases.append({"name": f"{term}: walk", **off, "seconds": seconds})
        cases += [
            {"name": f"{term}: push, phase {phase:g}, {direction} deg", **off, "phase": phase, "direction": direction}
            for phase in phases
            for direction in directions
        ]
    return cases


def run_ablation(case: Case) -> Row:
    """A walk at 0.25 m/s, or a push of 8 N s at 0.1 m/s."""
    config = WalkConfig(**case["changed"])
    if "seconds" in case:
        walks = walker_of(ROBOT, config)
        commands = steady((0.25, 0.0, 0.0))
        return figures(stroll(walks, simulation_of(ROBOT, WorldOptions()), commands, case["seconds"]), walks)
    return {"fell": not survives(SPEEDS[0], case["phase"], case["direction"], SCREEN, config)}


def ablation_summary(rows: dict[str, Row]) -> dict[str, Any]:
    """By term: pushes survived, and the walk."""
    table: dict[str, Any] = {}
    for name, row in rows.items():
        term, what = name.split(": ", 1)
        line = table.setdefault(term, {"pushes": 0, "survived": 0})
        if what == "walk":
            kept = ("fell", "seconds", "true_velocity", "true_error_percent", "zmp_error_mean_cm", "slip_mm")
            line["walk"] = {key: row.get(key) for key in kept}
        else:
            line["pushes"] += 1
            line["survived"] += not row["fell"]
    return table


PARTS = (
    Part("pushes", f"largest push of {GRID} N.s survived: chest, 0.1 s, 8 directions, standing and four phases",
         cells, run_cell, cells_summary, ("largest",)),
    Part("ablation", "terms of the balance station off: pushes of 8 N.s at 0.1 m/s, and a walk at 0.25 m/s",
         ablations, run_ablation, ablation_summary, ("fell",)),
)  # fmt: skip
