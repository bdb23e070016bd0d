"""The methods by name: which explorer, which learner, which scales. The only place to edit to add one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import jax.numpy as jnp

from toddle.failures import BadInput, unknown_name
from toddle.reach.config import ReachConfig
from toddle.reach.explore.active import ActiveGoalExploration, ActiveMotorExploration
from toddle.reach.explore.direction import direction_sampling
from toddle.reach.explore.explorer import Explorer
from toddle.reach.explore.goal import GoalBabbling
from toddle.reach.explore.goal_and_motor import GoalAndMotorBabbling
from toddle.reach.explore.motor import ContinuousMotorBabbling, MotorBabbling
from toddle.reach.learn.learner import Learner
from toddle.reach.learn.local_linear import local_linear_map
from toddle.reach.learn.perceptron import Perceptron, refined
from toddle.reach.learn.recall import Recall
from toddle.reach.unit_box import UnitBox

_RANDOM_REGION = 0.3  # how often an active method goes to a region at random (Moulin-Frier 2013)


@dataclass(frozen=True)
class Method:
    """A way to explore, and what it learns with unless told otherwise.

    Attributes:
        name: on the command line.
        about: one line for the listing.
        source: document and section.
        explorer: makes the explorer for a configuration and a body's unit box.
        learner: the learner's name.
    """

    name: str
    about: str
    source: str
    explorer: Callable[[ReachConfig, UnitBox], Explorer]
    learner: str


def _goal_and_motor(config: ReachConfig, box: UnitBox) -> Explorer:
    # a memory has an answer of its own for every place it saw, and is best served by small steps
    size = jnp.float32(_or(config.perturbation, 0.03 if learner_named(config) == "recall" else 0.233))
    return (
        GoalAndMotorBabbling(size, ends="all", stall=0.0) if config.reading == "literal" else GoalAndMotorBabbling(size)
    )


def _motor(config: ReachConfig, box: UnitBox) -> Explorer:
    return MotorBabbling()


def _continuous_motor(config: ReachConfig, box: UnitBox) -> Explorer:
    return ContinuousMotorBabbling(jnp.float32(_or(config.perturbation, 0.1)))


def _goal(config: ReachConfig, box: UnitBox) -> Explorer:
    # Rolf's step, 2 cm, is a hundredth of his workspace of 2 m: arms of all sizes take theirs
    span = float(box.space_span.max())
    # and going home more often and faster than he does kept more of our arms to one way of bending
    return direction_sampling(box, step=0.01 * span, sigma=_or(config.perturbation, 0.05), p_home=0.8, home_step=0.2)


def _random_goal(config: ReachConfig, box: UnitBox) -> Explorer:
    return GoalBabbling(jnp.float32(_or(config.perturbation, 0.05)))


def _active_goal(config: ReachConfig, box: UnitBox) -> Explorer:
    return ActiveGoalExploration(jnp.float32(_or(config.perturbation, 0.05)), jnp.float32(_RANDOM_REGION))


def _active_motor(config: ReachConfig, box: UnitBox) -> Explorer:
    return ActiveMotorExploration(jnp.float32(_RANDOM_REGION))


def _local_linear(config: ReachConfig, box: UnitBox, hidden: tuple[int, ...]) -> Learner:
    return local_linear_map(len(box.space_span), learning_rate=_or(config.learning_rate, 0.3))


def _recall(config: ReachConfig, box: UnitBox, hidden: tuple[int, ...]) -> Learner:
    return Recall()


def _perceptron(config: ReachConfig, box: UnitBox, hidden: tuple[int, ...]) -> Learner:
    layers = hidden if config.hidden is None else config.hidden
    rate = jnp.float32(_or(config.learning_rate, 0.717))
    return refined(rate, layers) if config.network == "refined" else Perceptron(rate, layers)


_METHODS = (
    Method(
        "goal-and-motor-babbling",
        "lines in goal space, each with a perturbation of goal and motors",
        "Mahboob 2015, algorithm 1",
        _goal_and_motor,
        "perceptron",
    ),
    Method(
        "goal-babbling",
        "goals along lines, with a slowly changing perturbation; the arm goes home now and then",
        "Rolf 2013, direction sampling",
        _goal,
        "local-linear",
    ),
    Method(
        "random-goal-babbling",
        "goals at random, with a perturbation of the motors",
        "Moulin-Frier 2013, random goal",
        _random_goal,
        "local-linear",
    ),
    Method(
        "active-goal",
        "goals where the error is changing fastest",
        "Moulin-Frier 2013, active goal",
        _active_goal,
        "local-linear",
    ),
    Method(
        "active-motor",
        "joint values where the error is changing fastest",
        "Moulin-Frier 2013, active motor",
        _active_motor,
        "perceptron",
    ),
    Method(
        "motor-babbling",
        "joint values at random",
        "Moulin-Frier 2013, random motor",
        _motor,
        "perceptron",
    ),
    Method(
        "continuous-motor-babbling",
        "a random walk through joint space",
        "Thuruthel 2016, section 2",
        _continuous_motor,
        "perceptron",
    ),
)

METHODS: Mapping[str, Method] = {method.name: method for method in _METHODS}
LEARNERS: Mapping[str, Callable[[ReachConfig, UnitBox, tuple[int, ...]], Learner]] = {
    "perceptron": _perceptron,
    "local-linear": _local_linear,
    "recall": _recall,
}


def with_method(config: ReachConfig, joints: int, space: int) -> ReachConfig:
    """The configuration with what suits the arm, where it names nothing.

    With one joint to spare at most, the perceptron learns from goal and motor babbling as in the thesis. With more, the
    postures visited for one position differ so much that their mean is none of them: what was experienced is remembered
    instead of averaged over (`recall`). Hidden layers ask for the perceptron.

    Args:
        config: the run's configuration.
        joints: how many joints the arm has.
        space: how many coordinates its tip has.
    """
    if config.learner is None and config.hidden is not None:
        config = replace(config, learner="perceptron")
    if config.method is None:
        learner = config.learner or ("perceptron" if joints <= space + 1 else "recall")
        config = replace(config, method="goal-and-motor-babbling", learner=learner)
    return config


def method_named(name: str | None) -> Method:
    """The method of this name.

    Raises:
        BadInput: there is none; the nearest are named.
    """
    if name is None or name not in METHODS:
        raise unknown_name("method", str(name), METHODS, where="--method")
    return METHODS[name]


def learner_named(config: ReachConfig) -> str:
    """The name of the learner that a configuration asks for; needs no robot.

    Raises:
        BadInput: no such method or learner, or an option that it hasn't.
    """
    method = method_named(config.method)
    name = method.learner if config.learner is None else config.learner
    if name not in LEARNERS:
        raise unknown_name("learner", name, LEARNERS, where="--learner")
    if name != "perceptron" and config.hidden is not None:
        raise BadInput(f"{name} has no hidden layers", where="--hidden", remedy="add --learner perceptron")
    return name


def make_explorer(config: ReachConfig, box: UnitBox) -> Explorer:
    """The explorer that a configuration asks for, in a body's unit box."""
    return method_named(config.method).explorer(config, box)


def make_learner(config: ReachConfig, box: UnitBox, hidden: tuple[int, ...]) -> Learner:
    """The learner that a configuration asks for.

    Args:
        config: the run's configuration.
        box: the body's unit box.
        hidden: the robot's own choice of hidden layers, for where the configuration makes none.

    Raises:
        BadInput: no such learner, or an option that it hasn't.
    """
    return LEARNERS[learner_named(config)](config, box, hidden)


def _or(value: float | None, default: float) -> float:
    return default if value is None else value


def needs_equal_scales(config: ReachConfig) -> bool:
    """Whether the learner measures distances in space, so that one scale must serve all axes."""
    return learner_named(config) in ("local-linear", "recall")
