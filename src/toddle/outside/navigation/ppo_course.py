"""A run of one or several seeds side by side between two calls, and the steps that it goes on by.

What is learned doesn't depend on how many updates go into one call: that number is an argument of the compiled
program, no constant of it. So nothing is compiled anew for a shorter last call, and a resumed run goes on bit for bit.
A seed in trouble is held where it was last sound; the others go on.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Int

from toddle.navigate.policy import Policy, policy_of
from toddle.navigate.ppo.config import PpoConfig
from toddle.navigate.ppo.moments import Moments
from toddle.navigate.ppo.network import ActorCritic
from toddle.navigate.ppo.training import Report, Training, init, iterate
from toddle.navigate.ppo.trouble import trouble
from toddle.navigate.task import Actions, Task
from toddle.outside.navigation.training_files import History

ROOM = 64
"""Updates in one call at most."""

Advance = Callable[[Training], tuple[Training, Report]]
"""One update, wherever it is made."""
Drive = Callable[[Training, int], tuple[Training, Report]]
"""So many updates; the report's parts get a leading axis, which may be longer."""
Judge = Callable[[Policy], Mapping[str, Any]]
"""A trial without noise: figures, ``score`` among them, which the best policy has the greatest of."""


class Mark(NamedTuple):
    """How the best policy of a seed did.

    Attributes:
        update: after which it was judged.
        figures: of its trial; ``score`` among them.
    """

    update: int
    figures: Mapping[str, Any]


class Course(NamedTuple):
    """A run between two calls. What was learned has a leading axis of seeds where there are several.

    Attributes:
        training: where it is.
        pieces: of its history, one a call; leading axes: seeds, updates.
        done: updates.
        troubles: of each seed, None: it is sound.
        marks: of the best policy of each seed, None: none was judged yet.
        best: these policies' networks and moments.
        seconds: spent on updates.
    """

    training: Training
    pieces: tuple[History, ...]
    done: int
    troubles: tuple[str | None, ...]
    marks: tuple[Mark | None, ...]
    best: tuple[ActorCritic, Moments] | None
    seconds: float

    @property
    def seeds(self) -> int:
        """How many run side by side."""
        return len(self.troubles)

    @property
    def history(self) -> dict[str, np.ndarray]:
        """All of it, by the names of `toddle.navigate.ppo.training.Report`; leading axes: seeds, updates."""
        return {name: np.concatenate([piece[name] for piece in self.pieces], axis=1) for name in self.pieces[0]}


def began(training: Training, seeds: int) -> Course:
    """A run before its first update."""
    none = (None,) * seeds
    return Course(training, (), 0, none, none, None, 0.0)


@partial(jax.jit, static_argnums=(0, 1, 3))
def beginning(task: Task[Any], config: PpoConfig, seed: Int[Array, ""], seeds: int) -> Training:
    """The first state of each run: the k-th by the k-th seed from the one given."""
    if seeds == 1:
        return init(task, config, jax.random.key(seed))
    return jax.vmap(lambda one: init(task, config, jax.random.key(one)))(seed + jnp.arange(seeds))


@partial(jax.jit, static_argnums=(0, 1, 2))
def updates(
    task: Task[Any], config: PpoConfig, seeds: int, training: Training, count: Int[Array, ""]
) -> tuple[Training, Report]:
    """So many updates, at most `ROOM`; the reports' first rows are filled."""
    one = partial(iterate, task, config)
    step = jax.vmap(one) if seeds > 1 else one
    room = jax.tree.map(lambda part: jnp.zeros((ROOM, *part.shape), part.dtype), jax.eval_shape(step, training)[1])

    def following(number: Array, now: tuple[Training, Report]) -> tuple[Training, Report]:
        after, report = step(now[0])
        return after, jax.tree.map(lambda all_, row: all_.at[number].set(row), now[1], report)

    return jax.lax.fori_loop(0, count, following, (training, room))


def one_by_one(advance: Advance) -> Drive:
    """Updates that are made elsewhere, each in a call of its own."""

    def drive(training: Training, count: int) -> tuple[Training, Report]:
        reports = []
        for _ in range(count):
            training, report = advance(training)
            reports.append(report)
        return training, jax.tree.map(lambda *rows: np.stack([np.asarray(row) for row in rows]), *reports)

    return drive


def driven(course: Course, drive: Drive, count: int, actions: Actions) -> Course:
    """After so many updates more, as many of them as were sound."""
    started = time.perf_counter()
    training, report = drive(course.training, count)
    rows = {name: _by_seed(np.asarray(part)[:count], course.seeds) for name, part in report._asdict().items()}
    took = time.perf_counter() - started
    found = tuple(
        before or trouble(_report_of(rows, seed), actions) or _broken(training, seed, course.seeds)
        for seed, before in enumerate(course.troubles)
    )
    sound = np.array([one is None for one in found])
    held = np.array([one is not None for one in course.troubles])
    rows = {name: _blank(part, held) for name, part in rows.items()}
    return course._replace(
        training=_chosen(sound, training, course.training),
        pieces=(*course.pieces, rows),
        done=course.done + count,
        troubles=found,
        seconds=course.seconds + took,
    )


def judged(course: Course, judge: Judge, policies: tuple[Policy, ...]) -> Course:
    """After a trial of each sound seed's policy; the better one of now and before is kept."""
    now = (course.training.network, course.training.observations)
    marks, better = list(course.marks), np.zeros(course.seeds, bool)
    for seed, policy in enumerate(policies):
        if course.troubles[seed] is None:
            mark, before = Mark(course.done, dict(judge(policy))), marks[seed]
            better[seed] = before is None or mark.figures["score"] > before.figures["score"]
            marks[seed] = mark if better[seed] else before
    best = now if course.best is None else _chosen(better, now, course.best)
    return course._replace(marks=tuple(marks), best=best)


def seen_policies(
    course: Course, config: PpoConfig, actions: Actions, source: Mapping[str, Any], *, best: bool = False
) -> tuple[Policy, ...]:
    """What each seed has learned so far, or what did best."""
    training = course.training
    if best and course.best is not None:
        training = training._replace(network=course.best[0], observations=course.best[1])
    each = [training] if course.seeds == 1 else [_of_seed(training, seed) for seed in range(course.seeds)]
    return tuple(policy_of(one, config, actions, source) for one in each)


def _of_seed(tree: Any, seed: int) -> Any:
    return jax.tree.map(lambda part: part[seed], tree)


def _report_of(rows: History, seed: int) -> Report:
    return Report(**{name: jnp.asarray(part[seed]) for name, part in rows.items()})


def _by_seed(rows: np.ndarray, seeds: int) -> np.ndarray:
    return rows[None] if seeds == 1 else np.moveaxis(rows, 1, 0)


def _broken(training: Training, seed: int, seeds: int) -> str | None:
    """Networks that aren't finite: what they led to will only be seen in the next update."""
    for leaf in jax.tree.leaves((training.network, training.observations)):
        part = np.asarray(leaf)
        if not np.isfinite(part if seeds == 1 else part[seed]).all():
            return "the networks are no longer finite; learn more slowly (--learning-rate)"
    return None


def _blank(rows: np.ndarray, held: np.ndarray) -> np.ndarray:
    """Seeds that were held have made nothing."""
    nothing = np.nan if np.issubdtype(rows.dtype, np.floating) else 0
    return np.where(held.reshape(-1, *[1] * (rows.ndim - 1)), np.asarray(nothing, rows.dtype), rows)


def _chosen(which: np.ndarray, one: Any, other: Any) -> Any:
    """For each seed one tree or the other."""
    if which.all() or not which.any():
        return one if which.all() else other

    def choose(a: Any, b: Any) -> Any:
        return jnp.where(which.reshape(-1, *[1] * (a.ndim - 1)), a, b)

    return jax.tree.map(choose, one, other)
