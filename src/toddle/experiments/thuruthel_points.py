"""Fifty random targets from the upright home (Thuruthel 2016, section 4, figures 2a and 2b).

The paper prints how many steps the solver takes "to converge to a value within a range of 1mm": 5.68, with a deviation
of 1.504. Here the arm has settled when a step moves the tip by less than 1 mm, and that step is counted. Beside it, the
same network corrected by looks at the tip.
"""

from __future__ import annotations

import numpy as np

from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.experiments.thuruthel import STEPS, STEPS_DEVIATION, acting, asked_for, random_targets, runs
from toddle.reach.observe import observer
from toddle.robots.catalogue import load

LOOKS = 6
MOST = 50  # steps; who hasn't settled by then doesn't


def run(task: Task) -> Outcome:
    """Each run's targets, reached for by the paper's method and with looks."""
    parameters = asked_for(task)
    body = load(parameters.robot)
    act, look, found = acting(body), observer(body), []
    for seed, inverse in runs(task, parameters):
        targets = random_targets(body, parameters.targets, seed)
        settled = inverse.solve(targets, act=act, most=MOST)
        ways = np.stack([look(q) for q in settled.trajectory])
        near = np.linalg.norm(ways - ways[-1], axis=2) < 1e-3
        errors = 1000 * np.linalg.norm(ways[-1] - targets, axis=1)
        looked = 1000 * inverse.reach_for(look, targets, LOOKS)[1]
        found.append((targets, ways[-1], errors, settled.steps, near.argmax(axis=0), looked[-1]))
    draw(found[0], task)
    errors, steps, within, looked = (np.stack([run[k] for run in found]) for k in range(2, 6))
    unsettled = float(100 * np.mean(steps == MOST))
    rows = (
        Row("steps to settle, mean", float(steps.mean()), STEPS),
        Row("steps to settle, deviation", float(steps.std()), STEPS_DEVIATION),
        Row("steps to settle, run with the fewest", float(steps.mean(axis=1).min())),
        Row("steps to settle, run with the most", float(steps.mean(axis=1).max())),
        Row("steps until within 1 mm of where it settles, mean", float(within.mean()), STEPS),
        Row("steps until within 1 mm of where it settles, deviation", float(within.std()), STEPS_DEVIATION),
        Row("targets at which it doesn't settle", unsettled, None, "%"),
        Row("error, mean", float(errors.mean()), None, "mm"),
        Row("error, deviation", float(errors.std()), None, "mm"),
        Row("error, median", float(np.median(errors)), None, "mm"),
        Row("error, mean of the best run", float(errors.mean(axis=1).min()), None, "mm"),
        Row("error, mean of the worst run", float(errors.mean(axis=1).max()), None, "mm"),
        Row(f"error below 1 mm after {LOOKS} looks", float(100 * np.mean(looked < 1)), None, "%"),
        Row(f"error after {LOOKS} looks, median", float(np.median(looked)), None, "mm"),
        Row(f"error after {LOOKS} looks, mean", float(looked.mean()), None, "mm"),
    )
    verdict = (
        f"{steps.mean():.2f} ± {steps.std():.2f} steps to settle ({STEPS} ± {STEPS_DEVIATION:.2f} printed), "
        f"{errors.mean():.0f} mm from the target; {unsettled:.1f} % don't settle; mean of {len(found)} runs"
    )
    holds = bool(abs(steps.mean() - STEPS) <= STEPS_DEVIATION and unsettled == 0)
    names = ("error_mm", "steps", "looked_error_mm")
    of_runs = zip(errors.mean(axis=1), steps.mean(axis=1), looked.mean(axis=1), strict=True)
    figures = {"runs": [dict(zip(names, np.round(one, 3).tolist(), strict=True)) for one in of_runs]}
    return Outcome(rows, verdict, holds, parameters, figures)


def draw(found: tuple[np.ndarray, ...], task: Task) -> None:
    """Figures 2a and 2b, of the first run."""
    from toddle.outside import soft_pictures

    targets, tips, errors, steps = found[:4]
    soft_pictures.targets_and_answers(task.folder / "figure-2-a.png", targets, tips, title="figure 2a: random targets")
    soft_pictures.errors_and_steps(task.folder / "figure-2-b.png", errors, steps, title="figure 2b: errors and steps")


EXPERIMENT = Experiment("thuruthel-points", "Thuruthel 2016, figures 2a, 2b", run)
