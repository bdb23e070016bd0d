"""``toddle navigate evaluate`` in rooms: anybody drives through the six scenarios, in physics, and is judged."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from toddle.cli.navigate_folder import left_folder

if TYPE_CHECKING:
    from toddle.cli.navigate_evaluate import Evaluate
    from toddle.outside.navigation.physics_batch import Recipe
    from toddle.outside.navigation.room_batch import Drive

_INTERRUPTED = 130


def judge_in_rooms(asked: Evaluate) -> int:
    """Drive, judge, leave figures and pictures, and return the exit code."""
    from toddle.cli.navigate_evaluate import tell, world_of
    from toddle.navigate.scenarios.rooms import SCENARIOS
    from toddle.outside.navigation.room_batch import Judged, keys, run_rooms
    from toddle.outside.navigation.room_eyes import EyeOptions
    from toddle.outside.navigation.room_judging import figures_of
    from toddle.outside.terminal import Reporter, stoppable

    recipe, sees = _driver(asked)
    rooms = keys(asked.episodes, asked.scenario or SCENARIOS, asked.split, asked.style)
    eyes = EyeOptions(asked.eyes) if sees else None
    how = Judged(recipe, eyes, world=world_of(asked), seed=asked.seed, kept=1)
    with (
        left_folder(asked.out, "evaluate") as folder,
        stoppable() as stop,
        Reporter(f"{recipe.robot} in rooms, drives", len(rooms), quiet=asked.json) as reporter,
    ):
        done: list[str] = []

        def told(_: int, drive: Drive) -> None:
            done.append(drive.finish.outcome.name)
            reporter.tell(len(done), f"{done.count('WON')} of {len(done)} reached")

        found = run_rooms(how, rooms, processes=asked.jobs, progress=told, stopped=lambda: stop.asked)
        drives = [drive for drive in found if drive is not None]
        if not drives:
            return _INTERRUPTED
        figures = {
            "env": "rooms", "robot": recipe.robot, "driver": asked.driver,
            "policy": None if asked.policy is None else str(asked.policy), "split": asked.split, "style": asked.style,
            "eyes": asked.eyes if sees else None, "seed": asked.seed,
            **figures_of([drive.finish for drive in drives]),
        }  # fmt: skip
        _leave(folder, figures, drives, f"{recipe.robot}, {asked.policy or asked.driver}")
    if not asked.json:
        _tell_scenarios(figures)
    tell(figures, folder, as_json=asked.json)
    return _INTERRUPTED if stop.asked else 0


def _driver(asked: Evaluate) -> tuple[Recipe, bool]:
    """Who steers, and whether by what the robot sees; made once here, so that what can't be made is refused at once.

    Raises:
        BadInput: the robot, the policy or the script is of no use.
    """
    from toddle.cli.navigate_evaluate import made
    from toddle.outside.navigation.physics_batch import Recipe
    from toddle.outside.navigation.policy_files import load_policy
    from toddle.outside.navigation.room_policies import is_cloned
    from toddle.robots.humanoids import load_humanoid

    if asked.policy is None or not is_cloned(asked.policy):
        _, recipe = made(asked, None if asked.policy is None else load_policy(asked.policy))
        return recipe, False
    from toddle.outside.navigation.cloned import cloned

    recipe = Recipe(cloned, (asked.policy,), asked.robot or "heicub", asked.config)
    _ = cloned(load_humanoid(recipe.robot, recipe.config), asked.policy)
    return recipe, True


def _tell_scenarios(figures: dict[str, Any]) -> None:
    """A line for each scenario."""
    from toddle.navigate.scenarios.rooms import SCENARIOS
    from toddle.outside.terminal import print_table

    head = ("", "reached", "95 %", "SPL", "collisions", "falls", "late", "time [s]", "ZMP error [cm]")
    rows = []
    for name in SCENARIOS:
        if name in figures:
            one = figures[name]
            won = round(one["success_rate"] * one["episodes"])
            between = f"{100 * one['wilson_low']:.1f} to {100 * one['wilson_high']:.1f} %"
            counts = [str(one[what]) for what in ("collisions", "falls", "late")]
            means = [f"{one['seconds_mean']:.1f}", f"{one['zmp_error_mean_cm']:.2f}"]
            rows.append((name, f"{won} of {one['episodes']}", between, f"{one['spl']:.2f}", *counts, *means))
    print_table("rooms", head, rows)


def _leave(folder: Path, figures: dict[str, Any], drives: list[Drive], title: str) -> None:
    from toddle.navigate.scenarios.draw_rooms import room
    from toddle.outside.dataset.strip import film_strip
    from toddle.outside.files import write_json
    from toddle.outside.navigation.room_pictures import room_paths

    finishes = [drive.finish for drive in drives]
    write_json(folder / "figures.json", figures)
    targets = []
    for finish in finishes:
        key = finish.room
        target = room(key.scenario, key.split, key.number, key.style).target
        targets.append((target.x, target.y))
    rows = [
        {
            "scenario": one.room.scenario, "room": one.room.number, "outcome": one.outcome.name.lower(),
            "touched": one.touched, "seconds": one.seconds, "spl": one.spl, "clearance": one.clearance,
        }
        for one in finishes
    ]  # fmt: skip
    write_json(folder / "drives.json", {"drives": rows})
    room_paths(folder / "paths.png", finishes, targets, title=title)
    for drive in drives:
        if drive.recording is not None and len(drive.recording.t):
            film_strip(folder / f"{drive.finish.room.scenario}.png", drive.recording, title)
