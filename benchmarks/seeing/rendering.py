"""How fast rooms are pictured, drawn by OpenGL or cast by rays, how far the two agree, and what it costs a walk.

    python -m benchmarks.seeing.rendering [--rooms 4] [--out benchmarks/results/seeing_rendering.json]

On one core. A pair is the left and the right picture with the depth of the left one; a view is what the ray-caster
gives of one camera: picture, depth, and the thing that each pixel shows. Speeds are of the CPU time of the process, the
best of five rounds in each room, the robot turned further for each picture; least and most over rooms. A walk is ten
seconds straight ahead at 0.1 m/s with pictures ten times a second. Drawn and cast agree at a pixel if the drawn depth
is within the cast ones of the pixel and its eight neighbours, 2 mm to spare.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy import ndimage

from toddle.navigate.scenarios.draw_rooms import room, rooms
from toddle.navigate.scenarios.rooms import SCENARIOS, Room
from toddle.outside.files import write_json
from toddle.outside.machine import machine_in_words
from toddle.outside.simulation.humanoid import HumanoidSimulation
from toddle.outside.simulation.rooms import room_simulation
from toddle.outside.simulation.stereo_cameras import CastCamera, StereoCamera, eye
from toddle.outside.versions import versions
from toddle.robots.humanoids import load_humanoid
from toddle.signals import Velocity
from toddle.walk.loop import walk
from toddle.walk.walker import Walker, walker

SIZES = ((320, 240), (160, 120), (80, 60))
ROUNDS, PICTURES, ROOMS_DRAWN, WALK_S, EVERY = 5, 20, 40, 10.0, 10


def main() -> None:
    parser = argparse.ArgumentParser("python -m benchmarks.seeing.rendering", description=__doc__)
    parser.add_argument("--rooms", type=int, default=4)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/seeing_rendering.json"))
    asked = parser.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    walks = walker(load_humanoid("heicub"))
    chosen = [room(SCENARIOS[number % 6], "validation", number) for number in range(asked.rooms)]
    stages = [(one, room_simulation(walks.humanoid, one)) for one in chosen]
    content: dict[str, Any] = {
        "benchmark": "seeing_rendering",
        "what": "pictures of rooms: how many a second, how far the two ways agree, and what they cost a walk",
        "remark": " ".join((__doc__ or "").split("\n\n")[2].split()),
        "command": f"python -m benchmarks.seeing.rendering --rooms {asked.rooms}",
        "machine": machine_in_words(),
        "versions": versions(),
        "seeds": [f"{one.scenario} {one.split} {one.number}" for one in chosen],
        "speed": {f"{width}x{height}": speeds(stages, width, height) for width, height in SIZES},
        "agreement": {f"{width}x{height}": agreement(stages, width, height) for width, height in SIZES},
        "rooms_drawn_per_second": {name: drawn_per_second(name) for name in SCENARIOS},
        "walk": walked(walks, chosen[0]),
    }
    write_json(asked.out, content)
    print(json.dumps({key: content[key] for key in ("speed", "agreement", "rooms_drawn_per_second", "walk")}, indent=1))


def speeds(stages: list[tuple[Room, HumanoidSimulation]], width: int, height: int) -> dict[str, list[float]]:
    """Pairs and views a second: least and most over rooms."""
    found: dict[str, list[float]] = {"drawn_pairs": [], "cast_pairs": [], "cast_views": []}
    for one, simulation in stages:
        drawn, cast = StereoCamera(simulation, width, height), CastCamera(simulation, one, width, height)
        for name, see in (("drawn_pairs", drawn.see), ("cast_pairs", cast.see), ("cast_views", cast.view)):
            found[name].append(per_second(simulation, see))
        drawn.close()
    return {name: [round(min(rates), 1), round(max(rates), 1)] for name, rates in found.items()}


def per_second(simulation: HumanoidSimulation, see: Callable[[], Any]) -> float:
    """The best of some rounds, each with the robot turned once around."""
    best = math.inf
    for _ in range(ROUNDS):
        spent = 0.0
        for yaw in np.linspace(0.0, 2 * math.pi, PICTURES, endpoint=False):
            turn(simulation, float(yaw))
            start = time.process_time()
            see()
            spent += time.process_time() - start
        best = min(best, spent)
    turn(simulation, 0.0)
    return PICTURES / best


def turn(simulation: HumanoidSimulation, yaw: float) -> None:
    """The robot at home, turned."""
    simulation.data.qpos[3:7] = math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)


def agreement(stages: list[tuple[Room, HumanoidSimulation]], width: int, height: int) -> dict[str, float]:
    """Of drawn and cast pictures, all around."""
    apart, depth, colour = [], [], []
    for one, simulation in stages:
        drawn, cast = StereoCamera(simulation, width, height), CastCamera(simulation, one, width, height)
        for yaw in np.linspace(0.0, 2 * math.pi, 8, endpoint=False):
            turn(simulation, float(yaw))
            seen, view = drawn.see(), cast.view()
            low, high = ndimage.minimum_filter(view.depth, 3), ndimage.maximum_filter(view.depth, 3)
            apart.append(((seen.depth < low - 0.002) | (seen.depth > high + 0.002)).mean())
            depth.append(np.median(np.abs(seen.depth - view.depth)))
            colour.append(np.abs(seen.left.astype(int) - view.picture).mean())
        turn(simulation, 0.0)
        drawn.close()
    return {
        "pixels_apart_share": float(np.mean(apart)),
        "depth_median_m": float(np.median(depth)),
        "colour_mean_of_255": round(float(np.mean(colour)), 2),
    }


def drawn_per_second(scenario: Any) -> float:
    """Rooms of a scenario."""
    start = time.process_time()
    for _ in rooms(scenario, "validation", ROOMS_DRAWN):
        pass
    return round(ROOMS_DRAWN / (time.process_time() - start), 1)


def walked(walks: Walker, one: Room) -> dict[str, Any]:
    """Simulated seconds for each of the CPU's, and how the cameras sway."""
    found: dict[str, Any] = {"times_real_time": {}}
    for name, size in (
        ("bare_floor", None),
        ("room", None),
        ("cast 80x60", 80),
        ("drawn 80x60", 80),
        ("drawn 320x240", 320),
    ):
        simulation = (
            HumanoidSimulation(walks.humanoid) if name == "bare_floor" else room_simulation(walks.humanoid, one)
        )
        camera = None
        if size is not None:
            shape = size, size * 3 // 4
            camera = CastCamera(simulation, one, *shape) if "cast" in name else StereoCamera(simulation, *shape)
        see = None if camera is None else camera.view if isinstance(camera, CastCamera) else camera.see
        best, poses = math.inf, []
        for _ in range(2):
            start, poses = time.process_time(), []
            for tick, _moment in enumerate(walk(walks, simulation, lambda t: Velocity(0.1, 0.0, 0.0), WALK_S)):
                if see is not None and tick % EVERY == 0:
                    see()
                    poses.append(angles(simulation))
            best = min(best, time.process_time() - start)
        found["times_real_time"][name] = round(WALK_S / best, 1)
        if poses:
            pitch, roll, height = np.array(poses[len(poses) // 4 :]).T
            found["pitch_deg"], found["roll_deg"] = spread(pitch), spread(roll)
            found["camera_height_m"] = spread(height)
        if camera is not None:
            camera.close()
    return found


def angles(simulation: HumanoidSimulation) -> tuple[float, float, float]:
    """How far the left camera looks down and leans [degrees], and its height [m]."""
    place = eye(simulation)
    down, lean = -math.asin(place.axes[2, 2]), math.asin(place.axes[2, 0])
    return math.degrees(down), math.degrees(lean), float(place.position[2])


def spread(values: np.ndarray) -> dict[str, float]:
    """Mean and standard deviation."""
    return {"mean": round(float(values.mean()), 4), "std": round(float(values.std()), 4)}


if __name__ == "__main__":
    main()
