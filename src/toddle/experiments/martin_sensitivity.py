"""How much depends on what Martin 2009 doesn't print: one thing changed at a time, beside table 3.

The document gives no goals, no scaling of inputs and outputs, no number of hidden neurons and no first step size, and
of NEAT six parameters. `toddle.experiments.martin_arms.Setting` says what was taken; here is what else could have been.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.experiments.martin_arms import ARMS, TABLE_3, Setting, evolve, fresh_mse, in_units


@dataclass(frozen=True)
class Parameters:
    """Of the experiment.

    Attributes:
        setting: what was taken.
        only: variants of each method; None: all.
    """

    setting: Setting = field(default_factory=lambda: Setting(runs=10))
    only: int | None = None


FULL = Parameters()
QUICK = Parameters(Setting(runs=4), only=3)

QUARTER, LIMITS = (0.0, 1.0), (-1.0, 1.0)


def variants(setting: Setting) -> dict[str, dict[str, Setting]]:
    """What is changed, method by method."""
    with_neat = lambda **changed: replace(setting, neat=replace(setting.neat, **changed))  # noqa: E731
    goals = {
        "goals: joints 0 to 90 deg, slide 0 to 20": replace(setting, goals_from=QUARTER),
        "goals: joints -90 to 90 deg, slide 0 to 20": replace(setting, goals_from=LIMITS),
        "other 70 goals": replace(setting, goal_seed=1),
    }
    return {
        "CMA-ES": {
            "as taken": setting,
            "5 hidden neurons": replace(setting, hidden=5),
            "10 hidden neurons": replace(setting, hidden=10),
            "20 hidden neurons": replace(setting, hidden=20),
            "first step 0.1": replace(setting, sigma=0.1),
            "first step 0.5": replace(setting, sigma=0.5),
            "first step 1": replace(setting, sigma=1.0),
            "inputs to ±0.3": replace(setting, inputs=0.3),
            "inputs to ±3": replace(setting, inputs=3.0),
            "inputs raw, in units": replace(setting, inputs=0.0),
            "outputs to ±1 upper limit": replace(setting, outputs=1.0),
            "outputs to ±1.5 upper limits": replace(setting, outputs=1.5),
            "outputs to ±3 upper limits": replace(setting, outputs=3.0),
            **goals,
            "goals and outputs within ±90 deg": replace(setting, goals_from=LIMITS, outputs=1.0),
        },
        "NEAT": {
            "as taken": setting,
            "inputs to ±0.3": replace(setting, neat_inputs=0.3),
            "inputs to ±1": replace(setting, neat_inputs=1.0),
            "inputs raw, in units": replace(setting, neat_inputs=0.0),
            "weights mutate at 0.1": with_neat(mutate_weight=0.1),
            "distance of species 3": with_neat(threshold=3.0),
            "no crossover": with_neat(crossover=0.0),
            "nodes and connections at 0.03": with_neat(add_node=0.03, add_connection=0.03),
            "outputs to ±1 upper limit": replace(setting, outputs=1.0),
            **goals,
        },
    }


def run(task: Task) -> Outcome:
    """Every variant of both methods on both arms."""
    parameters = FULL if task.full else QUICK
    setting = replace(parameters.setting, runs=task.seeds or parameters.setting.runs)
    parameters = replace(parameters, setting=setting)
    cells = [
        (method, what, changed, name)
        for method, some in variants(setting).items()
        for what, changed in list(some.items())[: parameters.only]
        for name in ARMS
    ]
    figures: dict[str, dict[str, dict[str, dict[str, object]]]] = {}
    rows: list[Row] = []
    for k, (method, what, changed, name) in enumerate(cells):
        if task.stopped():
            break
        task.tell(k / len(cells), f"{method}, {name} arm, {what}")
        found = evolve(name, method, changed, task.seed)
        mse = np.sort(in_units(found.mse))
        rows += rows_of(f"{name} arm, {method}, {what}", mse, np.array(TABLE_3[name, method]))
        fresh = float(fresh_mse(name, found, changed)[found.mse.argmin()])
        cell = {"mse_of_each_run": mse.tolist(), "fresh_mse_of_the_best": fresh}
        figures.setdefault(method, {}).setdefault(what, {})[name] = cell
    best = [row for row in rows if row.what.endswith("best")]
    below = [row.what for row in best if (row.ours or 0.0) <= (row.document or 0.0)]
    pairs = [f"{name} arm, {method}" for method in variants(setting) for name in ARMS]
    holds = all(any(what.startswith(pair) for what in below) for pair in pairs)
    draw(figures, task)
    verdict = (
        f"with {setting.runs} runs, {len(below)} of {len(best)} readings reach table 3's best of 30; "
        f"{'at least one' if holds else 'not one'} for {'each' if holds else 'some'} arm and method"
    )
    return Outcome(tuple(rows), verdict, holds, parameters, figures)


def rows_of(what: str, mse: Float[np.ndarray, " runs"], printed: Float[np.ndarray, " printed"]) -> list[Row]:
    """Best and median beside table 3's [units^2]."""
    return [
        Row(f"{what}, best", float(mse.min()), float(printed.min())),
        Row(f"{what}, median", float(np.median(mse)), float(np.median(printed))),
    ]


def draw(figures: Mapping[str, Mapping[str, Mapping[str, Mapping[str, object]]]], task: Task) -> None:
    """A picture for each method."""
    from toddle.outside.convergence_pictures import settings_beside

    for method, cells in figures.items():
        whole = {what: arms for what, arms in cells.items() if len(arms) == len(ARMS)}
        runs = {name: [np.array(arms[name]["mse_of_each_run"]) for arms in whole.values()] for name in ARMS}
        levels = {name: TABLE_3[name, method][0] for name in ARMS}
        settings_beside(
            task.folder / f"{method.lower()}.png", list(whole), runs, levels,
            title=f"{method}: what the document doesn't print; dashed, its best run of 30",
        )  # fmt: skip


EXPERIMENT = Experiment("martin-sensitivity", "Martin 2009, table 3, under other readings", run)
