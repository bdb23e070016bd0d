"""A family: runs that differ in nothing but their seed, side by side, tested cycle by cycle."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from toddle.experiments.experiment import Task
from toddle.reach import loop
from toddle.reach.api import hidden_of, suited
from toddle.reach.config import ReachConfig
from toddle.reach.session import Session, open_session
from toddle.robots.body import Body
from toddle.robots.catalogue import load


@dataclass(frozen=True)
class Family:
    """How the runs went, cycle by cycle.

    Attributes:
        session: what they share.
        samples: movements of each run at each test.
        lines: lines that each run had ended by then: movements at which a joint came to its limit.
        fixed, seen: mean errors on the two test sets [mm].
        coverage: the share of the reachable cells that were visited [%].
        last: the progress of all runs at the end.
        best: the first run's progress at its best test.
        kept: the first run's progress after so many movements.
    """

    session: Session
    samples: Float[np.ndarray, " cycles"]
    lines: Float[np.ndarray, "seeds cycles"]
    fixed: Float[np.ndarray, "seeds cycles"]
    seen: Float[np.ndarray, "seeds cycles"]
    coverage: Float[np.ndarray, "seeds cycles"]
    last: loop.Progress
    best: loop.Progress
    kept: Mapping[int, loop.Progress]

    @property
    def complete(self) -> bool:
        """Whether nobody stopped it."""
        return bool(self.samples[-1] >= self.session.samples)

    def best_cycle(self) -> tuple[float, float]:
        """Errors in each run's best cycle on the fixed test set, and on the seen one then; means over the runs [mm]."""
        at = self.fixed.argmin(axis=1)
        runs = np.arange(len(at))
        return float(self.fixed[runs, at].mean()), float(self.seen[runs, at].mean())

    def settled(self, share: float = 0.2) -> tuple[float, float]:
        """Mean errors on both test sets over the last share of the cycles [mm]."""
        first = -max(1, round(share * len(self.samples)))
        return float(self.fixed[:, first:].mean()), float(self.seen[:, first:].mean())

    def settles_at(self, within: float = 0.1, window: int = 10) -> int:
        """The first test at which the running mean over so many tests is within this share of where it settles."""
        window = min(window, len(self.samples))
        running = np.convolve(self.fixed.mean(axis=0), np.ones(window) / window, mode="valid")
        return int(np.argmax(running <= (1 + within) * self.settled()[0])) + window - 1

    def course(self, most: int = 100) -> dict[str, object]:
        """For the JSON file: means over the runs at so many of the tests."""
        some = slice(None, None, max(1, len(self.samples) // most))
        return {
            "test_points": len(self.session.targets),
            "test_spacing_mm": round(1000 * self.session.spacing, 1),
            "best_fixed_mm_of_each_run": self.fixed.min(axis=1).round(2).tolist(),
            "samples": self.samples[some].astype(int).tolist(),
            "lines": self.lines.mean(axis=0)[some].round().astype(int).tolist(),
            "fixed_mm": self.fixed.mean(axis=0)[some].round(2).tolist(),
            "seen_mm": self.seen.mean(axis=0)[some].round(2).tolist(),
            "coverage_percent": self.coverage.mean(axis=0)[some].round(2).tolist(),
        }


def open_for(robot: str, config: ReachConfig) -> Session:
    """A session on a robot of the catalogue, with its document's test set."""
    return open_session(load(robot), suited(config, robot), hidden=hidden_of(robot))


def learn_family(session: Session, seeds: int, task: Task, *, keep: Collection[int] = ()) -> Family:
    """Let so many runs learn side by side, until their movements are made or somebody asks to stop.

    Args:
        session: what they share: the body, the configuration, the test set.
        seeds: how many runs.
        task: the experiment's; its seed is the runs'.
        keep: numbers of movements after which the first run's progress is kept.
    """
    keys = jax.random.split(jax.random.key(task.seed), seeds)
    progress = _begin(session.setting, keys)
    targets, config = jnp.asarray(session.targets, jnp.float32), session.config
    scores: list[loop.Scores] = []
    ended: list[np.ndarray] = []
    best, kept = jax.tree.map(lambda leaf: leaf[0], progress), {}
    samples = 0
    assert isinstance(session.body, Body)
    while samples < session.samples and not (scores and task.stopped()):
        count = min(config.per_cycle, session.samples - samples)
        progress, score, lines = _cycle(
            session.setting, session.body, progress, count, targets, session.reachable_cells
        )
        samples += count
        scores.append(jax.tree.map(np.asarray, score))
        ended.append(np.asarray(lines, float))
        if len(scores) == 1 or scores[-1].fixed_error[0] < min(s.fixed_error[0] for s in scores[:-1]):
            best = jax.tree.map(lambda leaf: leaf[0], progress)
        if samples in keep:
            kept[samples] = jax.tree.map(lambda leaf: leaf[0], progress)
        error = 1000 * float(scores[-1].fixed_error.mean())
        task.tell(samples / session.samples, f"{samples:,} movements, error {error:.1f} mm")
    over = lambda name: np.stack([np.asarray(getattr(s, name), float) for s in scores], axis=1)  # noqa: E731
    return Family(
        session,
        over("samples")[0],
        np.cumsum(np.stack(ended, axis=1), axis=1),
        1000 * over("fixed_error"),
        1000 * over("seen_error"),
        100 * over("coverage"),
        progress,
        best,
        kept,
    )


@eqx.filter_jit
def _begin(setting: loop.Setting, keys: jax.Array) -> loop.Progress:
    return jax.vmap(lambda key: loop.begin(setting, key))(keys)


@eqx.filter_jit
def _cycle(
    setting: loop.Setting, body: Body, progress: loop.Progress, count: int, targets: Array, reachable: Array
) -> tuple[loop.Progress, loop.Scores, Float[Array, " seeds"]]:
    def one(run: loop.Progress) -> tuple[loop.Progress, loop.Scores, Array]:
        run, movements = loop.advance(setting, body, run, count)
        saturated = jnp.any((movements.q <= 0.0) | (movements.q >= 1.0), axis=1)
        return run, loop.score(setting, body, run, targets, reachable), jnp.sum(saturated, dtype=jnp.float32)

    return jax.vmap(one)(progress)


def errors_point_by_point(
    family: Family, progress: loop.Progress
) -> tuple[Float[np.ndarray, " fixed"], Float[np.ndarray, "seen space"], Float[np.ndarray, " seen"]]:
    """One run's errors on the fixed test set [mm]; its seen test set [m], and the errors there [mm]."""
    from toddle.reach.evaluate.figures import errors_of
    from toddle.reach.evaluate.seen import draw_seen

    session, key = family.session, jax.random.fold_in(progress.key, 1)
    drawn = draw_seen(progress.seen, key, len(session.targets))
    seen = np.asarray(session.setting.box.x_from_unit(drawn), float)
    predict = lambda targets: session.predict(progress, targets)  # noqa: E731
    return (
        1000 * errors_of(predict, session.observe, session.targets),
        seen,
        1000 * errors_of(predict, session.observe, seen),
    )


def visited(family: Family, progress: loop.Progress) -> Float[np.ndarray, "kept space"]:
    """Positions that a run has visited, at most 4,096 of them [m]."""
    from toddle.reach.evaluate.seen import kept

    return np.asarray(family.session.setting.box.x_from_unit(jnp.asarray(kept(progress.seen)[1])), float)
