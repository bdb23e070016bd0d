"""This project's inverse kinematics beside its peers: one run, one thread, the same bodies and targets.

    python -m benchmarks.reach                           # all bodies and peers: about seven minutes
    python -m benchmarks.reach --bodies panda --peers toddle mink --out runs/reach.json
    python -m benchmarks.reach report                    # only the tables of docs/peers.md

Peers that aren't there yet are installed first, each in an environment of its own in the cache. From the root of the
repository. Success: within 1 mm and 0.01 rad, limits kept, scored by this project's kinematics in float64.
"""

from __future__ import annotations

import argparse
import os
import platform
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from benchmarks.reach.asked import Asked
from benchmarks.reach.bodies import BODIES, body
from benchmarks.reach.installed import OURS, PEERS, Skipped, python_of
from benchmarks.reach.measured import Plan, measured
from benchmarks.reach.report import write_report
from toddle.outside.files import write_json

ROOT = Path(__file__).parents[2]
RESULT = ROOT / "benchmarks" / "results" / "reach_peers.json"


def main() -> None:
    parser = argparse.ArgumentParser(
        "python -m benchmarks.reach", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", nargs="?", choices=("run", "report"), default="run")
    parser.add_argument("--bodies", nargs="+", choices=tuple(BODIES), default=tuple(BODIES))
    parser.add_argument("--peers", nargs="+", choices=PEERS, default=PEERS)
    parser.add_argument("--targets", type=int, default=Plan().targets)
    parser.add_argument("--seed", type=int, default=Plan().seed)
    parser.add_argument("--out", type=Path, default=RESULT)
    asked = parser.parse_args()
    if asked.what == "run":
        run(asked.bodies, asked.peers, Plan(targets=asked.targets, seed=asked.seed), asked.out)
    if asked.out == RESULT:
        write_report(RESULT, ROOT / "docs" / "peers.md")


def run(bodies: tuple[str, ...], names: tuple[str, ...], plan: Plan, out: Path) -> None:
    """Everything, written down after each body."""
    skipped: dict[str, str] = {}
    pythons: dict[str, Path] = {}
    for name in names:
        try:
            pythons[name] = python_of(name)
        except Skipped as reason:
            skipped[name] = str(reason)
    began = time.perf_counter()
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        core = max(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else None
        peers = {name: stack.enter_context(Asked(name, python, core)) for name, python in pythons.items()}
        hello = {name: peer.ask({"do": "hello"}, 120.0) for name, peer in peers.items()}
        skipped |= {name: told["refused"] for name, told in hello.items() if "refused" in told}
        content = head(plan, skipped, {name: told.get("versions") for name, told in hello.items()})
        for name in bodies:
            arm = body(name)
            alive = {peer: peers[peer] for peer in peers if peer not in skipped and peers[peer].alive}
            rows = measured(arm, alive, plan, folder)
            content["bodies"][name] = {"joints": len(arm.joints), "posed": arm.posed, "peers": rows}
            content["seconds"] = round(time.perf_counter() - began, 1)
            content["load_average"] = round(os.getloadavg()[0], 1)
            write_json(out, content)
            for peer, row in rows.items():
                print(name, peer, row.get("refused") or {key: row[key] for key in list(row)[:8]}, flush=True)
            for peer in alive:
                if not peers[peer].alive:
                    peers[peer] = stack.enter_context(Asked(peer, pythons[peer], core))


def head(plan: Plan, skipped: dict[str, str], found: dict[str, Any]) -> dict[str, Any]:
    """What the figures were measured with, and on."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return {
        "benchmark": "reach_peers",
        "what": "single queries and batches of inverse kinematics on known robots, beside other packages",
        "ours": OURS,
        "command": "python -m benchmarks.reach",
        "plan": plan._asdict(),
        "machine": f"{cores} shared cores, one of them used, one thread",
        "python": platform.python_version(),
        "versions": {name: told for name, told in found.items() if told},
        "skipped": skipped,
        "bodies": {},
    }


if __name__ == "__main__":
    main()
