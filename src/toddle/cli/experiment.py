"""``toddle experiment``: a document's tables and figures, made again and set beside the document's."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from toddle.cli.arguments import parse
from toddle.cli.options import POSITIONAL
from toddle.failures import BadInput

if TYPE_CHECKING:
    from toddle.experiments.experiment import Experiment, Outcome, Row, Task

_MOST_SEEDS = 1000


@dataclass(frozen=True)
class Ask:
    """A document's table or figure is made again, and printed beside the document's, with a verdict.

    toddle experiment lists them. toddle experiment NAME leaves a folder with figures and pictures; its exit code is
    1 where the document's claim was not reproduced.

    Attributes:
        name: which one.
        quick: in under a minute; so unless told otherwise.
        full: as the document did.
        seeds: runs of each kind; the experiment's own number unless given.
        seed: of all randomness.
        data: a folder with files of the document's author, which an experiment sets beside ours where it can.
        out: the folder to leave; runs/NAME unless given.
        json: print one JSON object with the figures, and nothing else.
    """

    name: Annotated[str | None, POSITIONAL] = None
    quick: bool = False
    full: bool = False
    seeds: int | None = None
    seed: int = 0
    data: Path | None = None
    out: Path | None = None
    json: bool = False


def main(argv: Sequence[str]) -> int:
    """List the experiments, or run one, and return the exit code."""
    asked = parse(Ask, argv, prog="toddle experiment")
    _check(asked)
    if asked.name is None:
        return _list(asked)
    from toddle.experiments import experiment_named
    from toddle.outside.files import write_json

    experiment = experiment_named(asked.name)
    folder = _new_folder(asked.out, asked.name)
    outcome, stopped, seconds = _run(experiment, asked, folder)
    record = _record(experiment, outcome, asked, stopped, seconds)
    write_json(folder / "figures.json", record)
    _tell(experiment, outcome, record, asked, folder)
    if stopped:
        print("toddle: stopped; the figures are of what was done until then", file=sys.stderr)
        return 130
    return 0 if outcome.holds else 1


def _check(asked: Ask) -> None:
    """Refuse what contradicts itself before anything heavy is imported."""
    if asked.quick and asked.full:
        raise BadInput("--quick and --full exclude each other", where="toddle experiment", remedy="give one")
    if asked.data is not None and not asked.data.is_dir():
        raise BadInput("it is no folder", where=f"--data {asked.data}", remedy="give the folder of the author's files")
    if asked.seeds is not None and not 1 <= asked.seeds <= _MOST_SEEDS:
        raise BadInput(f"{asked.seeds} is out of range", where="--seeds", remedy=f"give 1 to {_MOST_SEEDS}")
    if not 0 <= asked.seed < 2**32:
        raise BadInput(f"{asked.seed} is out of range", where="--seed", remedy=f"give 0 to {2**32 - 1}")


def _list(asked: Ask) -> int:
    from toddle.experiments import NAMES, experiment_named
    from toddle.outside.terminal import print_table

    known = {name: experiment_named(name).reproduces for name in NAMES}
    if asked.json:
        print(json.dumps(known))
        return 0
    print_table("toddle experiment NAME", ("name", "reproduces"), list(known.items()))
    return 0


def _run(experiment: Experiment, asked: Ask, folder: Path) -> tuple[Outcome, bool, float]:
    """What it found, whether somebody stopped it, and how long it took [s]."""
    from toddle.experiments.experiment import Task
    from toddle.outside.terminal import Reporter, stoppable

    began = time.perf_counter()
    with Reporter(experiment.name, 100) as reporter, stoppable() as stop:
        task: Task = Task(
            full=asked.full,
            seed=asked.seed,
            seeds=asked.seeds,
            folder=folder,
            tell=lambda done, news: reporter.tell(round(100 * done), news),
            stopped=lambda: stop.asked,
            data=asked.data,
        )
        outcome = experiment.run(task)
        return outcome, stop.asked, time.perf_counter() - began


def _record(experiment: Experiment, outcome: Outcome, asked: Ask, stopped: bool, seconds: float) -> dict[str, Any]:
    """Everything that a reader needs to judge the figures or to make them again."""
    from toddle.outside.machine import machine_in_words
    from toddle.outside.versions import versions

    return {
        "experiment": experiment.name,
        "reproduces": experiment.reproduces,
        "verdict": outcome.verdict,
        "holds": outcome.holds,
        "stopped_early": stopped,
        "command": _command(asked),
        "seed": asked.seed,
        "parameters": asdict(outcome.parameters),
        "rows": [asdict(row) for row in outcome.rows],
        "figures": dict(outcome.figures),
        "seconds": round(seconds, 1),
        "machine": machine_in_words(),
        "versions": versions(),
    }


def _command(asked: Ask) -> str:
    """The call that makes the same figures again."""
    words = ["toddle", "experiment", str(asked.name), "--full" if asked.full else "--quick", "--seed", str(asked.seed)]
    return " ".join(words + (["--seeds", str(asked.seeds)] if asked.seeds is not None else []))


def _tell(experiment: Experiment, outcome: Outcome, record: dict[str, Any], asked: Ask, folder: Path) -> None:
    """The figures on standard output: one JSON object, or a table beside the document's."""
    from toddle.outside.files import finite
    from toddle.outside.terminal import print_table

    if asked.json:
        print(json.dumps(finite({**record, "folder": str(folder)})))
        return
    rows = [(row.what, _figure(row, row.ours), _figure(row, row.document)) for row in outcome.rows]
    print_table(f"{experiment.name}: {experiment.reproduces}", ("", "ours", "document"), rows)
    print(f"figures and pictures: {folder}")
    print(f"verdict: {'yes' if outcome.holds else 'no'}, {outcome.verdict}")


def _figure(row: Row, value: float | None) -> str:
    if value is None:
        return ""
    number = f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"
    return f"{number} {row.unit}".strip()


def _new_folder(out: Path | None, name: str) -> Path:
    """The folder to leave: the one asked for, or a new one under runs/."""
    from toddle.outside.files import make_folder

    if out is not None:
        return make_folder(out)
    number = 1
    while (folder := Path("runs") / (name if number == 1 else f"{name}-{number}")).exists():
        number += 1
    return make_folder(folder)
