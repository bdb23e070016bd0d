"""One arm, all peers, in rounds: each peer in turn, one at a time, on the same targets, so that what else the machine
does falls on all of them.

The first round gives the answers that are scored, for as many targets as fit into its time. Later rounds repeat the
first of them; a target's time is the fastest of its rounds. Batches are timed in the same rounds.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.reach.asked import Asked, job
from benchmarks.reach.bodies import Body
from benchmarks.reach.targets import reached, targets

Row = dict[str, Any]


class Plan(NamedTuple):
    """How much is asked.

    Attributes:
        targets: for each arm.
        seed: of the targets, and of the restarts.
        rounds: of timing.
        first_s: seconds of the first round, for a peer and an arm.
        later_s: of each later one.
        limit_s: seconds that restarts may take on one target.
        load_s: seconds within which an arm must be loaded.
    """

    targets: int = 1000
    seed: int = 0
    rounds: int = 4
    first_s: float = 2.5
    later_s: float = 0.4
    limit_s: float = 0.1
    load_s: float = 110.0


def measured(body: Body, peers: Mapping[str, Asked], plan: Plan, folder: Path) -> dict[str, Row]:
    """What came of every peer: figures, or ``refused`` and why."""
    aims = targets(body, plan.targets, plan.seed)
    flat = aims.reshape(len(aims), 16).tolist()
    told: dict[str, Row] = {}
    for name, peer in peers.items():
        told[name] = peer.ask({"do": "load", "job": job(body, folder, name)}, plan.load_s)
    heard: dict[str, list[list[Row]]] = {name: [] for name in peers}
    batches: dict[str, list[Row]] = {name: [] for name in peers}
    for turn in range(plan.rounds):
        for name, peer in peers.items():
            if "refused" not in told[name]:
                _round(peer, told[name], turn, flat, plan, heard[name], batches[name])
    return {
        name: told[name] if "refused" in told[name] else figures(body, aims, told[name], heard[name], batches[name])
        for name in peers
    }


def _round(
    peer: Asked, told: Row, turn: int, flat: list[list[float]], plan: Plan, heard: list[list[Row]], batches: list[Row]
) -> None:
    done = len(heard[0]) if heard else len(flat)
    seconds = plan.later_s if turn else plan.first_s
    asked = {"do": "solve", "targets": flat[:done], "seed": plan.seed, "limit": plan.limit_s, "seconds": seconds}
    answer = peer.ask(asked, seconds + 60.0)
    if "refused" in answer:
        told["refused"] = answer["refused"]
        return
    heard.append(answer["rows"])
    if told["batch"] and not (batches and batches[-1]["s"] > plan.first_s / 2):
        batch = peer.ask({"do": "batch", "targets": flat}, 60.0)
        if "refused" in batch:
            told.update(batch=False, batch_refused=batch["refused"])
        else:
            batches.append(batch)


def figures(body: Body, aims: np.ndarray, told: Row, rounds: list[list[Row]], batches: list[Row]) -> Row:
    """Success and times of one peer on one arm, from its answers; scored here, not by what the peer says."""
    rows = rounds[0]
    good = reached(body, aims[: len(rows)], [row["q"] for row in rows])
    whole, first = fastest(rounds, "s"), fastest(rounds, "first_s")
    found: Row = {
        "targets": len(rows),
        "success_percent": _short(100 * good.mean()),
        "first_try_success_percent": _short(100 * float(np.mean([row["first"] for row in rows]))),
        "tries_mean": _short(float(np.mean([row["tries"] for row in rows]))),
        "timed_again": min(len(later) for later in rounds),
        "median_us": _short(float(np.median(whole))),
        "p99_us": _short(float(np.percentile(whole, 99))),
        "first_try_median_us": _short(float(np.median(first))),
    }
    if batches:
        scored = reached(body, aims, batches[0]["q"])
        found["batch_us_per_target"] = _short(1e6 * min(batch["s"] for batch in batches) / len(aims))
        found["batch_success_percent"] = _short(100 * scored.mean())
    if "batch_refused" in told:
        found["batch_refused"] = told["batch_refused"]
    return found | {"load_s": told["load_s"], "settings": told["settings"]}


def fastest(rounds: list[list[Row]], key: str) -> np.ndarray:
    """Each target's least time [us] in the rounds that came to it."""
    times = np.full((len(rounds), len(rounds[0])), np.inf)
    for turn, rows in enumerate(rounds):
        times[turn, : len(rows)] = [1e6 * row[key] for row in rows]
    return times.min(axis=0)


def _short(value: float) -> float:
    return float(f"{value:.4g}")
