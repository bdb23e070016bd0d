"""What the experiments after Thuruthel 2016 share: the arm as it learns, the targets, the circle, the lost actuators.

The paper leaves out how long a step of the babbling is ("decided by trial and error"), how many samples the reported
network was trained on, and how long. eps was chosen, on other seeds than those reported, so that the solver settles in
about as many steps as the paper's; the samples are as many as stop helping much.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from toddle.experiments.experiment import Task
from toddle.reach.iterated import Act, IteratedInverse, learn_iterated
from toddle.reach.observe import observer
from toddle.robots.body import Body
from toddle.robots.catalogue import load

CENTRE, RADIUS, AROUND, ROUNDS = (0.0, 0.0, 0.7), 0.2, 100, 2  # [m], and points; section 4
STEPS, STEPS_DEVIATION = 5.68, 1.504  # movements until settled, section 4


@dataclass(frozen=True)
class Parameters:
    """Of an experiment.

    Attributes:
        robot: who learns.
        samples: movements that a network learns from.
        eps: the greatest change of posture in one of them, joints measured as shares of their ranges.
        noise: of the seen tip, uniform, on each axis [m].
        hidden: units of the network.
        iterations: of its training, at most.
        seeds: runs.
        targets: points to reach.
        locked: how many actuators, the last ones, stand still at home; nobody is told.
    """

    robot: str = "bha"
    samples: int = 8000
    eps: float = 1.1
    noise: float = 0.017
    hidden: int = 20
    iterations: int = 60
    seeds: int = 10
    targets: int = 50
    locked: int = 0


FULL = Parameters()
QUICK = replace(FULL, samples=3000, seeds=3)


def asked_for(task: Task, full: Parameters = FULL, quick: Parameters = QUICK) -> Parameters:
    """The parameters of a task."""
    chosen = full if task.full else quick
    return replace(chosen, seeds=task.seeds or chosen.seeds)


def learned(body: Body, parameters: Parameters, seed: int) -> IteratedInverse:
    """One run's inverse."""
    return learn_iterated(
        body, samples=parameters.samples, eps=parameters.eps, noise=parameters.noise, hidden=parameters.hidden,
        seed=seed, iterations=parameters.iterations,
    )  # fmt: skip


def runs(task: Task, parameters: Parameters) -> list[tuple[int, IteratedInverse]]:
    """Each run's seed and inverse; fewer where somebody asked to stop."""
    body, done = load(parameters.robot), []
    for number in range(parameters.seeds):
        if done and task.stopped():
            break
        seed = task.seed + number
        done.append((seed, learned(body, parameters, seed)))
        task.tell((number + 1) / parameters.seeds, f"run {number + 1}")
    return done


def random_targets(body: Body, count: int, seed: int) -> Float[np.ndarray, "points space"]:
    """Positions [m] of joint values drawn uniformly over their ranges, from a stream of their own."""
    share = np.random.default_rng([seed, count, 6]).uniform(size=(count, len(body.joints)))
    lower, upper = np.asarray(body.lower, float), np.asarray(body.upper, float)
    return observer(body)(lower + share * (upper - lower))


def circle() -> Float[np.ndarray, "points 3"]:
    """The path: 100 points a round, two rounds [m]."""
    angle = 2 * np.pi * np.arange(ROUNDS * AROUND) / AROUND
    return np.array(CENTRE) + RADIUS * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)


def acting(body: Body, locked: int = 0) -> Act:
    """The arm as it obeys: the last actuators may stand still at home, whatever they are told."""
    look: Callable[[np.ndarray], np.ndarray] = observer(body)
    home = np.asarray(body.home, float)

    def act(q: Float[np.ndarray, "points joints"]) -> tuple[np.ndarray, np.ndarray]:
        moved = q.copy()
        moved[:, len(home) - locked :] = home[len(home) - locked :]
        return moved, look(moved)

    return act
