"""Goals that nobody has seen, and what the same forward evaluations are worth otherwise (Martin 2009, section 5).

The document says that its controllers err on new random goals as little as on the 70 they evolved on. Here they are
put beside others who asked the same arm for no more positions than one run of evolution does (70 x 50 x 1000):

- restarts: one run's generations, shared by several shorter runs, of which the best on the 70 goals is taken;
- the body learned from a few hundred of the evaluations as unknown screws, and then, without asking the arm again,
  (a) the same controller by Levenberg-Marquardt through the model, from many starts, on the 70 goals or on goals that
  the model imagines; (b) no controller: each goal solved on the model by damped least squares.

All are judged by the true forward kinematics.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from toddle.experiments.experiment import Experiment, Outcome, Row, Task
from toddle.experiments.martin_arms import (
    ARMS,
    METHODS,
    Setting,
    arm_named,
    evolve,
    fresh_goals,
    goals_of,
    in_units,
    shape_of,
    telling,
)
from toddle.reach.evolve.controller import inputs_of, respond
from toddle.reach.evolve.evolution import Evolution
from toddle.reach.evolve.gradient import refine
from toddle.reach.evolve.score import Arm, scores, tips
from toddle.reach.model.model import Fit
from toddle.reach.model.screws import fit_screws
from toddle.reach.solve.solver import solver_of
from toddle.signals import Experience


@dataclass(frozen=True)
class Parameters:
    """Of the experiment.

    Attributes:
        setting: of the runs.
        restarts: shorter runs in the place of one.
        movements: that the body is learned from.
        noise: of the tip as it is seen, standard deviation on each axis, in the rows that say so [m].
        starts, iterations: of Levenberg-Marquardt; what it asks of the model is less than one run asks of the arm.
        imagined: goals that the model makes up.
        times: how much lower than CMA-ES's best run the stronger alternative is to be on fresh goals.
    """

    setting: Setting = field(default_factory=Setting)
    restarts: int = 4
    movements: int = 300
    noise: float = 0.001
    starts: int = 16
    iterations: int = 400
    imagined: int = 400
    times: float = 100.0


FULL = Parameters()
QUICK = replace(FULL, setting=Setting(runs=4, generations=400), iterations=200)


class Result(NamedTuple):
    """What one way came to.

    Attributes:
        asked: positions that the arm was asked for.
        trained: MSE on the 70 goals [units^2].
        fresh: MSE on fresh goals [units^2].
    """

    asked: int
    trained: float
    fresh: float


def run(task: Task) -> Outcome:
    """All ways on both arms."""
    parameters = FULL if task.full else QUICK
    setting = replace(parameters.setting, runs=task.seeds or parameters.setting.runs)
    parameters = replace(parameters, setting=setting)
    found: dict[str, dict[str, Result]] = {}
    for k, name in enumerate(ARMS):
        part = task.part(k / len(ARMS), (k + 1) / len(ARMS))
        found[name] = evolved(name, parameters, part) | learned(name, parameters, task.seed)
    rows = [
        row
        for name, ways in found.items()
        for way, result in ways.items()
        for row in (
            Row(f"{name} arm, {way}: MSE on fresh goals", result.fresh),
            Row(f"{name} arm, {way}: MSE on the 70 goals", result.trained),
        )
    ]
    times = {name: ways["CMA-ES, best run"].fresh / max(ways[SOLVED].fresh, 1e-300) for name, ways in found.items()}
    verdict = (
        "solving on the learned body, the mean squared distance on fresh goals is "
        + " and ".join(f"{value:.2g} times lower ({name} arm)" for name, value in times.items())
        + f" than that of CMA-ES's best run of {setting.runs} (asked: {parameters.times:g})"
    )
    holds = min(times.values()) >= parameters.times
    figures = {name: {way: result._asdict() for way, result in ways.items()} for name, ways in found.items()}
    return Outcome(tuple(rows), verdict, bool(holds), parameters, figures)


SOLVED = "body learned, each goal solved"


def evolved(name: str, parameters: Parameters, task: Task) -> dict[str, Result]:
    """Both methods as they are, and CMA-ES with restarts."""
    setting, arm = parameters.setting, arm_named(name)
    short = replace(
        setting, runs=setting.runs * parameters.restarts, generations=setting.generations // parameters.restarts
    )
    ways = {method: (method, setting) for method in METHODS} | {"CMA-ES, restarted": ("CMA-ES", short)}
    results: dict[str, Result] = {}
    for k, (way, (method, used)) in enumerate(ways.items()):
        tell = telling(task, f"{way}, {name} arm", k / len(ways), (k + 1) / len(ways))
        found = evolve(name, method, used, task.seed, tell)
        results |= _best_and_typical(way, arm, found, parameters, used)
    return results


def _best_and_typical(way: str, arm: Arm, found: Evolution, parameters: Parameters, used: Setting) -> dict[str, Result]:
    """The run that is best on the 70 goals, and the median of all runs (of all groups of restarts)."""
    goals = fresh_goals(arm, used)
    fresh, trained = in_units(scores(arm, found.answers(goals), goals)), in_units(found.mse)
    groups = trained.reshape(parameters.setting.runs, -1)
    chosen = groups.argmin(axis=1) + np.arange(len(groups)) * groups.shape[1]
    asked = used.goals * used.population * used.generations * groups.shape[1]
    best = chosen[trained[chosen].argmin()]
    return {
        f"{way}, best run": Result(asked, float(trained[best]), float(fresh[best])),
        f"{way}, median run": Result(asked, float(np.median(trained[chosen])), float(np.median(fresh[chosen]))),
    }


def learned(name: str, parameters: Parameters, seed: int) -> dict[str, Result]:
    """What becomes of a few hundred movements."""
    results: dict[str, Result] = {}
    arm, millimetres = arm_named(name), 1000 * parameters.noise
    for noise, said in ((0.0, ""), (parameters.noise, f", seen with {millimetres:g} mm noise")):
        known, fit = learn_body(name, arm, parameters.movements, noise, seed)
        if not noise:
            results |= controllers(arm, fit, parameters, seed)
        solver = solver_of(fit.model, arm.lower, arm.upper, known)
        sets = (goals_of(arm, parameters.setting, parameters.setting.goals, parameters.setting.goal_seed),
                fresh_goals(arm, parameters.setting))  # fmt: skip
        trained, fresh = (mse_of(arm, solver.solve(goals).q.T[None], goals) for goals in sets)
        results[SOLVED + said] = Result(parameters.movements, trained, fresh)
    return results


def learn_body(name: str, arm: Arm, movements: int, noise: float, seed: int) -> tuple[Experience, Fit]:
    """The arm as unknown screws, from postures uniform over its joints' ranges."""
    random = np.random.default_rng(seed)
    q = random.uniform(arm.lower, arm.upper, (movements, len(arm.lower)))
    x = tips(arm, q.T).T
    known = Experience(q, x + noise * random.standard_normal(x.shape))
    return known, fit_screws(known, joints=ARMS[name]().joints, seed=seed)


def controllers(arm: Arm, fit: Fit, parameters: Parameters, seed: int) -> dict[str, Result]:
    """The controller of CMA-ES by Levenberg-Marquardt through the model, on the 70 goals and on imagined ones."""
    setting = parameters.setting
    shape, fresh = shape_of(arm, setting, "CMA-ES"), fresh_goals(arm, setting)
    goals = goals_of(arm, setting, setting.goals, setting.goal_seed)
    imagined = goals_of(arm, setting, parameters.imagined, 2_000_003 + seed)
    starts = np.random.default_rng(seed).standard_normal((parameters.starts, shape.weights)) * 0.5
    results: dict[str, Result] = {}
    for way, given in (("70 goals", goals), (f"{parameters.imagined} imagined goals", imagined)):
        # imagined goals cost iterations: the model is asked for no more positions
        iterations = max(1, parameters.iterations * setting.goals // len(given))
        refined = refine(shape, fit.model, given, starts, iterations)
        best = refined.weights[refined.mse.argmin()][None]
        trained, new = (mse_of(arm, respond(shape, best, inputs_of(shape, some)), some) for some in (goals, fresh))
        results[f"body learned, controller by LM on {way}"] = Result(parameters.movements, trained, new)
    return results


def mse_of(arm: Arm, q: Float[np.ndarray, "1 joints goals"], goals: Float[np.ndarray, "goals space"]) -> float:
    """Mean squared distance by the true forward kinematics [units^2]."""
    return float(in_units(scores(arm, q, goals))[0])


EXPERIMENT = Experiment("martin-generalisation", "Martin 2009, section 5: fresh goals; stronger alternatives", run)
