"""``toddle navigate clone``: a network learns to drive by what it sees, from drives that it watches or has driven."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from toddle.cli.arguments import parse
from toddle.cli.navigate_folder import left_folder, refuse_used
from toddle.cli.options import POSITIONAL
from toddle.failures import BadInput

if TYPE_CHECKING:
    from toddle.navigate.cloning.config import CloningConfig
    from toddle.navigate.cloning.dagger import Course
    from toddle.outside.navigation.cloning_drives import Drives
    from toddle.outside.navigation.cloning_run import Gather, Judge, Plan, Run
    from toddle.outside.terminal import Stop

PROG = "toddle navigate clone"
_STOPPED = 130
_MOST = {
    "episodes": 100_000, "rounds": 100, "each": 100_000, "passes": 10**11, "seed": 4000, "judged": 10_000, "jobs": 1024,
    "first": 10**6,
}  # fmt: skip
_LEAST = {"rounds": 0, "seed": 0, "judged": 0, "first": 0}
_FIXED = (
    "dataset", "network", "depth", "memory", "heads", "dagger", "episodes", "rounds", "each", "passes", "rate", "seed",
    "noise", "anywhere", "eyes", "robot", "config", "first", "out",
)  # fmt: skip
_SOURCE = "source.json"


@dataclass(frozen=True)
class Clone:
    """A network learns to drive by what it sees, as a teacher drives.

    Given a dataset of toddle navigate record, it learns from that. Without one, the expert drives first, jolted now and
    then; then the network drives in rounds, and the expert says what it would have done (dataset aggregation). Rooms
    that it is validated and judged on are never learned from. A run leaves a folder with the policy, checkpoints,
    drives, figures, and files for TensorBoard. Ctrl-C ends it with what it has; --resume goes on bit for bit. The exit
    code is 1 where it diverged.

    Attributes:
        dataset: the folder of one, to learn from that alone.
        network: light, for CPUs; document: the U-Net with an LSTM of Huber 2019, which wants an accelerator.
        depth: let it see how far things are.
        memory: let it remember.
        heads: let it also learn to tell where the target and obstacles are.
        dagger: let it drive; else the expert drives as often instead.
        episodes: drives of the expert; 192 unless given.
        rounds: of the network's drives; 6 unless given.
        each: drives of a round; 72 unless given.
        passes: looks that are learned from in all; 700,000 unless given.
        rate: of Adam; 0.001 unless given.
        seed: of all that is drawn.
        noise: size of the expert's jolts, as in toddle navigate record.
        anywhere: share of drives that begin anywhere in the room.
        eyes: how the robot sees: a stereo pair, or small pictures by rays.
        judged: drives of each judgement, in rooms kept for it; 0: it is not judged, and the last network is kept.
        robot: a name (heicub), or the path of a humanoid's description.
        config: a TOML file that says what a humanoid's description leaves out.
        jobs: processes that drive; one for each core unless given.
        first: number of the first room of each scenario.
        resume: go on with the run in this folder.
        out: the folder to leave; runs/clone unless given.
        json: print one JSON object with the figures, and nothing else.
    """

    dataset: Annotated[Path | None, POSITIONAL] = None
    network: Literal["light", "document"] = "light"
    depth: bool = True
    memory: bool = True
    heads: bool = True
    dagger: bool = True
    episodes: int = 192
    rounds: int = 6
    each: int = 72
    passes: int = 700_000
    rate: float = 1e-3
    seed: int = 0
    noise: float = 1.0
    anywhere: float = 0.3
    eyes: Literal["stereo", "cast"] = "stereo"
    judged: int = 24
    robot: str = "heicub"
    config: Path | None = None
    jobs: int | None = None
    first: int = 0
    resume: Path | None = None
    out: Path | None = None
    json: bool = False


def main(argv: Sequence[str]) -> int:
    """Learn, judge, leave a folder; returns the exit code."""
    asked = parse(Clone, argv, prog=PROG)
    _check(asked)
    if asked.resume is not None:
        return _learned(_begun(asked), asked.resume)
    with left_folder(asked.out, "clone") as folder:
        return _learned(asked, folder)


def _check(asked: Clone) -> None:
    """Refuse what is out of range or contradicts itself before anything heavy is imported."""
    for name, most in _MOST.items():
        value, least = getattr(asked, name), _LEAST.get(name, 1)
        if value is not None and not least <= value <= most:
            raise BadInput(f"{value} is out of range", where=f"--{name}", remedy=f"give {least} to {most}")
    for name, most in (("noise", 10.0), ("anywhere", 1.0), ("rate", 1.0)):
        if not 0 <= getattr(asked, name) <= most or (name == "rate" and asked.rate == 0):
            raise BadInput(
                f"{getattr(asked, name):g} is out of range", where=f"--{name}", remedy=f"give up to {most:g}"
            )
    if asked.resume is None:
        refuse_used(asked.out)
        return
    fresh = Clone()
    if given := [name for name in _FIXED if getattr(asked, name) != getattr(fresh, name)]:
        flag = given[0] if given[0] == "dataset" else f"--{given[0]}"
        raise BadInput(f"{flag} can't be changed in a run that goes on", where=PROG, remedy="leave it out")


def _begun(asked: Clone) -> Clone:
    """What a run that goes on was begun with.

    Raises:
        BadInput: there is none.
    """
    import json

    path = asked.resume / _SOURCE if asked.resume is not None else Path(_SOURCE)
    try:
        facts = json.loads(path.read_bytes()[:100_000])
        told = {name: facts[name] for name in _FIXED if name != "out"}
        paths = {name: None if told[name] is None else Path(told[name]) for name in ("dataset", "config")}
        begun = replace(asked, **told | paths)
        _check(replace(begun, resume=None, out=None))
    except (OSError, LookupError, TypeError, ValueError) as fault:
        raise BadInput("there is no run here", where=str(asked.resume), remedy="name the folder of one") from fault
    return begun


def _learned(asked: Clone, folder: Path) -> int:
    from toddle.outside.files import write_json
    from toddle.outside.navigation.cloning_run import Cloning
    from toddle.outside.terminal import Reporter, stoppable

    began, config = time.perf_counter(), _config(asked)
    source = {name: _plain(getattr(asked, name)) for name in _FIXED if name != "out"}
    with stoppable() as stop, Reporter("looks learned from", config.passes, quiet=asked.json) as reporter:
        gather, judge, plan = _parts(asked, folder, config, source, stop)
        going_on = any((folder / f"checkpoint-{name}.json").exists() for name in "ab")
        if not going_on:
            write_json(folder / _SOURCE, source)
        cloning = Cloning(config, plan, gather, judge=judge, reporter=reporter, stop=stop)
        run = cloning.run(resume=going_on)
    figures = {**run.figures, "wall_seconds": time.perf_counter() - began}
    write_json(folder / "figures.json", figures)
    from toddle.cli.navigate_evaluate import tell

    tell(figures, folder, as_json=asked.json)
    return _ended(run, folder)


def _ended(run: Run, folder: Path) -> int:
    if run.progress.stopped is None:
        return 0
    print(f"toddle: {run.progress.stopped}; the policy is in {folder}", file=sys.stderr)
    if run.progress.diverged:
        return 1
    return _STOPPED if run.progress.stopped == "it was asked to stop" else 0


def _config(asked: Clone) -> CloningConfig:
    from toddle.navigate.cloning.config import CloningConfig, document

    config = document() if asked.network == "document" else CloningConfig()
    heads = asked.heads and asked.network == "light"
    return replace(config, depth=asked.depth, memory=asked.memory, heads=heads, passes=asked.passes, rate=asked.rate)


def _parts(
    asked: Clone, folder: Path, config: CloningConfig, source: dict[str, Any], stop: Stop
) -> tuple[Gather, Judge | None, Plan]:
    """Where episodes come from, who judges, and the plan."""
    from toddle.outside.navigation.cloning_drives import Aggregation, judge, kept
    from toddle.outside.navigation.cloning_run import Plan

    drives, told = _drives(asked), _teller(asked)
    judging = judge(drives, asked.judged, lambda: stop.asked, told) if asked.judged else None
    if asked.dataset is not None:
        episodes = kept(asked.dataset, damaged=lambda fault: print(f"toddle: {fault.line}; left out", file=sys.stderr))
        plan = Plan(folder, (config.passes,), source, asked.seed)
        return (lambda number, policy: episodes), judging, plan
    course = _course(asked)
    gather = Aggregation(drives, course, folder, lambda: stop.asked, told, asked.first)
    stages = tuple(stage.passes for stage in course.stages)
    return gather, judging, Plan(folder, stages, source, asked.seed, held=0.05, judgements=1)


def _course(asked: Clone) -> Course:
    from toddle.navigate.cloning.dagger import Course

    return Course(asked.episodes, asked.rounds, asked.each, asked.passes, dagger=asked.dagger)


def _drives(asked: Clone) -> Drives:
    from toddle.outside.navigation.cloning_drives import Drives
    from toddle.outside.navigation.room_eyes import EyeOptions

    return Drives(
        asked.robot, asked.config, EyeOptions(asked.eyes), asked.noise, asked.anywhere, seed=asked.seed, jobs=asked.jobs
    )


def _teller(asked: Clone) -> Callable[[int, int, int, str], None]:
    """Says how drives go, now and then."""
    last = [0.0]

    def tell(done: int, wanted: int, reached: int, called: str) -> None:
        if not asked.json and (time.monotonic() - last[0] > 10.0 or done == wanted):
            last[0] = time.monotonic()
            print(f"{called}: {done} of {wanted} drives, {reached} reached the target", file=sys.stderr, flush=True)

    return tell


def _plain(value: Any) -> Any:
    return str(value) if isinstance(value, Path) else value
