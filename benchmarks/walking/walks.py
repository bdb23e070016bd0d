"""Walks without a fall: steady commands, random commands, bad sensors, other humanoids, bumps."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.walking.campaign import Case, Part, Row
from benchmarks.walking.physics import figures, humanoid_named, simulation_of, steady, stroll, walker_of
from toddle.failures import ToddleError
from toddle.outside.simulation.disturbances import Noise, WorldOptions
from toddle.signals import Velocity
from toddle.walk.config import WalkConfig
from toddle.walk.loop import CommandSource
from toddle.walk.scenarios import Leg, velocity_at

ROBOT = "heicub"
STEADY = {
    "straight 0.1": (0.1, 0.0, 0.0),
    "straight 0.25": (0.25, 0.0, 0.0),
    "straight 0.3": (0.3, 0.0, 0.0),
    "straight 0.35 (stretch)": (0.35, 0.0, 0.0),
    "straight 0.4 (stretch)": (0.4, 0.0, 0.0),
    "curve": (0.15, 0.0, 0.1),
    "turn in place": (0.0, 0.0, 0.3),
    "sideways, left": (0.0, 0.1, 0.0),
    "sideways, right": (0.0, -0.1, 0.0),
    "backward": (-0.1, 0.0, 0.0),
    "diagonal": (0.1, 0.05, 0.0),
    "combined": (0.15, 0.05, 0.2),
}
STOP_AND_GO = "stop and go"
HUMANOIDS = ("talos", "g1", "romeo", "icub")
PERIOD, ALONE, STILL_SHARE = 2.0, 0.5, 0.1
"""Random commands: a new one so often [s]; share that moves along one axis only; share that stands."""


def walks(quick: bool) -> list[Case]:
    seconds = 12.0 if quick else 60.0
    named = dict(list(STEADY.items())[5:7]) if quick else STEADY
    cases: list[Case] = [{"name": name, "command": command, "seconds": seconds} for name, command in named.items()]
    return [*cases, {"name": STOP_AND_GO, "command": None, "seconds": seconds}]


def run_walk(case: Case) -> Row:
    """A steady command, or 0.15 m/s for five seconds, standing for five, and again."""
    fastest = humanoid_named(ROBOT).gait.fastest
    if case["command"] is None:
        legs = tuple(Leg(5.0 * half, Velocity(0.0 if half % 2 else 0.15, 0.0, 0.0)) for half in range(12))
        return strolled(case, lambda t: velocity_at(legs, t))
    if all(abs(asked) <= most for asked, most in zip(case["command"], fastest, strict=True)):
        return strolled(case, steady(case["command"]))
    further = Velocity(*np.maximum(np.abs(case["command"]), fastest).tolist())
    row = strolled(case, steady(case["command"]), fastest=further)
    return row | {"note": f"beyond what the gate lets through as a rule, {list(fastest)}"}


def strolled(
    case: Case,
    commands: CommandSource,
    world: WorldOptions | None = None,
    *,
    limited: bool = True,
    robot: str = ROBOT,
    fastest: Velocity | None = None,
) -> Row:
    walks, simulation = walker_of(robot, WalkConfig(), fastest), simulation_of(robot, world or WorldOptions())
    return figures(stroll(walks, simulation, commands, case["seconds"], limited=limited), walks)


def random_walks(quick: bool) -> list[Case]:
    seconds, seeds = (12.0, 1) if quick else (300.0, 10)
    return [{"name": f"seed {seed}", "seed": seed, "seconds": seconds} for seed in range(seeds)]


def random_commands(seed: int, seconds: float, fastest: Velocity) -> tuple[Leg, ...]:
    """Over the whole allowed range: half of them along one axis, a tenth to stand, the others all at once."""
    rng = np.random.default_rng([seed, 23])
    legs = []
    for k in range(int(np.ceil(seconds / PERIOD))):
        drawn = rng.uniform(-1.0, 1.0, 3) * np.array(fastest)
        kind, axis = rng.random(), rng.integers(3)
        if kind < ALONE:
            drawn = np.where(np.arange(3) == axis, drawn, 0.0)
        elif kind < ALONE + STILL_SHARE:
            drawn = np.zeros(3)
        legs.append(Leg(k * PERIOD, Velocity(*drawn.tolist())))
    return tuple(legs)


def run_random(case: Case, *, limited: bool = True) -> Row:
    legs = random_commands(case["seed"], case["seconds"], humanoid_named(ROBOT).gait.fastest)
    return strolled(case, lambda t: velocity_at(legs, t), limited=limited)


def run_random_unlimited(case: Case) -> Row:
    return run_random(case, limited=False)


def sensors(quick: bool) -> list[Case]:
    seconds, seeds = (12.0, 1) if quick else (60.0, 20)
    return [{"name": f"seed {seed}", "seed": seed, "seconds": seconds} for seed in range(seeds)]


def bad_world(seed: int) -> WorldOptions:
    """Noise, delay, lag, friction, a tilted floor and wrong masses, all at once."""
    rng = np.random.default_rng([seed, 29])
    return WorldOptions(
        friction=float(rng.uniform(0.4, 1.0)),
        tilt_deg=2.0,
        downhill_deg=float(rng.uniform(-180.0, 180.0)),
        mass_error=0.1,
        lag_s=0.02,
        delay_s=0.01,
        noise=Noise(),
        seed=seed,
    )


def run_sensors(case: Case) -> Row:
    world = bad_world(case["seed"])
    row = strolled(case, steady((0.15, 0.0, 0.1)), world)
    return row | {"friction": round(world.friction, 3), "downhill_deg": round(world.downhill_deg, 1)}


def humanoids(quick: bool) -> list[Case]:
    seconds, named = (6.0, HUMANOIDS[1:2]) if quick else (20.0, HUMANOIDS)
    return [
        {"name": f"{robot} {speed:g}", "robot": robot, "command": (speed, 0.0, 0.0), "seconds": seconds}
        for robot in named
        for speed in (0.1, 0.3)
    ]


def run_humanoid(case: Case) -> Row:
    """One that can't be used says why."""
    try:
        return strolled(case, steady(case["command"]), robot=case["robot"])
    except ToddleError as fault:
        return {"fell": None, "refused": fault.line}


def bumps(quick: bool) -> list[Case]:
    seconds, seeds = (8.0, 1) if quick else (60.0, 10)
    return [{"name": f"seed {seed}", "seed": seed, "seconds": seconds} for seed in range(seeds)]


def run_bumps(case: Case) -> Row:
    """150 blocks of 0.12 m within 2.3 m, a seventh of the floor; a circle of 1 m radius over them."""
    return strolled(case, steady((0.1, 0.0, 0.1)), WorldOptions(bumps=150, bump_reach=2.3, seed=case["seed"]))


def summary(rows: dict[str, Row]) -> dict[str, Any]:
    """Falls, and the worst figures of those that walked."""
    walked = [row for row in rows.values() if row["fell"] is False]

    def most(name: str, *part: int) -> float | None:
        values = [row.get(name) for row in walked]
        numbers = [value[part[0]] if part and value is not None else value for value in values]
        return max((number for number in numbers if number is not None), default=None)

    rates = [row["real_time_factor"] for row in walked]
    return {
        "cases": len(rows),
        "fell": [name for name, row in rows.items() if row["fell"]],
        "refused": [name for name, row in rows.items() if row["fell"] is None],
        "true_velocity_error_percent_most": most("true_error_percent", 0),
        "true_yaw_rate_error_percent_most": most("true_error_percent", 1),
        "measured_velocity_error_percent_most": most("measured_error_percent", 0),
        "measured_yaw_rate_error_percent_most": most("measured_error_percent", 1),
        "zmp_error_mean_cm_most": most("zmp_error_mean_cm"),
        "real_time_factor_median": float(np.median(rates)) if rates else None,
    }


_TOLD = ("fell", "seconds", "true_error_percent", "zmp_error_mean_cm", "real_time_factor")

PARTS = (
    Part("walks", "steady commands and stop and go, 60 s each", walks, run_walk, summary, _TOLD),
    Part("random", "300 s of random commands, a new one each 2 s; the gate limits their change", random_walks,
         run_random, summary, _TOLD),
    Part("random_unlimited", "the same, and commands may jump", random_walks, run_random_unlimited, summary, _TOLD),
    Part("sensors", "noise, 10 ms delay, 20 ms lag, friction 0.4 to 1, floor tilted by 2 degrees, masses within 10 %",
         sensors, run_sensors, summary, _TOLD),
    Part("humanoids", "robots of other makers, 20 s each", humanoids, run_humanoid, summary, _TOLD),
    Part("bumps", "blocks of 5 mm on the floor (stretch)", bumps, run_bumps, summary, _TOLD),
)  # fmt: skip
