"""What ``toddle navigate record`` tells of a dataset, the picture of an episode, and a copy without what is damaged."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from toddle.failures import BadInput

if TYPE_CHECKING:
    from toddle.cli.navigate_record import Record
    from toddle.navigate.cloning.recording import Recording
    from toddle.outside.dataset.rows import Facts

_HEAD = ("", "episodes", "reached", "collided", "fell", "late", "looks", "minutes")


def tell(folder: Path, before: int, seconds: float, *, as_json: bool) -> None:
    """What a dataset holds, on standard output, and how fast the newest of it came.

    Args:
        folder: of the dataset.
        before: episodes that it held before.
        seconds: what the newer ones took [s]; 0: that is of no interest.
        as_json: one JSON object, or a table.
    """
    from toddle.navigate.sight import PERIOD
    from toddle.outside.dataset.reader import episodes, facts_of
    from toddle.outside.dataset.rows import Damaged

    found: list[tuple[int, Facts]] = []
    for number in episodes(folder):
        try:
            found.append((number, facts_of(folder, number)))
        except Damaged as fault:
            print(f"toddle: {fault.line}", file=sys.stderr)
    driven = sum(facts.looks for number, facts in found if number >= before) * PERIOD
    figures = {**_figures(folder, [facts for _, facts in found]), "recorded": len(episodes(folder)) - before}
    if driven and seconds:
        figures |= {"seconds": seconds, "real_time_factor": driven / seconds}
    _print(folder, figures, [facts for _, facts in found], as_json=as_json)


def _figures(folder: Path, found: Sequence[Facts]) -> dict[str, Any]:
    outcomes = [facts.outcome.name for facts in found]
    return {
        "folder": str(folder), "episodes": len(found), "looks": sum(facts.looks for facts in found),
        "wins": outcomes.count("WON"), "collisions": outcomes.count("COLLIDED"), "falls": outcomes.count("FELL"),
        "late": outcomes.count("LATE"),
        "bytes": sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()),
    }  # fmt: skip


def _print(folder: Path, figures: dict[str, Any], found: Sequence[Facts], *, as_json: bool) -> None:
    from toddle.navigate.scenarios.rooms import SCENARIOS
    from toddle.outside.files import finite
    from toddle.outside.terminal import print_table

    if as_json:
        print(json.dumps(finite(figures)))
        return
    groups = {name: [facts for facts in found if facts.room.scenario == name] for name in SCENARIOS}
    rows = [_row(name, facts) for name, facts in groups.items() if facts]
    print_table(str(folder), _HEAD, [*rows, _row("all", found)])
    drivers = sorted({facts.driver for facts in found})
    speed = f", {figures['real_time_factor']:.1f} x real time" if "real_time_factor" in figures else ""
    print(f"driven by {', '.join(drivers) or 'nobody'}; {figures['bytes'] / 1e6:.1f} MB{speed}")
    sys.stdout.flush()


def _row(name: str, found: Sequence[Facts]) -> list[str]:
    from toddle.navigate.sight import PERIOD

    outcomes = [facts.outcome.name for facts in found]
    looks = sum(facts.looks for facts in found)
    counts = [outcomes.count(which) for which in ("WON", "COLLIDED", "FELL", "LATE")]
    return [name, str(len(found)), *map(str, counts), str(looks), f"{looks * PERIOD / 60:.1f}"]


def show(asked: Record) -> int:
    """Check all of a dataset, tell what it holds, draw one episode; 1 if one is damaged."""
    from toddle.outside.dataset.reader import episodes, read_dataset
    from toddle.outside.dataset.rows import Damaged
    from toddle.outside.dataset.strip import film_strip
    from toddle.outside.terminal import Reporter

    folder = asked.show
    assert folder is not None
    count = len(episodes(folder))
    if asked.episode is not None and asked.episode >= count:
        raise BadInput(f"there is no episode {asked.episode}", where=str(folder), remedy=f"it has {count}, from 0")
    damaged: list[Damaged] = []
    drawn: tuple[int, Recording] | None = None
    with Reporter("episodes checked", count, quiet=asked.json) as reporter:
        for number, recording in read_dataset(folder, damaged.append):
            if number == asked.episode or (asked.episode is None and drawn is None):
                drawn = number, recording
            reporter.tell(number + 1, f"{len(damaged)} damaged")
    tell(folder, count, 0.0, as_json=asked.json)
    if drawn is not None:
        number, recording = drawn
        path = asked.out or Path("runs") / f"{folder.resolve().name}-{number}.png"
        film_strip(path, recording, f"{folder.name}, episode {number}")
        print(f"episode {number}: {path}", file=sys.stderr)
    for fault in damaged:
        print(f"toddle: {fault.line}", file=sys.stderr)
    return 1 if damaged else 0


def copy(asked: Record) -> int:
    """Copy the whole episodes of a dataset into a new one, or to the end of another; 1 if one is damaged."""
    from toddle.outside.dataset.reader import episodes, read_dataset
    from toddle.outside.dataset.rows import Damaged
    from toddle.outside.dataset.writer import Writer
    from toddle.outside.terminal import Reporter

    source, target = asked.copy, asked.out
    assert source is not None
    assert target is not None
    if source.resolve() == target.resolve():
        raise BadInput("it is the dataset itself", where=f"--out {target}", remedy="name another folder")
    damaged: list[Damaged] = []
    count = len(episodes(source))
    with Writer(target, asked.robot) as writer, Reporter("episodes copied", count, quiet=asked.json) as reporter:
        before = len(writer)
        for number, recording in read_dataset(source, damaged.append):
            writer.add(recording)
            reporter.tell(number + 1, f"{len(damaged)} damaged")
    tell(target, before, 0.0, as_json=asked.json)
    for fault in damaged:
        print(f"toddle: {fault.line}", file=sys.stderr)
    return 1 if damaged else 0
