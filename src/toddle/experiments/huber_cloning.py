"""A network that learned to drive by watching (Huber 2019, section 4.2.3 and 4.2.4, figures 4.16 to 4.25).

On drives of the expert in rooms that nobody learned from: what the network says at each look beside what the expert
asked for. Then the network drives, in physics, through rooms of the test split, and so does the expert; and the
network once more in a style of rooms that was kept out of training. In full, parts are left out one by one, at equal
drives and passes. With ``--data DIR`` nothing is learned: the policy in DIR is judged, or those in its folders
``light-SEED`` and ``KIND-SEED``, as `KINDS` names them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from toddle.experiments import huber_cloning_tables as tables
from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.failures import BadInput
from toddle.navigate.cloning.config import CloningConfig
from toddle.navigate.cloning.dagger import Course
from toddle.navigate.cloning.episodes import Episode, episode
from toddle.navigate.cloning.measures import AHEAD, TURNING, counts, divergence
from toddle.navigate.cloning.policy import Cloned
from toddle.navigate.cloning.recording import RoomKey
from toddle.navigate.cloning.training import validation
from toddle.navigate.scenarios.rooms import SCENARIOS, Scenario, Style
from toddle.navigate.task import Outcome as End
from toddle.outside.navigation.cloned import cloned
from toddle.outside.navigation.cloning_files import load_cloned
from toddle.outside.navigation.physics_batch import Recipe
from toddle.outside.navigation.room_batch import Drive, Judged, keys, run_rooms
from toddle.outside.navigation.room_eyes import EyeOptions
from toddle.outside.navigation.room_judging import figures_of
from toddle.outside.navigation.room_policies import is_cloned
from toddle.outside.navigation.room_run import RoomFinish, RoomRules

KINDS: dict[str, dict[str, bool]] = {
    "all": {},
    "no-depth": {"depth": False},
    "no-memory": {"memory": False},
    "no-heads": {"heads": False},
    "no-dagger": {"dagger": False},
}
"""What is left out; ``dagger`` is of the course, without which it learns from the jolted expert's drives alone."""

_CLEAR = 1000  # rooms of the validation split that the choice of a network has not used


@dataclass(frozen=True)
class Parameters:
    """Of the experiment.

    Attributes:
        seeds: networks.
        scenarios: that are driven; networks learn from all.
        course: what they learn from.
        judged: drives by which the best moment of a run is chosen; 0: the last one.
        drives: of each network through each scenario, and of the expert.
        validation: drives of the expert through each scenario at which both are compared.
        eyes: how the robot sees.
        seconds: a drive is late after.
        kinds: of networks that are compared, from `KINDS`.
        compared: what they learn from.
        compared_drives: of each of them through each scenario.
        jobs: processes that drive; None: one for each core.
    """

    seeds: int = 3
    scenarios: tuple[Scenario, ...] = SCENARIOS
    course: Course = field(default_factory=Course)
    judged: int = 24
    drives: int = 34
    validation: int = 12
    eyes: EyeOptions = field(default_factory=EyeOptions)
    seconds: float = 90.0
    kinds: tuple[str, ...] = tuple(KINDS)
    compared: Course = field(default_factory=lambda: Course(96, 3, 48, 250_000))
    compared_drives: int = 17
    jobs: int | None = None


FULL = Parameters()
QUICK = Parameters(
    seeds=1, course=Course(6, 1, 3, 4096), judged=0, drives=1, validation=1, eyes=EyeOptions("cast"), seconds=45.0,
    kinds=(),
)  # fmt: skip


def run(task: Task) -> Outcome:
    """Learn, or take what is there; compare at looks; drive; leave parts out."""
    parameters = FULL if task.full else QUICK
    if task.seeds is not None:
        parameters = replace(parameters, seeds=task.seeds)
    learned = _learned_or_given(task.part(0.0, 0.3), parameters)
    if task.data is not None:
        eyes = EyeOptions("cast" if load_cloned(learned[0]).source.get("eyes") == "cast" else "stereo")
        parameters = replace(parameters, seeds=len(learned), eyes=eyes, seconds=FULL.seconds)
    alike = _at_looks(task.part(0.3, 0.4), parameters, learned)
    expert, each, unseen = _driven(task.part(0.4, 0.7), parameters, learned)
    seen = [finish for those in each for finish in those]
    compared = _compared(task.part(0.7, 1.0), parameters)
    tables.draw(task.folder, learned, alike, seen, expert)
    balance = {"expert": tables.balance(expert), "network": tables.balance(seen)}
    figures: dict[str, Any] = {
        "networks": [path.name for path in learned],
        "looks": {name: value for name, value in alike.items() if name != "said"},
        "network": figures_of(seen),
        "each_network": [figures_of(those) for those in each],
        "expert": figures_of(expert),
        "unseen_style": figures_of(unseen),
        "balance": balance,
        "compared": compared,
    }
    rows = [*tables.rows_of_looks(alike), *tables.rows_of_drives(figures), *tables.rows_of_balance(balance)]
    rows += [Row("a decision, median", figures["network"]["inference_ms_median"], tables.PRINTED_MS, "ms")]
    rows += [Row(f"{name}, reached", 100 * one["success_rate"], None, "%") for name, one in compared.items()]
    verdict, holds = tables.verdict(figures, balance)
    if not task.full:
        looks = "" if task.data is not None else f", and a network of {parameters.course.passes:,} looks,"
        verdict += f"; so few drives{looks} prove nothing"
    return Outcome(tuple(rows), verdict, holds, parameters, figures)


class _Teller:
    """Passes on what a run tells, and whether somebody asked it to stop."""

    def __init__(self, task: Task, passes: int, name: str) -> None:
        from toddle.outside.terminal import Stop

        self._task, self._passes, self._name, self._share, self.stop = task, passes, name, 0.0, Stop()

    def tell(self, done: int, news: str) -> None:
        """So many looks were learned from."""
        self.stop.asked = self._task.stopped()
        self._share = min(done / self._passes, 1.0)
        self._task.tell(self._share, f"{self._name}: {news}")

    def drove(self, made: int, wanted: int, reached: int, called: str) -> None:
        """One drive more was driven to learn from, or to judge by."""
        self._task.tell(self._share, f"{self._name}: {called} has driven {made} of {wanted}, {reached} reached")


def _learned_or_given(task: Task, parameters: Parameters) -> list[Path]:
    """Folders of networks, one of each seed.

    Raises:
        BadInput: the folder of the data holds none, or it was stopped before there was any.
    """
    if task.data is not None:
        if is_cloned(task.data):
            return [task.data]
        if found := _given(task.data, "light"):
            return found
        raise BadInput(
            "it holds no network", where=f"--data {task.data}", remedy="give what toddle navigate clone left"
        )
    found = []
    for number in range(parameters.seeds):
        part = task.part(number / parameters.seeds, (number + 1) / parameters.seeds)
        folder = task.folder / f"light-{task.seed + number}"
        if _learn(part, folder, "all", parameters.course, task.seed + number, parameters):
            found.append(folder)
    if not found:
        raise BadInput("it was stopped before anything was learned", where="huber-cloning", remedy="let it run longer")
    return found


def _given(data: Path, kind: str) -> list[Path]:
    return [one for one in sorted(data.glob(f"{kind}-[0-9]*")) if is_cloned(one)]


def _learn(task: Task, folder: Path, kind: str, course: Course, seed: int, parameters: Parameters) -> bool:
    """One run; whether it left a network."""
    from toddle.outside.navigation.cloning_drives import Aggregation, Drives, judge
    from toddle.outside.navigation.cloning_run import Cloning, Plan

    if task.stopped():
        return False
    left_out = KINDS[kind]
    course = replace(course, dagger=left_out.get("dagger", True))
    parts = {name: value for name, value in left_out.items() if name != "dagger"}
    config = replace(CloningConfig(), passes=course.passes, **parts)
    teller = _Teller(task, course.passes, folder.name)
    drives = Drives(eyes=parameters.eyes, seconds=min(60.0, parameters.seconds), seed=seed, jobs=parameters.jobs)
    gather = Aggregation(drives, course, folder, task.stopped, teller.drove)
    judging = judge(drives, parameters.judged, task.stopped, teller.drove) if parameters.judged else None
    stages = tuple(stage.passes for stage in course.stages)
    source = {"experiment": "huber-cloning", "kind": kind, "eyes": parameters.eyes.kind}
    plan = Plan(folder, stages, source, seed, held=0.05, judgements=1)
    try:
        Cloning(config, plan, gather, judge=judging, reporter=teller, stop=teller.stop).run()
    except BadInput:
        if not task.stopped():
            raise
    return is_cloned(folder)


def _drives(
    task: Task, recipe: Recipe, parameters: Parameters, rooms: Sequence[RoomKey], *, sees: bool = True, kept: int = 0
) -> list[Drive]:
    """Drives that were driven before somebody stopped it."""
    how = Judged(
        recipe, parameters.eyes if sees else None, RoomRules(seconds=parameters.seconds), seed=task.seed, kept=kept
    )
    won: list[bool] = []

    def told(_: int, drive: Drive) -> None:
        won.append(drive.finish.outcome == End.WON)
        task.tell(len(won) / len(rooms), f"{sum(won)} of {len(won)} drives reached")

    found = run_rooms(how, rooms, processes=parameters.jobs, progress=told, stopped=task.stopped)
    return [drive for drive in found if drive is not None]


def _expert() -> Recipe:
    from toddle.outside.dataset.drives import expert

    return Recipe(expert, ())


def _at_looks(task: Task, parameters: Parameters, learned: Sequence[Path]) -> dict[str, Any]:
    """The expert drives; at each of its looks the networks say what they would have asked for."""
    rooms = keys(parameters.validation, parameters.scenarios, "validation", first=_CLEAR)
    drives = _drives(task, _expert(), parameters, rooms, kept=_CLEAR + parameters.validation)
    episodes = [episode(drive.recording) for drive in drives if drive.recording is not None]
    if not episodes:
        return {"looks": 0, "networks": [], "said": []}
    taught = np.concatenate([one.taught for one in episodes]).astype(float)
    networks, said = [], []
    for folder in learned:
        policy = load_cloned(folder)
        says = predicted(policy, episodes)
        loss = validation(policy.network, policy.scale, policy.config, episodes)
        networks.append(
            {"kullback_leibler_ahead": divergence(counts(taught[:, 0], AHEAD), counts(says[:, 0], AHEAD)),
             "kullback_leibler_turning": divergence(counts(taught[:, 1], TURNING), counts(says[:, 1], TURNING)),
             "mean_error_ahead": float(np.abs(says[:, 0] - taught[:, 0]).mean()),
             "mean_error_turning": float(np.abs(says[:, 1] - taught[:, 1]).mean()),
             "loss_command": float(loss.command)}
        )  # fmt: skip
        said.append((taught, says))
    return {"looks": len(taught), "networks": networks, "said": said}


def predicted(policy: Cloned, episodes: Sequence[Episode]) -> Float[np.ndarray, "looks 2"]:
    """What a network says at each look of drives that somebody else drove, in their order."""
    decide, found = jax.jit(policy.__call__), []
    for one in episodes:
        memory = policy.start()
        for picture, depth, felt in zip(one.picture, one.depth, one.felt, strict=True):
            metres = depth.astype(np.float32) / np.float32(1000)
            says, memory = decide(jnp.asarray(picture), jnp.asarray(metres), jnp.asarray(felt), memory)
            found.append(np.asarray(says, float))
    return np.array(found).reshape(-1, 2)


def _driven(
    task: Task, parameters: Parameters, learned: Sequence[Path]
) -> tuple[list[RoomFinish], list[list[RoomFinish]], list[RoomFinish]]:
    """The expert; each network in rooms of its own, the first one's being the expert's; all in the unseen style."""
    count, parts = parameters.drives, 2 * len(learned) + 1
    expert = _drives(task.part(0.0, 1 / parts), _expert(), parameters, keys(count, parameters.scenarios), sees=False)
    seen, unseen = [], []
    for number, folder in enumerate(learned):
        recipe, at = Recipe(cloned, (folder,)), 1 + 2 * number
        styles: tuple[tuple[Style, list[list[RoomFinish]]], ...] = (("seen", seen), ("unseen", unseen))
        for style, among in styles:
            rooms = keys(count, parameters.scenarios, style=style, first=number * count)
            drives = _drives(task.part(at / parts, (at + 1) / parts), recipe, parameters, rooms)
            among.append([drive.finish for drive in drives])
            at += 1
    return [drive.finish for drive in expert], seen, [finish for those in unseen for finish in those]


def _compared(task: Task, parameters: Parameters) -> dict[str, dict[str, Any]]:
    """What each part is worth: networks without it, all their drives together."""
    found = {}
    for at, kind in enumerate(parameters.kinds):
        part = task.part(at / len(parameters.kinds), (at + 1) / len(parameters.kinds))
        folders = _given(task.data, kind) if task.data is not None else []
        if task.data is None:
            for number in range(parameters.seeds):
                folder = task.folder / f"{kind}-{task.seed + number}"
                if _learn(part, folder, kind, parameters.compared, task.seed + number, parameters):
                    folders.append(folder)
        finishes = []
        for number, folder in enumerate(folders):
            rooms = keys(parameters.compared_drives, parameters.scenarios, first=number * parameters.compared_drives)
            finishes += [one.finish for one in _drives(part, Recipe(cloned, (folder,)), parameters, rooms)]
        if finishes:
            found[kind] = {"networks": len(folders), **figures_of(finishes)}
    return found


EXPERIMENT = Experiment("huber-cloning", "Huber 2019, sections 4.2.3 and 4.2.4, figures 4.16-4.25", run)
