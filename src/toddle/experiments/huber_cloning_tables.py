"""What a network that learned to drive by watching came to, beside the document's figures: rows, verdict, pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from toddle.experiments.experiment import Row
from toddle.navigate.scenarios.rooms import SCENARIOS
from toddle.outside.navigation.cloning_files import load_run
from toddle.outside.navigation.room_judging import command_entropy
from toddle.outside.navigation.room_run import RoomFinish

PRINTED_KL = 0.20, 0.01
"""Divergence of the velocity ahead and of the turning one, printed."""
PRINTED_ZMP = {"expert": (3.24, 1.99), "network": (3.43, 2.13)}
"""Distance of the zero moment points, mean and standard deviation [cm], printed; its expert is a person at the keys."""
PRINTED_MS = 4.0
SOLVED = {"straight": True, "curve": True, "obstacle": False, "search": True, "person": True, "decoys": True}
"""What the document's network did, twice each of the first four."""
ENOUGH = 0.9
"""Share of drives from which on we call a scenario solved; the document has two drives."""


def balance(finishes: Sequence[RoomFinish]) -> dict[str, dict[str, float]]:
    """Distance of the zero moment points [cm] and entropy of the velocity ahead [nat], of all and of each scenario."""
    named = {name: [one for one in finishes if one.room.scenario == name] for name in SCENARIOS}
    found = {}
    for name, those in {"all": list(finishes), **named}.items():
        errors = 100 * _together(those)
        if len(errors):
            asked = np.concatenate([one.asked[:, 0] for one in those])
            entropy = command_entropy(asked)
            found[name] = {"entropy": entropy, "mean": float(errors.mean()), "spread": float(errors.std())}
    return found


def _together(finishes: Sequence[RoomFinish]) -> Float[np.ndarray, " ticks"]:
    return np.concatenate([np.zeros(0), *(one.zmp_errors for one in finishes)])


def rows_of_looks(alike: Mapping[str, Any]) -> list[Row]:
    """Means over the networks, at the looks of drives that none of them learned from."""

    def mean(name: str) -> float | None:
        return float(np.mean([one[name] for one in alike["networks"]])) if alike["networks"] else None

    return [
        Row("Kullback-Leibler divergence, ahead", mean("kullback_leibler_ahead"), PRINTED_KL[0], "nat"),
        Row("Kullback-Leibler divergence, turning", mean("kullback_leibler_turning"), PRINTED_KL[1], "nat"),
        Row("looks of the comparison", float(alike["looks"]), 13341.0),
    ]


def rows_of_drives(figures: Mapping[str, Any]) -> list[Row]:
    """Shares that reached the target, of each scenario: networks, the expert, networks in the unseen style."""
    rows = []
    for name, solved in SOLVED.items():
        for driver in ("network", "expert", "unseen_style"):
            if one := figures[driver].get(name):
                printed = 100.0 * solved if driver == "network" else None
                rows.append(
                    Row(f"{name}, {driver.replace('_', ' ')}, reached", 100 * one["success_rate"], printed, "%")
                )
    return rows


def rows_of_balance(balance: Mapping[str, Mapping[str, Mapping[str, float]]]) -> list[Row]:
    """Over all ticks of all drives."""
    rows = []
    for driver, (mean, spread) in PRINTED_ZMP.items():
        if one := balance[driver].get("all"):
            rows.append(Row(f"distance of the zero moment points, {driver}, mean", one["mean"], mean, "cm"))
            rows.append(Row(f"distance of the zero moment points, {driver}, deviation", one["spread"], spread, "cm"))
    return rows


def verdict(figures: Mapping[str, Any], balance: Mapping[str, Mapping[str, Mapping[str, float]]]) -> tuple[str, bool]:
    """In one sentence; and whether what the document claims held: what it solved is solved, and balance is as good."""
    network, theirs, ours = figures["network"], balance["expert"].get("all"), balance["network"].get("all")
    wanted = [name for name, solved in SOLVED.items() if solved]
    solved = [name for name in wanted if network.get(name, {"success_rate": 0.0})["success_rate"] >= ENOUGH]
    within = bool(theirs and ours and abs(ours["mean"] - theirs["mean"]) <= theirs["spread"])
    reached = round(network["success_rate"] * network["episodes"]) if network["episodes"] else 0
    low, high = 100 * network["wilson_low"], 100 * network["wilson_high"]
    verdict = (
        f"{reached} of {network['episodes']} drives reached the target ({low:.1f} to {high:.1f} %, Wilson, 95 %), "
        f"{len(solved)} of the {len(wanted)} scenarios that the document solved at {100 * ENOUGH:.0f} % or more; "
        f"the network's mean distance of the zero moment points is {'within' if within else 'not shown to be within'} "
        "one standard deviation of the expert's"
    )
    return verdict, within and len(solved) == len(wanted)


def draw(
    folder: Path,
    learned: Sequence[Path],
    alike: Mapping[str, Any],
    seen: Sequence[RoomFinish],
    expert: Sequence[RoomFinish],
) -> None:
    """Figures 4.16 to 4.18 and 4.23 to 4.25."""
    from toddle.navigate.scenarios.draw_rooms import room
    from toddle.outside.navigation import cloning_pictures as pictures
    from toddle.outside.navigation.room_pictures import room_paths

    losses = {path.name: one["loss_command"] for path, one in zip(learned, alike["networks"], strict=False)}
    histories = {path.name: load_run(path)[0].history for path in learned if list(path.glob("checkpoint-*.json"))}
    if histories:
        pictures.loss_history(folder / "figure-4-16.png", histories, losses)
    if alike["said"]:
        title = f"figure 4.17: {learned[0].name} at {alike['looks']:,} looks that it did not learn from"
        taught, says = alike["said"][0]
        pictures.velocity_histograms(folder / "figure-4-17.png", taught, says, title)
    if not (seen and expert):
        return
    targets = [room(key.scenario, key.split, key.number, key.style).target for key in (one.room for one in seen)]
    places = [(target.x, target.y) for target in targets]
    room_paths(folder / "figure-4-18.png", seen, places, title="figure 4.18: networks in rooms of the test split")
    drivers = {"expert": expert, "network": seen}
    shown = [name for name in ("search", "straight") if any(one.room.scenario == name for one in seen)]
    distances = {
        driver: {name: _together([one for one in those if one.room.scenario == name]) for name in shown}
        for driver, those in drivers.items()
    }
    if shown:
        pictures.zmp_distances(folder / "figure-4-24.png", distances)
    points = {
        driver: [
            pictures.Balance(name, one["entropy"], one["mean"], one["spread"])
            for name, one in balance(those).items()
            if name != "all"
        ]
        for driver, those in drivers.items()
    }
    pictures.balance_over_entropy(folder / "figure-4-25.png", points)
