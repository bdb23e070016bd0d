"""``toddle navigate record``: drives are driven and kept as a dataset; a dataset is looked at, or copied."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from toddle.cli.arguments import parse
from toddle.failures import BadInput

if TYPE_CHECKING:
    from toddle.outside.dataset.drives import Errand, How
    from toddle.outside.dataset.writer import Writer

_PROG = "toddle navigate record"
_MOST = {"episodes": 100_000, "jobs": 1024, "first": 10**6, "seed": 10**6}
_INTERRUPTED = 130


@dataclass(frozen=True)
class Record:
    """Somebody drives the walking robot through rooms, in physics, and what was seen and done is kept as a dataset.

    toddle navigate record lets the expert drive; with --driver person you drive, and see what the robot sees. The
    dataset is one of LeRobot's (v3.0), without loss. Episodes that are there already are not driven again: the same
    call goes on where it was interrupted, and another one adds to it. The exit code is 0 whatever the drives came to,
    130 after Ctrl-C; with --show or --copy 1 if an episode is damaged.

    Attributes:
        driver: who drives: the expert, who sees the truth; you; a network, with the expert saying what it would do.
        policy: the folder of the network, for --driver policy.
        scenario: which tasks, in turn; all six unless given.
        episodes: how many drives there are to be in the end, in all scenarios together.
        split: of the rooms: train, validation or test.
        style: of surfaces and light; the unseen ones are for tests alone.
        first: number of the first room of each scenario.
        seed: of noise, jolts and starts; another one drives through the same rooms again.
        noise: jolts that the driver must cope with: 1 for up to 0.12 m/s and 0.25 rad/s for about a second, every five.
        anywhere: share of drives that begin anywhere in the room, from 0 to 1.
        eyes: how the robot sees: a stereo pair, or small pictures by rays.
        robot: a name (heicub), or the path of a humanoid's description.
        config: a TOML file that says what a humanoid's description leaves out.
        jobs: processes; one for each core unless given. You drive alone.
        out: the dataset's folder; runs/drives unless given. With --show, the picture's file.
        show: tell what a dataset holds, check all of it, and draw one episode.
        episode: the one that --show draws; the first whole one unless given.
        copy: a dataset whose whole episodes are copied to --out, where one is damaged.
        json: print one JSON object with the figures, and nothing else.
    """

    driver: Literal["expert", "person", "policy"] = "expert"
    policy: Path | None = None
    scenario: tuple[Literal["straight", "curve", "obstacle", "search", "person", "decoys"], ...] = (
        "straight", "curve", "obstacle", "search", "person", "decoys",
    )  # fmt: skip
    episodes: int = 60
    split: Literal["train", "validation", "test"] = "train"
    style: Literal["seen", "unseen"] = "seen"
    first: int = 0
    seed: int = 0
    noise: float = 0.0
    anywhere: float = 0.0
    eyes: Literal["stereo", "cast"] = "stereo"
    robot: str = "heicub"
    config: Path | None = None
    jobs: int | None = None
    out: Path | None = None
    show: Path | None = None
    episode: int | None = None
    copy: Path | None = None
    json: bool = False


def main(argv: Sequence[str]) -> int:
    """Record, show or copy, and return the exit code."""
    asked = parse(Record, argv, prog=_PROG)
    _check(asked)
    if asked.show is not None or asked.copy is not None:
        from toddle.cli.navigate_dataset import copy, show

        return show(asked) if asked.show is not None else copy(asked)
    return _record(asked)


def _check(asked: Record) -> None:
    """Refuse what contradicts itself before anything heavy is imported."""
    if (asked.driver == "policy") != (asked.policy is not None):
        raise BadInput("--driver policy and --policy belong together", where=_PROG, remedy="give both")
    if asked.show is not None and asked.copy is not None:
        raise BadInput("--show and --copy exclude each other", where=_PROG, remedy="give one")
    if asked.copy is not None and asked.out is None:
        raise BadInput("--copy needs a place", where=_PROG, remedy="name a new folder with --out")
    if asked.episode is not None and (asked.show is None or asked.episode < 0):
        raise BadInput(
            "an episode is shown by its number", where="--episode", remedy="give --show DATASET, count from 0"
        )
    for name, most in _MOST.items():
        value, least = getattr(asked, name), 0 if name in ("first", "seed") else 1
        if value is not None and not least <= value <= most:
            raise BadInput(f"{value} is out of range", where=f"--{name}", remedy=f"give {least} to {most}")
    for name, most in (("noise", 10.0), ("anywhere", 1.0)):
        if not 0 <= getattr(asked, name) <= most:
            raise BadInput(f"{getattr(asked, name):g} is out of range", where=f"--{name}", remedy=f"give 0 to {most:g}")
    if len(set(asked.scenario)) < len(asked.scenario):
        raise BadInput("one is named twice", where="--scenario", remedy="name each once")
    if asked.style == "unseen" and asked.split != "test":
        raise BadInput("the unseen style is kept out of training", where="--style", remedy="add --split test")
    if asked.driver == "person":
        if not (sys.stdin.isatty() and sys.stderr.isatty()):
            raise BadInput("this is no terminal", where="--driver person", remedy="run it in one, keys and screen")
        if asked.noise or asked.jobs not in (None, 1):
            raise BadInput("you drive alone, and without jolts", where=_PROG, remedy="leave --noise and --jobs out")


def _record(asked: Record) -> int:
    from toddle.outside.dataset.drives import errands, missing
    from toddle.outside.dataset.writer import Writer

    folder = asked.out or Path("runs/drives")
    wanted = errands(asked.scenario, asked.split, asked.style, asked.episodes, first=asked.first, seed=asked.seed)
    how = _how(asked)
    with Writer(folder, asked.robot) as writer:
        left, before = missing(folder, wanted, asked.driver), len(writer)
        if len(left) < len(wanted):
            print(f"toddle: {len(wanted) - len(left)} of {len(wanted)} are there already", file=sys.stderr)
        seconds, interrupted = (_by_person if asked.driver == "person" else _by_itself)(asked, how, left, writer)
    from toddle.cli.navigate_dataset import tell

    tell(folder, before, seconds, as_json=asked.json)
    return _INTERRUPTED if interrupted else 0


def _how(asked: Record) -> How:
    """Who drives, and how; made once here, so that what can't be made is refused before anything is written.

    Raises:
        BadInput: the robot or the policy can't be used.
    """
    from toddle.outside.dataset.drives import How, expert
    from toddle.outside.navigation.physics_batch import Recipe
    from toddle.outside.navigation.room_eyes import EyeOptions
    from toddle.robots.humanoids import load_humanoid

    recipe = Recipe(expert, (), asked.robot, asked.config)
    if asked.policy is not None:
        from toddle.outside.navigation.cloned import cloned

        recipe = Recipe(cloned, (asked.policy,), asked.robot, asked.config)
    _ = recipe.make(load_humanoid(recipe.robot, recipe.config), *recipe.given)
    taught = asked.driver == "policy" or asked.noise > 0
    return How(recipe, asked.driver, taught, asked.noise, asked.anywhere, EyeOptions(asked.eyes))


def _by_itself(asked: Record, how: How, left: Sequence[Errand], writer: Writer) -> tuple[float, bool]:
    """Drive on all cores; how long it took [s], and whether somebody stopped it."""
    import time

    from toddle.outside.dataset.drives import record
    from toddle.outside.terminal import Reporter, stoppable

    began, outcomes = time.monotonic(), []
    with stoppable() as stop, Reporter(f"{asked.driver} drives, episodes", len(left), quiet=asked.json) as reporter:
        for errand, found in record(how, left, asked.jobs, lambda: stop.asked):
            try:
                if isinstance(found, BadInput):
                    raise found
                writer.add(found)
            except BadInput as fault:
                print(f"toddle: {errand.room.scenario} {errand.room.number}: {fault.line}", file=sys.stderr)
                continue
            outcomes.append(found.outcome.name)
            reporter.tell(len(outcomes), f"{outcomes.count('WON')} of {len(outcomes)} reached")
        return time.monotonic() - began, stop.asked


def _by_person(_: Record, how: How, left: Sequence[Errand], writer: Writer) -> tuple[float, bool]:
    """Drive by hand, a room after the other; no time worth telling, and whether it was interrupted by Ctrl-C."""
    from contextlib import closing

    from toddle.outside.dataset.by_hand import by_hand

    try:
        with closing(by_hand(how, left)) as recordings:
            for recording in recordings:
                writer.add(recording)
    except KeyboardInterrupt:
        return 0.0, True
    return 0.0, False
