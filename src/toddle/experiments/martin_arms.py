"""What the experiments after Martin 2009 share: the two arms, their goals, and what was taken where the text is silent.

The document prints lengths without a unit; here one of its units is a centimetre, and figures beside its own are in
its units again (an MSE in units^2).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from toddle.experiments.experiment import Task
from toddle.reach.evolve.controller import Scale, Shape
from toddle.reach.evolve.evolution import Effort, Evolution, Tell, evolve_networks, evolve_weights
from toddle.reach.evolve.neat import Settings
from toddle.reach.evolve.score import Arm, arm_of, scores
from toddle.robots.dh import UNIT, planar3, scara

ARMS = {"planar": planar3, "SCARA": scara}
METHODS = ("CMA-ES", "NEAT")


@dataclass(frozen=True)
class Setting:
    """Of a run. The document gives goals, population and generations; it is silent on the last seven.

    Attributes:
        goals: how many are to be reached.
        population, generations, runs: of evolution.
        neat: parameters of NEAT.
        hidden: neurons of the hidden layer that CMA-ES has.
        sigma: its first step size.
        inputs: the edges of the goals' box are given to CMA-ES's network as plus or minus this; 0: goals are given
            as they are, in the document's units.
        neat_inputs: the same for NEAT's; small, because the document's mutation of weights is coarse.
        outputs: joint values are tanh times this times the joint's upper limit (a quarter turn; 20 units of slide).
        goals_from: goals are forward kinematics of joint values uniform between these shares of the upper limit.
        goal_seed: which goals.
    """

    goals: int = 70
    population: int = 50
    generations: int = 1000
    runs: int = 30
    neat: Settings = field(default_factory=Settings)
    hidden: int = 7
    sigma: float = 0.25
    inputs: float = 1.0
    neat_inputs: float = 0.1
    outputs: float = 2.0
    goals_from: tuple[float, float] = (0.2, 0.8)
    goal_seed: int = 0


def arm_named(name: str) -> Arm:
    """The arm of table 1 (planar) or 2 (SCARA)."""
    return arm_of(ARMS[name]())


def goals_of(arm: Arm, setting: Setting, count: int, seed: int) -> Float[np.ndarray, "count space"]:
    """Goals that can be reached [m]."""
    return _drawn_from(arm, setting).drawn(count, seed)


def shape_of(arm: Arm, setting: Setting, method: str) -> Shape:
    """The controllers' shape, and the scales of what goes in and out."""
    box, edge = _drawn_from(arm, setting).workspace(), setting.neat_inputs if method == "NEAT" else setting.inputs
    raw = Scale(np.zeros_like(box.half), np.full_like(box.half, UNIT))
    inputs = box._replace(half=box.half / edge) if edge else raw
    return Shape(setting.hidden, inputs, Scale(np.zeros_like(arm.upper), setting.outputs * arm.upper))


def _drawn_from(arm: Arm, setting: Setting) -> Arm:
    """The arm, its joints limited to where goals come from."""
    low, high = (np.clip(share * arm.upper, arm.lower, arm.upper) for share in setting.goals_from)
    return replace(arm, lower=low, upper=high)


def telling(task: Task, what: str, begins: float, ends: float) -> Tell:
    """Tell the task what is done of a part of its work, and pass on whether somebody asked to stop."""
    part = task.part(begins, ends)

    def tell(done: float) -> bool:
        part.tell(0.99 * done, what)
        return task.stopped()

    return tell


def evolve(name: str, method: str, setting: Setting, seed: int, tell: Tell = lambda done: False) -> Evolution:
    """All runs of one method on one arm, side by side."""
    arm = arm_named(name)
    goals = goals_of(arm, setting, setting.goals, setting.goal_seed)
    effort = Effort(setting.runs, setting.population, setting.generations, seed)
    shape = shape_of(arm, setting, method)
    if method == "NEAT":
        return evolve_networks(arm, shape, goals, effort, settings=setting.neat, tell=tell)
    return evolve_weights(arm, shape, goals, effort, sigma=setting.sigma, tell=tell)


def fresh_goals(arm: Arm, setting: Setting, count: int = 2000) -> Float[np.ndarray, "count space"]:
    """Goals that no learner has seen [m]."""
    return goals_of(arm, setting, count, 1_000_003 + setting.goal_seed)


def fresh_mse(name: str, found: Evolution, setting: Setting) -> Float[np.ndarray, " runs"]:
    """Mean squared distance on fresh goals, of each run's best controller [units^2]."""
    arm = arm_named(name)
    goals = fresh_goals(arm, setting)
    return in_units(scores(arm, found.answers(goals), goals))


def in_units(mse: Float[np.ndarray, "*any"]) -> Float[np.ndarray, "*any"]:
    """From m^2 to the document's units^2."""
    return mse / UNIT**2


TABLE_3: Mapping[tuple[str, str], tuple[float, ...]] = {
    ("planar", "CMA-ES"): (
        0.1976, 0.2534, 0.4418, 0.4564, 0.5899, 0.6536, 0.7082, 0.7083, 0.7170, 0.7344, 0.7430, 0.8494, 0.8829, 1.4925,
        1.6220, 1.7418, 3.9612, 4.4558, 4.8925, 4.8925, 7.0904, 7.6592, 7.6592, 7.8173, 7.8329, 8.0296, 8.1561, 13.0978,
        13.4280, 14.1469,
    ),
    ("planar", "NEAT"): (
        4.1564, 4.4018, 4.4085, 4.4321, 4.5470, 4.6371, 4.7554, 4.7597, 4.8271, 4.8803, 4.8807, 4.8845, 4.8948, 4.9101,
        4.9245, 4.9577, 4.9630, 4.9940, 5.0297, 5.0404, 5.0636, 5.0913, 5.1121, 5.1135, 5.1272, 5.1390, 5.2663, 5.3292,
        5.4068, 5.7194,
    ),
    ("SCARA", "CMA-ES"): (
        0.0529, 0.1127, 0.1185, 0.1378, 0.1478, 0.1626, 0.1626, 0.1731, 0.1753, 0.1993, 0.2168, 0.2803, 0.3026, 0.3035,
        0.3305, 0.3980, 0.5338, 0.5338, 0.6743, 0.6953, 82.7127, 290.5997, 810.9170, 810.9179, 810.9188, 810.9190,
        810.9192, 810.9194, 810.9195, 810.9201,
    ),
    ("SCARA", "NEAT"): (
        10.3440, 11.7130, 12.7866, 12.9188, 12.9759, 13.0571, 13.1727, 13.2791, 13.9484, 13.9895, 14.1789, 14.5171,
        14.6569, 14.7743, 15.1011, 15.2932, 15.9752, 16.0734, 16.2729, 16.3697, 16.5736, 16.7219, 17.1179, 17.1195,
        17.1670, 17.3595, 17.4819, 17.8726, 18.1687, 18.3518,
    ),
}  # fmt: skip
"""Table 3, [units^2]."""
