"""Parts of the campaign: lists of cases, each run by itself; what is done is kept, and not done again.

A part's file holds every finished case, what they were run with, and a summary. It is written after each case, so that
a campaign that was stopped goes on where it was; cases that another version of the walker did are run again.
"""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import os
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import toddle
from toddle.outside.files import finite, write_json
from toddle.outside.machine import machine_in_words
from toddle.outside.versions import versions

Case = dict[str, Any]
"""What to run: JSON, with a ``name`` of its own."""

Row = dict[str, Any]
"""What came of a case: JSON."""


@dataclass(frozen=True)
class Part:
    """One part of the campaign.

    Attributes:
        name: of the part, and of its file.
        about: what it shows.
        cases: what to run; True: only a taste of it.
        run: one case.
        summary: of all of them, by name; it must do with a part of them.
        told: of one row, what a progress line says.
    """

    name: str
    about: str
    cases: Callable[[bool], list[Case]]
    run: Callable[[Case], Row]
    summary: Callable[[dict[str, Row]], dict[str, Any]]
    told: tuple[str, ...] = ("fell",)


def run_part(part: Part, out: Path, *, workers: int, quick: bool, again: bool, command: str) -> dict[str, Any]:
    """Run what isn't done of a part; returns what its file holds. A case that raises is told and left out."""
    path = out / f"walking_{part.name}.json"
    cases = part.cases(quick)
    head = {
        "benchmark": f"walking, {part.name}",
        "what": part.about,
        "command": command,
        "source": source_digest(),
        "commit": commit(),
        "machine": machine_in_words(),
        "versions": versions(),
        "workers": workers,
        "seeds": sorted({case["seed"] for case in cases if "seed" in case}),
    }
    done = {} if again else kept(path, head["source"], cases)
    waiting = [case for case in cases if case["name"] not in done]
    print(f"{part.name}: {len(cases)} cases, {len(done)} of them done before", flush=True)
    began, content, failed = time.perf_counter(), {}, {}

    def keep() -> None:
        rows = {case["name"]: done[case["name"]] for case in cases if case["name"] in done}
        content.update(
            head,
            date=datetime.now(UTC).date().isoformat(),
            complete=len(rows) == len(cases),
            failed=failed,
            cpu_seconds=round(sum(row["cpu_seconds"] for row in rows.values()), 1),
            summary=part.summary(rows) if rows else {},
            cases=[case | {"row": rows[case["name"]]} for case in cases if case["name"] in rows],
        )
        write_json(path, content)

    keep()
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        futures = {pool.submit(timed, part.run, case): case for case in waiting}
        try:
            for number, future in enumerate(as_completed(futures), start=1):
                name = futures[future]["name"]
                if (fault := future.exception()) is None:
                    done[name] = future.result()
                    told = ", ".join(f"{key} {done[name].get(key)}" for key in part.told)
                else:
                    failed[name] = told = f"{type(fault).__name__}: {fault}"
                keep()
                left = (time.perf_counter() - began) / number * (len(waiting) - number)
                print(f"[{number}/{len(waiting)}] {part.name}: {name}: {told} ({left:.0f} s left)", flush=True)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    if source_digest() != head["source"]:
        head["source"] = "changed while this ran"
        keep()
        print(f"{part.name}: the walker's source {head['source']}: run it again", file=sys.stderr)
    return content


def timed(run: Callable[[Case], Row], case: Case) -> Row:
    """A case's row and the processor time that it took [s]."""
    began = time.process_time()
    row = run(case)
    return finite(row) | {"cpu_seconds": round(time.process_time() - began, 2)}


def kept(path: Path, source: str, cases: list[Case]) -> dict[str, Row]:
    """The rows of an earlier run that still count: the same cases by the same source."""
    if not path.exists():
        return {}
    content = json.loads(path.read_text())
    if content.get("source") != source:
        return {}
    asked = {case["name"]: finite(case) for case in cases}
    rows = {}
    for case in content["cases"]:
        row = case.pop("row")
        if asked.get(case["name"]) == case:
            rows[case["name"]] = row
    return rows


def source_digest() -> str:
    """Of all files that a walk depends on, the benchmark's own too."""
    package, here = Path(toddle.__file__).parent, Path(__file__).parent
    folders = (package / "walk", package / "robots", package / "outside" / "simulation", here)
    paths = [path for folder in folders for path in sorted(folder.rglob("*.py"))]
    digest = hashlib.sha256()
    for path in [*paths, package / "signals.py"]:
        if path.name not in ("report.py", "picture.py"):
            digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def commit() -> str:
    """The commit that was run, and whether files were changed since."""
    told = {
        name: subprocess.run(["git", *words], capture_output=True, text=True, cwd=Path(__file__).parent).stdout.strip()
        for name, words in {"commit": ["rev-parse", "--short", "HEAD"], "changed": ["diff", "HEAD", "--stat"]}.items()
    }
    return (told["commit"] or "unknown") + (", and changes" if told["changed"] else "")


def single_threaded() -> None:
    """Numerical libraries of the workers take one core each; call before they start."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ.setdefault(name, "1")
