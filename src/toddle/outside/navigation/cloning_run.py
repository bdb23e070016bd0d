"""A run of learning to steer by watching, in the world: told about, judged, saved, stopped, taken up again.

episodes of a stage --> gradient steps --> trouble? --> judge --> save --> ... --> episodes of the next stage --> ...
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import jax
import numpy as np

from toddle.failures import BadInput
from toddle.navigate.cloning import training as steps
from toddle.navigate.cloning.config import CloningConfig
from toddle.navigate.cloning.episodes import Episode, looks, split_by_room
from toddle.navigate.cloning.objective import Losses
from toddle.navigate.cloning.policy import Cloned
from toddle.navigate.cloning.training import Training
from toddle.outside.files import make_folder
from toddle.outside.navigation.cloning_files import Saved, load_run, save_cloned, save_run
from toddle.outside.navigation.ppo_run import Tells
from toddle.outside.navigation.tensorboard import Board
from toddle.outside.terminal import Stop

_ROW = 20  # gradient steps between two rows of the history

Gather = Callable[[int, Cloned | None], Sequence[Episode] | None]
"""From a stage's number and what has been learned so far to all episodes there then are; None: somebody stopped it."""

Judge = Callable[[Cloned], float | None]
"""The share of drives that reached the target, closed loop; None: somebody stopped it."""


@dataclass(frozen=True)
class Plan:
    """Where a run is kept, and how often it is looked at.

    Attributes:
        folder: of the run.
        stages: looks that are learned from in each.
        source: what it learns from, for who loads it: plain values.
        seed: of all that is drawn.
        held: share of the rooms that are validated on, where the episodes name none.
        saved_every: gradient steps between two checkpoints.
        judgements: how often the last stage is judged, evenly, the last one at its end.
        patience: it ends early after so many judgements in a row that were no better.
    """

    folder: Path
    stages: tuple[int, ...]
    source: Mapping[str, Any] = field(default_factory=dict)
    seed: int = 0
    held: float = 0.1
    saved_every: int = 200
    judgements: int = 3
    patience: int = 3


@dataclass(frozen=True, eq=False)
class Progress:
    """How far a run has come.

    Attributes:
        training: the run; None: it has not begun.
        stage: that it is in.
        made: gradient steps made in it.
        done: in all.
        rows: the history's columns.
        scores: gradient steps done and score of each judgement.
        best: what did best.
        seconds: spent on gradient steps.
        stopped: why it ended before its time; None: it did not.
        diverged: it went wrong.
    """

    training: Training | None = None
    stage: int = 0
    made: int = 0
    done: int = 0
    rows: Mapping[str, np.ndarray] = field(default_factory=dict)
    scores: tuple[tuple[int, float], ...] = ()
    best: Training | None = None
    seconds: float = 0.0
    stopped: str | None = None
    diverged: bool = False


@dataclass(frozen=True, eq=False)
class Run:
    """What a run came to.

    Attributes:
        policy: the best that was judged, else the last sound one.
        progress: how far it came.
        figures: plain values.
    """

    policy: Cloned
    progress: Progress
    figures: Mapping[str, Any]


class Cloning:
    """A run under way."""

    def __init__(
        self,
        config: CloningConfig,
        plan: Plan,
        gather: Gather,
        *,
        judge: Judge | None = None,
        reporter: Tells | None = None,
        stop: Stop | None = None,
    ) -> None:
        """Ready to begin or to go on.

        Args:
            config: how it learns.
            plan: where it is kept.
            gather: brings the episodes of each stage.
            judge: lets policies drive; None: the last one is kept.
            reporter: is told of the looks that were learned from.
            stop: is looked at at every gradient step.
        """
        self._config, self._plan, self._gather = config, plan, gather
        self._judge, self._reporter, self._stop = judge, reporter, stop
        self._count = 0
        self._batch = config.streams * config.steps
        self._lengths = tuple(max(1, passes // self._batch) for passes in plan.stages)

    def run(self, *, resume: bool = False) -> Run:
        """To the end, to trouble, or until somebody stops it; leaves checkpoints, the policy, and event files.

        Raises:
            BadInput: the folder or the episodes are of no use, or it was begun with other numbers.
        """
        make_folder(self._plan.folder)
        now = self._resumed() if resume else Progress()
        begins = now.done * self._batch + 1 if now.done else None
        with Board(self._plan.folder / "tensorboard", begins) as board:
            while now.stage < len(self._lengths) and now.stopped is None:
                now = self._stage(now, board)
        if now.training is None:
            raise BadInput("it was stopped before it had anything to learn from", where=str(self._plan.folder))
        policy = self._policy(now)
        save_cloned(policy, self._plan.folder)
        return Run(policy, now, self._figures(now))

    def _resumed(self) -> Progress:
        saved, self._count = load_run(self._plan.folder)
        if saved.config != self._config or saved.facts["stages"] != list(self._plan.stages):
            raise BadInput("it was begun with other numbers", where=str(self._plan.folder), remedy="leave them out")
        told = saved.facts
        scores = tuple((int(done), float(score)) for done, score in told["scores"])
        return Progress(
            saved.training, int(told["stage"]), int(told["made"]), int(told["done"]), saved.history, scores,
            saved.best, float(told["seconds"]),
        )  # fmt: skip

    def _stage(self, now: Progress, board: Board) -> Progress:
        """A stage, from where it is to its end."""
        known = None if now.training is None else self._policy(replace(now, best=None))
        episodes = self._gather(now.stage, known)
        if episodes is None:
            return replace(now, stopped="it was asked to stop")
        learned, held = split_by_room(episodes, self._plan.held, self._plan.seed)
        if now.training is None:
            now = replace(now, training=steps.begin(self._config, learned, self._plan.seed))
        elif now.made == 0:
            again = steps.with_episodes(now.training, self._config, learned, self._plan.seed + now.stage)
            now = replace(now, training=again)
        length = self._lengths[now.stage]
        while now.made < length and now.stopped is None:
            now = self._some_steps(now, learned, self._until(now))
            if now.diverged:
                return now
            now = self._looked_at(now, held, board, length)
        if now.stopped is None:
            now = replace(now, stage=now.stage + 1, made=0)
        self._save(now)
        return now

    def _until(self, now: Progress) -> int:
        """So many steps until something is to be looked at."""
        marks = [_ROW, self._plan.saved_every, self._judged_every(now)]
        return min(self._lengths[now.stage] - now.made, *(mark - now.made % mark for mark in marks))

    def _judged_every(self, now: Progress) -> int:
        return max(1, math.ceil(self._lengths[now.stage] / max(1, self._plan.judgements)))

    def _some_steps(self, now: Progress, episodes: Sequence[Episode], count: int) -> Progress:
        began, training, told = time.perf_counter(), now.training, []
        assert training is not None
        updates, made = sum(self._lengths), 0
        for number in range(count):
            rate = steps.rate_at(self._config, now.done + number, updates)
            training, losses = steps.step(training, self._config, episodes, rate)
            told.append(losses)
            made += 1
            if self._stop is not None and self._stop.asked:
                break
        row = np.array(jax.device_get(told)).mean(axis=0)
        seconds = now.seconds + time.perf_counter() - began
        if not np.isfinite(row).all():
            why = f"it diverged: the loss is not finite after {now.done * self._batch:,} looks"
            return replace(now, stopped=why, diverged=True, seconds=seconds)
        values = {"looks": (now.done + made) * self._batch, **Losses(*row.tolist())._asdict()}
        rows = {name: np.append(now.rows.get(name, np.zeros(0)), float(value)) for name, value in values.items()}
        stopped = "it was asked to stop" if self._stop is not None and self._stop.asked else None
        return replace(
            now, training=training, made=now.made + made, done=now.done + made, rows=rows, seconds=seconds,
            stopped=stopped,
        )  # fmt: skip

    def _looked_at(self, now: Progress, held: Sequence[Episode], board: Board, length: int) -> Progress:
        """After some steps: told, validated and judged if it is time to, saved."""
        at = now.done * self._batch
        row = {f"loss/{name}": float(column[-1]) for name, column in now.rows.items() if name != "looks"}
        speed = at / now.seconds if now.seconds else 0.0
        board.scalars(row | {"speed/looks_per_second": speed}, at)
        if self._reporter is not None:
            self._reporter.tell(at, f"loss {row['loss/total']:.3g}, {speed:,.0f} looks/s")
        ends = now.made == length
        judged = now.made % self._judged_every(now) == 0 or ends
        if judged and held:
            net, scale = self._parts(now)
            told = steps.validation(net, scale, self._config, held)
            board.scalars({f"validation/{name}": float(value) for name, value in told._asdict().items()}, at)
        if judged and now.stage == len(self._lengths) - 1 and self._judge is not None and now.stopped is None:
            now = self._judged(now, board)
        if now.made % self._plan.saved_every == 0 or now.stopped is not None:
            self._save(now)
        return now

    def _judged(self, now: Progress, board: Board) -> Progress:
        assert self._judge is not None
        score = self._judge(self._policy(replace(now, best=None)))
        if score is None:
            return replace(now, stopped="it was asked to stop")
        board.scalars({"drives/reached": score}, now.done * self._batch)
        before = max((one for _, one in now.scores), default=-1.0)
        now = replace(now, scores=(*now.scores, (now.done, score)))
        if score >= before:
            return replace(now, best=now.training)
        since = [one for _, one in now.scores].index(before)
        if len(now.scores) - 1 - since >= self._plan.patience:
            return replace(now, stopped=f"it got no better in {self._plan.patience} judgements")
        return now

    def _save(self, now: Progress) -> None:
        assert now.training is not None
        facts = {
            "stages": list(self._plan.stages),
            "stage": now.stage,
            "made": now.made,
            "done": now.done,
            "scores": [list(one) for one in now.scores],
            "seconds": now.seconds,
            "source": dict(self._plan.source),
            "seed": self._plan.seed,
        }
        self._count += 1
        save_run(self._plan.folder, Saved(self._config, now.training, now.best, now.rows, facts), self._count)
        save_cloned(self._policy(now), self._plan.folder)

    def _parts(self, now: Progress) -> tuple[Any, Any]:
        chosen = now.best or now.training
        assert chosen is not None
        return chosen.learner.network, chosen.scale

    def _policy(self, now: Progress) -> Cloned:
        """What it would leave now."""
        net, scale = self._parts(now)
        return Cloned(net, scale, self._config, self._plan.source, self._figures(now))

    def _figures(self, now: Progress) -> dict[str, Any]:
        best = max((score for _, score in now.scores), default=None)
        return {
            "network": self._config.network,
            "seed": self._plan.seed,
            "passes": now.done * self._batch,
            "train_seconds": now.seconds,
            "passes_per_second": now.done * self._batch / now.seconds if now.seconds else None,
            "loss": float(now.rows["total"][-1]) if now.rows else None,
            "judged_success": best,
            "stopped": now.stopped,
        }


def seen(episodes: Sequence[Episode]) -> dict[str, int]:
    """How much there is to learn from."""
    return {"episodes": len(episodes), "looks": looks(episodes), "rooms": len({one.room for one in episodes})}
