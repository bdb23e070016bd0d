"""Thirty runs of CMA-ES and of NEAT on two arms (Martin, de Lope, Santos 2009; tables 3, 4, 5 and figures 5, 6).

A neuro-controller is a vector of weights, or a network that grows, and forward kinematics alone scores it: the mean
squared distance over 70 fixed goals. `toddle.experiments.martin_arms.Setting` says what was taken where the document
is silent.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.experiments.martin_arms import ARMS, METHODS, TABLE_3, Setting, evolve, in_units, telling
from toddle.reach.evolve.evolution import Evolution

Runs = Mapping[tuple[str, str], Evolution]


@dataclass(frozen=True)
class Parameters:
    """Of the experiment.

    Attributes:
        setting: of the runs.
        best_runs: how many are compared in table 5.
        most_seconds: processor time in which all runs of CMA-ES on both arms are to be done.
    """

    setting: Setting = field(default_factory=Setting)
    best_runs: int = 10
    most_seconds: float = 180.0


FULL = Parameters()
QUICK = replace(FULL, setting=Setting(runs=10), best_runs=5)

TABLE_4 = {"planar": (-0.9162, 0.1835), "SCARA": (3.2418, 0.0015)}
TABLE_5 = {"planar": (-44.5719, 9.7944e-20), "SCARA": (-20.6801, 3.3533e-9)}
"""t and its significance, CMA-ES against NEAT; all runs (table 4), the best ten (table 5)."""
CROSSING = {"SCARA": 132.0}
"""Generation at which the best run of CMA-ES comes below that of NEAT (figure 6, as the text reads it)."""


class Welch(NamedTuple):
    """A t-test of two means with unequal variances.

    Attributes:
        t: negative where the first mean is lower.
        freedom: degrees of freedom (Welch, Satterthwaite).
        p: probability of such a t or a larger one in its direction; the document's "significance".
    """

    t: float
    freedom: float
    p: float


def welch(one: Float[np.ndarray, " runs"], other: Float[np.ndarray, " others"]) -> Welch:
    """Compare two means (tables 4 and 5)."""
    from scipy.stats import ttest_ind

    found: Any = ttest_ind(one, other, equal_var=False)
    return Welch(float(found.statistic), float(found.df), float(found.pvalue) / 2)


def run(task: Task) -> Outcome:
    """Both methods on both arms; the tables and the figures."""
    parameters = FULL if task.full else QUICK
    setting = replace(parameters.setting, runs=task.seeds or parameters.setting.runs)
    parameters = replace(parameters, setting=setting, best_runs=min(parameters.best_runs, setting.runs))
    found, seconds = evolved(setting, task)
    rows = [row for cell, one in found.items() for row in rows_of(cell, np.sort(in_units(one.mse)))]
    tests = {name: tests_of(name, found, parameters.best_runs) for name in ARMS}
    rows += [row for name in ARMS for row in rows_of_tests(name, tests[name])]
    rows += [
        Row(f"{name} arm: the best runs' curves cross at generation", crossing(name, found), CROSSING.get(name))
        for name in ARMS
    ]
    spent = sum(value for cell, value in seconds.items() if "CMA-ES" in cell)
    rows.append(Row("processor time of CMA-ES, both arms, all runs", spent, None, "s"))
    draw(found, task.folder)
    reached = sum(in_units(one.mse).min() <= TABLE_3[cell][0] for cell, one in found.items())
    verdict = (
        f"best run of {setting.runs} at or below table 3's best in {reached} of {len(TABLE_3)} cells; CMA-ES on both "
        f"arms in {spent:.0f} s of one core (asked: {parameters.most_seconds:g})"
    )
    holds = reached == len(TABLE_3) and spent <= parameters.most_seconds
    figures = {
        "mse_of_each_run": {" ".join(cell): np.sort(in_units(one.mse)).tolist() for cell, one in found.items()},
        "processor_seconds": {" ".join(cell): round(value, 1) for cell, value in seconds.items()},
        "t_tests": {name: {which: test._asdict() for which, test in tests[name].items()} for name in ARMS},
    }
    return Outcome(tuple(rows), verdict, bool(holds), parameters, figures)


def evolved(setting: Setting, task: Task) -> tuple[Runs, dict[tuple[str, str], float]]:
    """All runs, and the processor time of each cell [s]."""
    cells = [(name, method) for name in ARMS for method in METHODS]
    found, seconds = {}, {}
    for k, (name, method) in enumerate(cells):
        tell = telling(task, f"{method}, {name} arm", k / len(cells), (k + 1) / len(cells))
        began = time.process_time()
        found[name, method] = evolve(name, method, setting, task.seed, tell)
        seconds[name, method] = time.process_time() - began
    return found, seconds


def rows_of(cell: tuple[str, str], mse: Float[np.ndarray, " runs"]) -> list[Row]:
    """Table 3's figures of one arm and method, ours beside the document's [units^2]."""
    name, printed = f"{cell[0]} arm, {cell[1]}", np.array(TABLE_3[cell])
    return [
        Row(f"{name}: MSE, best run", float(mse.min()), float(printed.min())),
        Row(f"{name}: MSE, median", float(np.median(mse)), float(np.median(printed))),
        Row(f"{name}: MSE, mean", float(mse.mean()), float(printed.mean())),
        Row(f"{name}: MSE, deviation", _deviation(mse), _deviation(printed)),
    ]


def tests_of(name: str, found: Runs, best: int) -> dict[str, Welch]:
    """CMA-ES against NEAT on one arm: all runs and the best ones, ours, and again from the document's table 3."""
    ours = [np.sort(in_units(found[name, method].mse)) for method in METHODS]
    printed = [np.array(TABLE_3[name, method]) for method in METHODS]
    return {
        "all": welch(ours[0], ours[1]),
        "best": welch(ours[0][:best], ours[1][:best]),
        "all, from the printed table 3": welch(printed[0], printed[1]),
        "best ten, from the printed table 3": welch(printed[0][:10], printed[1][:10]),
    }


def rows_of_tests(name: str, tests: Mapping[str, Welch]) -> list[Row]:
    """Tables 4 and 5 of one arm, ours beside the document's."""
    return [
        row
        for which, printed in (("all", TABLE_4[name]), ("best", TABLE_5[name]))
        for row in (
            Row(f"{name} arm, {which} runs: t of CMA-ES against NEAT", tests[which].t, printed[0]),
            Row(f"{name} arm, {which} runs: significance", tests[which].p, printed[1]),
        )
    ]


def crossing(name: str, found: Runs) -> float | None:
    """The generation from which on the best run of CMA-ES lies below that of NEAT; None: it never does."""
    ours, theirs = (one.course[:, one.mse.argmin()] for one in (found[name, method] for method in METHODS))
    count = min(len(ours), len(theirs))
    above = np.flatnonzero(ours[:count] >= theirs[:count])
    last = int(above[-1]) + 1 if len(above) else 0
    return float(last + 1) if last < count else None


def draw(found: Runs, folder: Path) -> None:
    """Figures 5 and 6: how the error of all runs falls."""
    from toddle.outside.convergence_pictures import convergence

    for number, name in enumerate(ARMS, start=5):
        convergence(
            folder / f"figure-{number}.png",
            {method: in_units(found[name, method].course) for method in METHODS},
            {f"document, {method}, best": TABLE_3[name, method][0] for method in METHODS},
            title=f"figure {number}: the {name} arm, all runs and the best one",
        )


def _deviation(values: Float[np.ndarray, " runs"]) -> float:
    return float(values.std(ddof=1)) if len(values) > 1 else 0.0


EXPERIMENT = Experiment("martin-evolution", "Martin 2009, tables 3-5, figures 5 and 6", run)
