"""The circle with the last three actuators locked and nobody told (Thuruthel 2016, section 4, figures 2e and 2f).

The solver goes on commanding all nine; it is told where the joints are, as in the paper, and so sees three that never
move. The paper's text says that its solutions "are still good"; its errors are in the figure only. Here they count as
good where the error grows by no more than half.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.experiments.thuruthel import asked_for, runs
from toddle.experiments.thuruthel_circle import draw, figures_of, followed, rows_of, worst

LOCKED = 3
GOOD = 1.5  # times the error of the whole arm


def run(task: Task) -> Outcome:
    """The same networks follow the circle with the whole arm and with what is left of it."""
    parameters = replace(asked_for(task), locked=LOCKED)
    learned = [inverse for _, inverse in runs(task, parameters)]
    whole = [followed(inverse, replace(parameters, locked=0)) for inverse in learned]
    found = [followed(inverse, parameters) for inverse in learned]
    draw(found[0], parameters, task)
    free, errors = (float(np.mean([run.errors for run in part])) for part in (whole, found))
    corrected, far = float(np.mean([run.corrected for run in found])), worst([run.errors for run in found])
    rows = (*rows_of(found), Row("error with the whole arm, both rounds", free, None, "mm"))
    verdict = (
        f"{errors:.1f} mm with {LOCKED} actuators locked, {free:.1f} with the whole arm, at most {far:.0f} once "
        f"on the circle; with feedback {corrected:.1f} mm; mean of {len(found)} runs"
    )
    holds = errors <= GOOD * free
    return Outcome(rows, verdict, holds, parameters, figures_of(found))


EXPERIMENT = Experiment("thuruthel-locked", "Thuruthel 2016, figures 2e, 2f", run)
