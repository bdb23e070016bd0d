"""A run of proximal policy optimization in the world: told about, judged, saved, stopped, taken up again.

begin or resume --> some updates --> trouble? --> judge --> save --> some updates --> ...
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol, cast, runtime_checkable

import jax
import jax.numpy as jnp
import numpy as np

from toddle.failures import BadInput
from toddle.navigate.policy import Policy
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.sharding import shard
from toddle.navigate.ppo.training import Training
from toddle.navigate.task import Actions, Outcome, Task
from toddle.outside.files import make_folder
from toddle.outside.navigation import ppo_course
from toddle.outside.navigation.policy_files import save_policy
from toddle.outside.navigation.ppo_course import Advance, Course, Drive, Judge, Mark
from toddle.outside.navigation.tensorboard import Board
from toddle.outside.navigation.training_files import History, load_training, read_figures, save_training
from toddle.outside.terminal import Stop

_PACE = 0.5  # between two calls [s]


@runtime_checkable
class Spaces(Protocol):
    """What is known of a task that is stepped elsewhere."""

    @property
    def observations(self) -> int:
        """How many numbers an observation has."""
        ...

    @property
    def actions(self) -> Actions:
        """What may be done."""
        ...


@runtime_checkable
class Tells(Protocol):
    """Such as `toddle.outside.terminal.Reporter`."""

    def tell(self, done: int, news: str) -> None:
        """So much is done, and this is new."""
        ...


@dataclass(frozen=True)
class Plan:
    """Where a run is kept, and how often it is looked at.

    Attributes:
        folder: of the run.
        name: of the task, for the figures.
        source: how the task is made again, for who loads a policy or resumes the run: plain values.
        seed: of the first run.
        seeds: runs side by side, each with the next seed.
        saved_every: updates between two checkpoints.
        judged_every: updates between two trials.
        devices: that share the actors; one seed only.
    """

    folder: Path
    name: str
    source: Mapping[str, Any]
    seed: int = 0
    seeds: int = 1
    saved_every: int = 50
    judged_every: int = 25
    devices: int = 1

    def __post_init__(self) -> None:
        """Refuses counts below one.

        Raises:
            BadInput: which.
        """
        for name in ("seeds", "saved_every", "judged_every", "devices"):
            if getattr(self, name) < 1:
                where = f"--{name.replace('_', '-')}"
                raise BadInput(f"{getattr(self, name)} is no use", where=where, remedy="give 1 or more")

    @property
    def folders(self) -> tuple[Path, ...]:
        """Where each seed's policy is kept."""
        if self.seeds == 1:
            return (self.folder,)
        return tuple(self.folder / f"seed-{self.seed + number}" for number in range(self.seeds))


@dataclass(frozen=True, eq=False)
class Run:
    """What a run came to.

    Attributes:
        policies: what each seed learned: the best that was judged, else the last sound one.
        history: parts of `toddle.navigate.ppo.training.Report` by name; leading axes: seeds, updates.
        figures: plain values.
        stopped: why it ended before its time, in words; None: it didn't.
        diverged: no seed was left to go on with: a failure.
        training: where it is; with a leading axis of seeds where there are several.
    """

    policies: tuple[Policy, ...]
    history: History
    figures: Mapping[str, Any]
    stopped: str | None
    diverged: bool
    training: Training

    @property
    def policy(self) -> Policy:
        """The first seed's."""
        return self.policies[0]


def run(
    task: Task[Any] | Spaces,
    config: PpoConfig,
    plan: Plan,
    *,
    judge: Judge | None = None,
    advance: Advance | None = None,
    begun: Training | None = None,
    resume: bool = False,
    reporter: Tells | None = None,
    stop: Stop | None = None,
) -> Run:
    """Learn to the end, to trouble, or until somebody asks to stop; leaves checkpoints, policies, and event files.

    Args:
        task: what is learned; of one that is stepped elsewhere, its spaces.
        config: how.
        plan: where it is kept, and how often it is looked at.
        judge: tries policies out; without one the last is kept.
        advance: makes an update, for tasks that are not stepped in JAX; it begins with ``begun``.
        begun: the run before its first update, see ``advance``.
        resume: take up the run that is in the folder, with its own seeds.
        reporter: is told how far it has come, in steps of each seed.
        stop: is looked at twice a second.

    Raises:
        BadInput: the folder can't be used, what is in it does not fit, or several seeds are to be stepped elsewhere.
    """
    if advance is not None and (begun is None or plan.seeds > 1):
        raise BadInput("it is learned by one seed at a time", where=plan.name, remedy="leave --seeds out")
    if resume:
        figures = read_figures(plan.folder)
        plan = replace(plan, seed=int(figures["seed"]), seeds=int(figures["seeds"]))
    make_folder(plan.folder)
    watch = _Watch(task, config, plan, judge, reporter, stop)
    started = time.perf_counter()
    course = _first(watch, begun, resume)
    if plan.devices > 1:
        course = course._replace(training=_spread(plan, course.training))
    if advance is None:
        drive = _in_jax(watch)
        jax.block_until_ready(drive(course.training, 0))  # no update: it is only compiled
    else:
        drive = ppo_course.one_by_one(advance)
    compiling = time.perf_counter() - started
    course = _followed(watch, course, drive, compiling)
    diverged = None not in course.troubles
    if not diverged and (course.done % plan.saved_every or not course.pieces):
        _save(watch, course, compiling)
    stopped = _why(course, config)
    policies = _policies(watch, course, compiling)
    for policy, folder in zip(policies, plan.folders, strict=True):
        save_policy(policy, folder)
    figures = _figures(watch, course, compiling)
    return Run(policies, course.history if course.pieces else {}, figures, stopped, diverged, course.training)


@dataclass(frozen=True, eq=False)
class _Watch:
    """What is asked for, in one place."""

    task: Any
    config: PpoConfig
    plan: Plan
    judge: Judge | None
    reporter: Tells | None
    stop: Stop | None


def _in_jax(watch: _Watch) -> Drive:
    task, config, seeds = watch.task, watch.config, watch.plan.seeds
    return lambda training, count: ppo_course.updates(task, config, seeds, training, jnp.int32(count))


def _spread(plan: Plan, training: Training) -> Training:
    """The actors shared by devices.

    Raises:
        BadInput: there are too few devices, they can't share evenly, or there are several seeds.
    """
    if plan.seeds > 1:
        raise BadInput("several seeds lie on one device", where="--devices", remedy="leave --seeds or it out")
    there = jax.devices()
    if plan.devices > len(there):
        raise BadInput(f"there are {len(there)}", where="--devices", remedy=f"give 1 to {len(there)}")
    return shard(training, there[: plan.devices])


def _first(watch: _Watch, begun: Training | None, resume: bool) -> Course:
    """A new run, or the one that is in the folder."""
    plan, config = watch.plan, watch.config

    def fresh() -> Training:
        return ppo_course.beginning(watch.task, config, jnp.int32(plan.seed), plan.seeds)

    if not resume:
        return ppo_course.began(fresh() if begun is None else begun, plan.seeds)
    saved = load_training(plan.folder, begun if begun is not None else jax.eval_shape(fresh))
    if saved.config != replace(config, steps=saved.config.steps):
        raise BadInput("it was begun with other numbers", where=str(plan.folder), remedy="leave them out to go on")
    facts, known = saved.figures, cast(Sequence[Any], saved.figures["marks"])
    marks = tuple(None if one is None else Mark(int(one["update"]), dict(one["figures"])) for one in known)
    pieces = (saved.history,) if saved.history else ()
    return Course(
        saved.training, pieces, int(facts["updates"]), tuple(facts["troubles"]), marks, saved.best,
        float(facts["seconds"]),
    )  # fmt: skip


def _followed(watch: _Watch, course: Course, drive: Drive, compiling: float) -> Course:
    """To the end, to trouble, or until somebody asks to stop."""
    plan, config, count = watch.plan, watch.config, 1
    with ExitStack() as stack:
        begins = course.done * config.batch + 1 if course.done else None
        boards = [stack.enter_context(Board(folder / "tensorboard", begins)) for folder in plan.folders]
        while not _why_not(watch, course):
            seconds, before = course.seconds, course.done
            course = ppo_course.driven(course, drive, _until(watch, course.done, count), watch.task.actions)
            pace = (course.done - before) / (course.seconds - seconds)  # updates a second
            count = max(1, min(ppo_course.ROOM, int(_PACE * pace)))
            for seed, board in enumerate(boards):
                board.tell({name: rows[seed] for name, rows in course.pieces[-1].items()}, config.batch * pace)
            if watch.reporter is not None:
                watch.reporter.tell(course.done * config.batch, _news(course, plan.seeds * config.batch * pace))
            if watch.judge is not None and (course.done % plan.judged_every == 0 or course.done == config.updates):
                policies = ppo_course.seen_policies(course, config, watch.task.actions, plan.source)
                course = ppo_course.judged(course, watch.judge, policies)
            if course.done % plan.saved_every == 0 and None in course.troubles:
                _save(watch, course, compiling)
    return course


def _why_not(watch: _Watch, course: Course) -> bool:
    """Whether nothing more is to be done."""
    asked = watch.stop is not None and watch.stop.asked
    return asked or course.done >= watch.config.updates or None not in course.troubles


def _why(course: Course, config: PpoConfig) -> str | None:
    if None not in course.troubles:
        return course.troubles[0]
    return None if course.done >= config.updates else "it was asked to stop"


def _until(watch: _Watch, done: int, count: int) -> int:
    """So many updates, but none past the next trial, checkpoint or the end."""
    every = [watch.plan.saved_every] + ([watch.plan.judged_every] if watch.judge is not None else [])
    return min(count, watch.config.updates - done, *(one - done % one for one in every))


def _news(course: Course, speed: float) -> str:
    """The mean over the sound seeds of the last call."""
    rows = course.pieces[-1]
    episodes, outcomes = rows["episodes"].sum(), rows["outcomes"].sum(axis=(0, 1))
    total = np.nansum(np.where(rows["episodes"] > 0, rows["return_"] * rows["episodes"], 0.0))
    told = f"return {total / episodes:.3g}, {outcomes[Outcome.WON] / episodes:.0%} won, " if episodes else ""
    return f"{told}reward {np.nanmean(rows['reward']):.3g}, {speed:,.0f} steps/s"


def _save(watch: _Watch, course: Course, compiling: float) -> None:
    """A checkpoint, and the policies as they would be if it ended here."""
    facts = {
        "seed": watch.plan.seed,
        "seeds": watch.plan.seeds,
        "updates": course.done,
        "troubles": list(course.troubles),
        "marks": [None if mark is None else mark._asdict() for mark in course.marks],
        "seconds": course.seconds,
    }
    history = course.history if course.pieces else {}
    plan = watch.plan
    save_training(plan.folder, watch.config, course.training, history, plan.source, figures=facts, best=course.best)
    for policy, folder in zip(_policies(watch, course, compiling), plan.folders, strict=True):
        save_policy(policy, folder)


def _policies(watch: _Watch, course: Course, compiling: float) -> tuple[Policy, ...]:
    """What each seed would leave now."""
    found = ppo_course.seen_policies(course, watch.config, watch.task.actions, watch.plan.source, best=True)
    figures = _figures(watch, course, compiling)
    return tuple(
        replace(policy, figures=figures | {"seed": watch.plan.seed + seed} | _marked(course.marks[seed]))
        for seed, policy in enumerate(found)
    )


def _marked(mark: Mark | None) -> dict[str, Any]:
    return {} if mark is None else {"best_update": mark.update, "judged": dict(mark.figures)}


def _figures(watch: _Watch, course: Course, compiling: float) -> dict[str, Any]:
    """Of all seeds together."""
    plan, steps = watch.plan, course.done * watch.config.batch * watch.plan.seeds
    figures = {
        "env": plan.name,
        "seed": plan.seed,
        "seeds": plan.seeds,
        "updates": course.done,
        "steps": steps,
        "train_seconds": course.seconds,
        "compile_seconds": compiling,
        "steps_per_second": steps / course.seconds if course.seconds else None,
        "stopped": _why(course, watch.config),
        "troubles": list(course.troubles),
    }
    return figures | (_marked(course.marks[0]) if plan.seeds == 1 else {"marks": [_marked(m) for m in course.marks]})
