"""A circle followed twice, one step for each of its points (Thuruthel 2016, section 4, figures 2c and 2d).

The paper's errors are in its figures only; its text says that the error is large at the beginning, for the arm starts
away from the circle, and that one step a point is enough. Both are checked: the second round is no worse than the
first, and letting the arm settle at each point gains little. Beside it, the same network with feedback: what was missed
at a point shifts the later ones.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.experiments.thuruthel import AROUND, RADIUS, Parameters, acting, asked_for, circle, runs
from toddle.reach.iterated import IteratedInverse
from toddle.reach.observe import observer
from toddle.robots.catalogue import load

SETTLED_AFTER = 10  # points, when the arm has come from its home to the circle
ENOUGH = 1.1  # one step a point is enough if settling at each doesn't lower the error by more than a tenth
GOOD = 0.5 * RADIUS  # [m] the circle is still followed if the tip is never farther from it than half its radius


class Followed(NamedTuple):
    """One run: where the tip went [m], and how far that is from the path [mm]."""

    way: Float[np.ndarray, "points 3"]
    errors: Float[np.ndarray, " points"]
    corrected_way: Float[np.ndarray, "points 3"]
    corrected: Float[np.ndarray, " points"]
    settled: Float[np.ndarray, " points"]


def followed(inverse: IteratedInverse, parameters: Parameters) -> Followed:
    """The circle as the paper follows it, with feedback, and settling at each point."""
    body, path = load(parameters.robot), circle()
    act = acting(body, parameters.locked)
    plain, corrected = inverse.follow(path, act), inverse.follow(path, act, feedback=1.0)
    once = path[:AROUND]
    settled = observer(body)(inverse.solve(once, act=act).q)
    errors = [1000 * np.linalg.norm(way - path[: len(way)], axis=1) for way in (plain, corrected, settled)]
    return Followed(plain, errors[0], corrected, errors[1], errors[2])


def measured(task: Task, parameters: Parameters) -> list[Followed]:
    """All runs, and the pictures of the first."""
    found = [followed(inverse, parameters) for _, inverse in runs(task, parameters)]
    draw(found[0], parameters, task)
    return found


def rows_of(found: list[Followed]) -> tuple[Row, ...]:
    """The errors of all runs."""
    rows = []
    for name, errors in (("", [run.errors for run in found]), (", with feedback", [run.corrected for run in found])):
        rounds = np.stack(errors).reshape(len(found), -1, AROUND)
        for number, values in enumerate(rounds.transpose(1, 0, 2), start=1):
            means = values.mean(axis=1)
            rows += [
                Row(f"round {number}{name}: error, mean", float(means.mean()), None, "mm"),
                Row(f"round {number}{name}: error, deviation along it", float(values.std(axis=1).mean()), None, "mm"),
                Row(f"round {number}{name}: error, best run", float(means.min()), None, "mm"),
                Row(f"round {number}{name}: error, worst run", float(means.max()), None, "mm"),
            ]
        rows.append(Row(f"greatest error once on the circle{name}", worst(errors), None, "mm"))
    begins, settled = (float(np.mean([run.errors[0] for run in found])), float(np.mean([run.settled for run in found])))
    rows.append(Row("error at the first point, one step from home, mean", begins, None, "mm"))
    return (*rows, Row("error where the arm may settle at each point, mean", settled, None, "mm"))


def worst(errors: list[Float[np.ndarray, " points"]]) -> float:
    """The greatest error of any run after the way from home [mm]."""
    return float(max(values[SETTLED_AFTER:].max() for values in errors))


def judged(found: list[Followed]) -> tuple[bool, str]:
    """Whether the text's claims hold, and the figures they stand on."""
    first, second = (
        float(np.mean([run.errors[part] for run in found])) for part in (slice(AROUND), slice(AROUND, None))
    )
    settled, far = float(np.mean([run.settled for run in found])), worst([run.errors for run in found])
    holds = second <= ENOUGH * first and second <= ENOUGH * settled and far <= 1000 * GOOD
    corrected = float(np.mean([run.corrected[AROUND:] for run in found]))
    verdict = (
        f"rounds at {first:.1f} and {second:.1f} mm, {settled:.1f} if the arm may settle at each point, at most "
        f"{far:.0f} once on the circle; with feedback {corrected:.1f} mm; mean of {len(found)} runs"
    )
    return holds, verdict


def figures_of(found: list[Followed]) -> dict[str, object]:
    """For the JSON file: each run's rounds."""
    rounds = lambda errors: errors.reshape(-1, AROUND).mean(axis=1).round(2).tolist()  # noqa: E731
    return {
        "round_mm_of_each_run": [rounds(run.errors) for run in found],
        "round_with_feedback_mm_of_each_run": [rounds(run.corrected) for run in found],
        "first_run_error_mm": found[0].errors.round(2).tolist(),
    }


def run(task: Task) -> Outcome:
    """The circle with the whole arm."""
    parameters = asked_for(task)
    found = measured(task, parameters)
    holds, verdict = judged(found)
    return Outcome(rows_of(found), verdict, holds, parameters, figures_of(found))


def draw(found: Followed, parameters: Parameters, task: Task) -> None:
    """Figures 2c and 2d, or 2e and 2f where actuators are locked."""
    from toddle.outside import soft_pictures

    body = load(parameters.robot)
    (way, errors), said = ("e", "f") if parameters.locked else ("c", "d"), ""
    if parameters.locked:
        said = f", the last {parameters.locked} actuators locked"
    ways = {"asked": circle(), "tip": found.way, "tip, with feedback": found.corrected_way}
    start = observer(body)(np.asarray(body.home, float)[None])[0]
    soft_pictures.ways_in_space(task.folder / f"figure-2-{way}.png", ways, start, title=f"figure 2{way}: circle{said}")
    soft_pictures.errors_along(
        task.folder / f"figure-2-{errors}.png", {"error": found.errors, "with feedback": found.corrected}, AROUND,
        title=f"figure 2{errors}: error along the circle{said}",
    )  # fmt: skip


EXPERIMENT = Experiment("thuruthel-circle", "Thuruthel 2016, figures 2c, 2d", run)
