"""The hyper-parameter study of Mahboob 2015 (section 4.4.1, figures 4.2-4.5, tables C.1-C.21).

Hidden units x learning rate x perturbation: 280 cells of 50,000 movements, each tested after each 2,000 of them. A
cell's figure is the mean of the test errors "once the network was a bit settled". The thesis took two hours a cell;
here all cells and seeds are rows of a few compiled programs, one for each width that smaller networks are padded to.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.experiments.mahboob_tables import Cell, cells
from toddle.experiments.padded import PaddedPerceptron
from toddle.experiments.ranks import rank_correlation
from toddle.reach import loop
from toddle.reach.api import suited
from toddle.reach.config import ReachConfig
from toddle.reach.session import open_session
from toddle.robots.body import Body
from toddle.robots.catalogue import load

METHOD = "goal-and-motor-babbling"


@dataclass(frozen=True)
class Parameters:
    """Of the study.

    Attributes:
        robot: the arm.
        movements: that each run learns from.
        per_cycle: movements between two tests.
        settled: tests at the beginning that don't count.
        seeds: runs of each cell.
        network: plain, as the document's, or refined.
        hidden: only the cells with these numbers of hidden units; (): all cells.
        widths: sizes that smaller networks are padded to.
        rows: runs side by side in one program.
        threads: programs side by side.
        least: the rank correlation with the document's means from which on the study counts as reproduced.
    """

    robot: str = "nicu"
    movements: int = 50_000
    per_cycle: int = 2_000
    settled: int = 5
    seeds: int = 5
    network: Literal["plain", "refined"] = "plain"
    hidden: tuple[int, ...] = ()
    widths: tuple[int, ...] = (0, 10, 20, 50, 90, 160)
    rows: int = 50
    threads: int = 2
    least: float = 0.95


FULL = Parameters()
QUICK = replace(FULL, seeds=2, hidden=(0, 1, 2, 5, 10, 50))
HOURS_A_CELL = 2.0  # of the document, section 4.4.4
FEWEST_RANKED = 5  # cells that a table must have for its own rank correlation to say something


@dataclass(frozen=True)
class Batch:
    """Runs side by side: the width of their networks, and the cell and the seed of each."""

    width: int
    runs: tuple[tuple[int, int], ...]


def batches(chosen: Sequence[Cell], parameters: Parameters) -> list[Batch]:
    """All runs by the width of their networks; the most work first, so that the threads end together."""
    found: list[Batch] = []
    for below, width in zip((-1, *parameters.widths), parameters.widths, strict=False):
        members = [i for i, cell in enumerate(chosen) if below < cell.hidden <= width]
        runs = [(i, seed) for i in members for seed in range(parameters.seeds)]
        found += [Batch(width, tuple(runs[k : k + parameters.rows])) for k in range(0, len(runs), parameters.rows)]
    return sorted(found, key=lambda batch: -batch.width)


@dataclass(frozen=True)
class Study:
    """What all batches share."""

    parameters: Parameters
    chosen: tuple[Cell, ...]
    body: Body
    seed: int

    def errors(self, batch: Batch) -> Float[np.ndarray, "runs cycles"]:
        """Mean error on the fixed test set after each testing cycle of each run [m]."""
        hidden = (batch.width,) if batch.width else ()
        config = ReachConfig(method=METHOD, seed=self.seed, hidden=hidden, network=self.parameters.network)
        session = open_session(self.body, suited(config, self.body.name))
        # every batch has the same number of rows, so that batches of a width share one program
        runs = (batch.runs * self.parameters.rows)[: self.parameters.rows]
        members = [self.chosen[cell] for cell, _ in runs]
        keys = jax.vmap(lambda run: jax.random.fold_in(jax.random.fold_in(jax.random.key(self.seed), run[0]), run[1]))
        errors = _family(
            (session.setting, self.body, jnp.asarray(session.targets, jnp.float32), session.reachable_cells),
            (self.parameters.movements // self.parameters.per_cycle, self.parameters.per_cycle),
            jnp.array([cell.hidden for cell in members]),
            jnp.array([cell.learning_rate for cell in members], jnp.float32),
            jnp.array([cell.perturbation for cell in members], jnp.float32),
            keys(jnp.array(runs)),
        )
        return np.asarray(errors, float)[: len(batch.runs)]


@eqx.filter_jit
def _family(
    parts: tuple[loop.Setting, Body, Array, Array],
    cycles: tuple[int, int],
    units: Array,
    learning_rate: Array,
    perturbation: Array,
    keys: jax.Array,
) -> Float[Array, "runs cycles"]:
    setting, body, targets, reachable = parts

    def one(awake: Array, rate: Array, size: Array, key: jax.Array) -> Float[Array, " cycles"]:
        learner = eqx.tree_at(lambda perceptron: perceptron.learning_rate, setting.learner, rate)
        chosen = eqx.tree_at(lambda s: s.learner, setting, PaddedPerceptron(learner, awake))
        chosen = eqx.tree_at(lambda s: s.explorer.perturbation, chosen, size)
        return loop.learn_in_cycles(chosen, body, key, *cycles, targets, reachable)[1].fixed_error

    return jax.vmap(one)(units, learning_rate, perturbation, keys)


def compute(study: Study, task: Task) -> dict[tuple[int, int], Float[np.ndarray, " cycles"]]:
    """The errors of each (cell, seed) [m]; of those that were done when somebody asked to stop."""
    todo = batches(study.chosen, study.parameters)
    total, done = sum(len(batch.runs) for batch in todo), {}
    with ThreadPoolExecutor(study.parameters.threads) as pool:
        # one batch of each width goes first, and the others of that width find it compiled
        waiting = {pool.submit(study.errors, batch): batch for batch in _one_of_each_width_first(todo)}
        for finished in as_completed(waiting):
            if task.stopped():
                pool.shutdown(cancel_futures=True)
                break
            done.update(zip(waiting[finished].runs, finished.result(), strict=True))
            task.tell(len(done) / total, f"{len(done)} of {total} runs, {waiting[finished].width} hidden units")
    return done


def _one_of_each_width_first(todo: list[Batch]) -> Iterator[Batch]:
    firsts = {batch.width: batch for batch in reversed(todo)}
    yield from firsts.values()
    yield from (batch for batch in todo if batch is not firsts[batch.width])


def measured(
    chosen: Sequence[Cell], done: dict[tuple[int, int], Float[np.ndarray, " cycles"]], parameters: Parameters
) -> list[dict[str, Any]]:
    """Each cell that has runs: the document's figures beside ours, over the tests that count and the seeds [m]."""
    table = []
    for i, cell in enumerate(chosen):
        runs = [done[i, seed][parameters.settled :] for seed in range(parameters.seeds) if (i, seed) in done]
        if runs:
            ours = {
                "ours_mean": float(np.mean(runs)),
                "ours_std": float(np.mean(np.std(runs, axis=1))),
                "ours_std_between_seeds": float(np.std(np.mean(runs, axis=1))),
            }
            table.append({**asdict(cell), **ours})
    return table


def run(task: Task) -> Outcome:
    """The study, its correlation with the document's, and the pictures of figures 4.2 to 4.5."""
    parameters = FULL if task.full else QUICK
    parameters = replace(parameters, seeds=task.seeds or parameters.seeds)
    chosen = tuple(cell for cell in cells() if not parameters.hidden or cell.hidden in parameters.hidden)
    began, cpu = time.perf_counter(), time.process_time()
    done = compute(Study(parameters, chosen, load(parameters.robot), task.seed), task)
    seconds, cpu_seconds = time.perf_counter() - began, time.process_time() - cpu
    table = measured(chosen, done, parameters)
    if len(table) < 2:
        return Outcome((), "stopped before two cells were done", False, parameters)
    draw(table, task.folder)
    correlation = correlation_of(table)
    movements = len(done) * parameters.movements
    rows = (
        Row("rank correlation of all means with the document's", correlation),
        *(Row(f"table {name}, mean over its cells", *both, "mm") for name, both in by_table(table).items()),
        Row("time for a cell of 50,000 movements", 50_000 * seconds / movements, 3600 * HOURS_A_CELL, "s"),
    )
    verdict = (
        f"the means of {len(table)} cells, {parameters.seeds} seeds each, have a rank correlation of {correlation:.3f} "
        f"with the document's ({parameters.least} asked)"
    )
    figures = {
        "rank_correlation": correlation,
        "rank_correlation_by_table": {
            name: correlation_of(rows) for name, rows in grouped(table).items() if len(rows) >= FEWEST_RANKED
        },
        "seconds": seconds,
        "cpu_seconds": cpu_seconds,
        "samples_per_cpu_second": movements / cpu_seconds,
        "cells": table,
    }
    return Outcome(rows, verdict, correlation >= parameters.least, parameters, figures)


def correlation_of(table: Sequence[dict[str, Any]]) -> float:
    """Rank correlation of our means with the document's."""
    return rank_correlation(*(np.array([row[key] for row in table]) for key in ("ours_mean", "mean")))


def grouped(table: Sequence[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """The rows of each table of the document."""
    return {name: [row for row in table if row["table"] == name] for name in dict.fromkeys(r["table"] for r in table)}


def by_table(table: Sequence[dict[str, Any]]) -> dict[str, tuple[float, float]]:
    """Mean over the cells of each table, ours and the document's [mm]."""
    return {
        name: (1000 * float(np.mean([r["ours_mean"] for r in rows])), 1000 * float(np.mean([r["mean"] for r in rows])))
        for name, rows in grouped(table).items()
    }


MAPS = {
    "figure-4-2": tuple(f"C.{i}" for i in range(1, 9)),
    "figure-4-3": tuple(f"C.{i}" for i in range(9, 21)),
    "figure-4-5": ("C.21",),
}


def draw(table: Sequence[dict[str, Any]], folder: Path) -> None:
    """Figures 4.2, 4.3 and 4.5 as heat maps, 4.4 as means and deviations, and all cells, ours over the document's."""
    from toddle.outside import document_pictures as pictures

    for name, tables in MAPS.items():
        part = [row for row in table if row["table"] in tables]
        hidden = sorted({row["hidden"] for row in part})
        pairs = list(dict.fromkeys((row["learning_rate"], row["perturbation"]) for row in part))
        ours, document = np.full((2, len(hidden), len(pairs)), np.nan)
        for row in part:
            at = hidden.index(row["hidden"]), pairs.index((row["learning_rate"], row["perturbation"]))
            ours[at], document[at] = row["ours_mean"], row["mean"]
        if part:
            labels = [f"{rate:g} & {size:g}" for rate, size in pairs]
            pictures.heat_maps_beside(
                folder / f"{name}.png", ours, document, [str(h) for h in hidden], labels,
                row_label="hidden units", title=f"{name.replace('-', ' ', 1).replace('-', '.')}: LR & E",
            )  # fmt: skip
    best = [row for row in table if row["table"] == "C.9"]
    pictures.means_and_deviations(
        folder / "figure-4-4.png",
        [str(row["hidden"]) for row in best],
        ([row["ours_mean"] for row in best], [row["ours_std"] for row in best]),
        ([row["mean"] for row in best], [row["std"] for row in best]),
        x_label="hidden units",
        title="figure 4.4: LR 0.717, E 0.233, after 50,000 movements",
    )
    ours, document = (np.array([row[key] for row in table]) for key in ("ours_mean", "mean"))
    title = f"{len(table)} cells, rank correlation {rank_correlation(ours, document):.3f}"
    pictures.scatter_beside(folder / "all-cells.png", ours, document, [row["table"] for row in table], title=title)


EXPERIMENT = Experiment("mahboob-hyperparameters", "Mahboob 2015, tables C.1-C.21 and figures 4.2-4.5", run)
