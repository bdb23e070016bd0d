"""Random fields of tall cylinders: walked straight at them by a stubborn command, and guided around them."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.walking.campaign import Case, Part, Row
from benchmarks.walking.fields import GOAL, field
from benchmarks.walking.physics import Seen, simulation_of, steady, stroll, walker_of
from benchmarks.walking.walks import ROBOT
from toddle.outside.simulation.disturbances import WorldOptions
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.signals import Circle
from toddle.walk.config import WalkConfig
from toddle.walk.guide import guide
from toddle.walk.loop import Moment

SPEED, SECONDS = 0.2, 60.0
PARTS_TOUCHED = ("feet", "legs", "body")
_PAST = 0.3  # behind the last cylinder [m]
_ASK_EACH = 10  # ticks; the guide is asked so often


def fields_of(quick: bool) -> list[Case]:
    seconds, seeds = (10.0, 1) if quick else (SECONDS, 50)
    return [{"name": f"field {seed}", "seed": seed, "seconds": seconds} for seed in range(seeds)]


def run_stubborn(case: Case) -> Row:
    """0.2 m/s straight ahead, whatever stands there, until the last cylinder is passed."""
    circles = field(case["seed"])
    end = max(circle.x + circle.radius for circle in circles) + _PAST
    walks, simulation = walker_of(ROBOT, WalkConfig()), simulation_of(ROBOT, WorldOptions(circles=circles))

    def past(moment: Moment, simulation: HumanoidSimulation) -> bool:
        return float(simulation.data.qpos[0]) > end

    commands = steady((SPEED, 0.0, 0.0))
    seen = stroll(walks, simulation, commands, case["seconds"], circles=circles, watcher=past)
    return judged(seen, circles) | {"past": bool(seen.last.q[0] > end), "x": round(float(seen.last.q[0]), 2)}


def run_guided(case: Case) -> Row:
    """To the goal behind the field, by the guide on the true place; the walker knows the cylinders too."""
    circles = field(case["seed"])
    walks, simulation = walker_of(ROBOT, WalkConfig()), simulation_of(ROBOT, WorldOptions(circles=circles))
    guided = guide(circles, GOAL, speed=SPEED, fastest_turn=walks.gait.fastest.omega)
    ticks, asked = 0, guided(np.zeros(3))

    def commands(t: float) -> Any:
        nonlocal ticks, asked
        if ticks % _ASK_EACH == 0 and asked is not None:
            asked = guided(simulation.truth().waist)
        ticks += 1
        return asked

    seen = stroll(walks, simulation, commands, case["seconds"], circles=circles)
    off = float(np.hypot(*(seen.last.waist[:2] - GOAL)))
    return judged(seen, circles) | {"reached": asked is None and not seen.fell, "to_goal_m": round(off, 2)}


def judged(seen: Seen, circles: tuple[Circle, ...]) -> Row:
    return {
        "fell": seen.fell,
        "seconds": round(float(seen.record.t[-1]), 2),
        "cylinders": len(circles),
        "touched": [name for name, touched in zip(PARTS_TOUCHED, seen.touched, strict=True) if touched],
        "clearance_cm": {
            name: round(100 * float(least), 2) for name, least in zip(PARTS_TOUCHED, seen.clearance, strict=True)
        },
        "fallbacks": sum(status != "solved" for status in seen.record.plan_status),
    }


def summary(rows: dict[str, Row]) -> dict[str, Any]:
    """Falls, contacts, the least clearances, and how many got through."""
    through = next((name for name in ("past", "reached") if name in next(iter(rows.values()))), "past")
    return {
        "fields": len(rows),
        "fell": [name for name, row in rows.items() if row["fell"]],
        "touched": {name: row["touched"] for name, row in rows.items() if row["touched"]},
        "least_clearance_cm": {part: min(row["clearance_cm"][part] for row in rows.values()) for part in PARTS_TOUCHED},
        through: sum(row[through] for row in rows.values()),
        f"not_{through}": [name for name, row in rows.items() if not row[through]],
    }


PARTS = (
    Part("obstacles_stubborn", "50 random fields, 0.2 m/s straight at them", fields_of, run_stubborn, summary,
         ("fell", "touched", "past", "clearance_cm")),
    Part("obstacles_guided", "50 random fields, guided to a goal behind them at 0.2 m/s, within 60 s", fields_of,
         run_guided, summary, ("fell", "touched", "reached", "seconds")),
)  # fmt: skip
